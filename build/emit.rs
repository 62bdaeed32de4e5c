//! Writes the Rust module of each pipeline's shaders.

use std::collections::BTreeMap;
use std::fmt::{self, Write as _};

use crate::glsl::{Binding, Field, Kind};
use crate::interface::Program;

/// Modules by the stem of the shaders' files, and the list of all.
pub fn module(programs: &BTreeMap<String, Program>) -> Result<String, String> {
    let mut out = String::new();
    for (stem, program) in programs {
        program
            .check()
            .map_err(|e| format!("shaders/{stem}: {e}"))?;
        let fields = layout(&program.push_constants).map_err(|e| format!("shaders/{stem}: {e}"))?;
        // Variants of a shader that read the same share its types.
        let earlier = || programs.iter().take_while(|(other, _)| *other != stem);
        let bindings_of = earlier().find(|(_, p)| p.bindings == program.bindings);
        let parameters_of = earlier().find(|(_, p)| p.push_constants == program.push_constants);
        let written = program_module(
            &mut out,
            stem,
            program,
            &fields,
            [
                bindings_of.map(|(stem, _)| stem.as_str()),
                parameters_of.map(|(stem, _)| stem.as_str()),
            ],
        );
        written.map_err(|e| e.to_string())?;
    }
    all(&mut out, programs).map_err(|e| e.to_string())?;
    Ok(out)
}

fn program_module(
    out: &mut String,
    stem: &str,
    program: &Program,
    fields: &[Laid<'_>],
    [bindings_of, parameters_of]: [Option<&str>; 2],
) -> fmt::Result {
    let files: Vec<_> = (program.stages.iter())
        .map(|stage| format!("`shaders/{}`", stage.file))
        .collect();
    writeln!(out, "/// {}.", files.join(", "))?;
    writeln!(out, "pub mod {stem} {{")?;
    match bindings_of {
        Some(other) => writeln!(out, "pub use super::{other}::Bindings;")?,
        None => bindings(out, &program.bindings)?,
    }
    match parameters_of {
        Some(other) => writeln!(out, "pub use super::{other}::Parameters;")?,
        None => parameters(out, fields)?,
    }
    shader(out, program)?;
    writeln!(out, "}}")
}

fn bindings(out: &mut String, bindings: &[Binding]) -> fmt::Result {
    writeln!(out, "/// What is bound, by the names of the GLSL.")?;
    writeln!(out, "#[derive(Clone, Copy)]")?;
    writeln!(out, "pub struct Bindings<'a> {{")?;
    for binding in bindings {
        let rust = match binding.kind {
            Kind::Storage | Kind::Texels => "&'a crate::vk::Buffer",
            Kind::Sampled => "crate::vk::Sampled<'a>",
        };
        writeln!(
            out,
            "/// Binding {}: `{}`.",
            binding.number, binding.declaration
        )?;
        writeln!(out, "pub {}: {rust},", binding.name)?;
    }
    writeln!(out, "}}")?;
    writeln!(out, "impl crate::vk::ShaderBindings for Bindings<'_> {{")?;
    writeln!(
        out,
        "const BINDINGS: &'static [crate::vk::ShaderBinding] = &["
    )?;
    for Binding { name, kind, .. } in bindings {
        writeln!(
            out,
            "crate::vk::ShaderBinding {{ name: {name:?}, kind: crate::vk::Binding::{kind:?} }},"
        )?;
    }
    writeln!(out, "];")?;
    writeln!(out, "fn binds(&self) -> Vec<crate::vk::Bind<'_>> {{ vec![")?;
    for Binding { name, kind, .. } in bindings {
        writeln!(out, "crate::vk::Bind::{kind:?}(self.{name}),")?;
    }
    writeln!(out, "] }}")?;
    writeln!(out, "}}")
}

/// A push constant at its place in scalar layout.
struct Laid<'a> {
    field: &'a Field,
    rust_type: &'static str,
    offset: u32,
}

fn layout(fields: &[Field]) -> Result<Vec<Laid<'_>>, String> {
    let mut offset = 0;
    fields
        .iter()
        .map(|field| {
            let (rust_type, bytes) = rust_type(&field.glsl_type)?;
            let laid = Laid {
                field,
                rust_type,
                offset,
            };
            offset += bytes;
            Ok(laid)
        })
        .collect()
}

/// The Rust type of a GLSL type in scalar layout, and its bytes.
pub fn rust_type(glsl_type: &str) -> Result<(&'static str, u32), String> {
    Ok(match glsl_type {
        "uint" => ("u32", 4),
        "int" => ("i32", 4),
        "float" => ("f32", 4),
        "uvec2" => ("[u32; 2]", 8),
        "vec2" => ("glam::Vec2", 8),
        "vec3" => ("glam::Vec3", 12),
        "vec4" => ("glam::Vec4", 16),
        other => return Err(format!("the type {other} has no counterpart in Rust")),
    })
}

fn parameters(out: &mut String, fields: &[Laid<'_>]) -> fmt::Result {
    if fields.is_empty() {
        return writeln!(out, "/// None.\npub type Parameters = ();");
    }
    writeln!(out, "/// Push constants, by the names of the GLSL.")?;
    writeln!(out, "#[repr(C)]")?;
    writeln!(
        out,
        "#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]"
    )?;
    writeln!(out, "pub struct Parameters {{")?;
    for laid in fields {
        let Field { name, glsl_type } = laid.field;
        writeln!(out, "/// `{glsl_type}` at byte {}.", laid.offset)?;
        writeln!(out, "pub {name}: {},", laid.rust_type)?;
    }
    writeln!(out, "}}")?;
    for laid in fields {
        let (name, offset) = (&laid.field.name, laid.offset);
        writeln!(
            out,
            "const _: () = assert!(std::mem::offset_of!(Parameters, {name}) == {offset});"
        )?;
    }
    writeln!(out, "impl crate::vk::ShaderParameters for Parameters {{")?;
    writeln!(
        out,
        "const FIELDS: &'static [crate::vk::ShaderParameter] = &["
    )?;
    for laid in fields {
        let (name, offset) = (&laid.field.name, laid.offset);
        writeln!(
            out,
            "crate::vk::ShaderParameter {{ name: {name:?}, offset: {offset} }},"
        )?;
    }
    writeln!(out, "];")?;
    writeln!(out, "}}")
}

fn shader(out: &mut String, program: &Program) -> fmt::Result {
    for stage in &program.stages {
        let name = spirv_name(&stage.file);
        writeln!(out, "/// SPIR-V of `shaders/{}`.", stage.file)?;
        writeln!(out, "pub static {name}: &[u32] = &{:?};", stage.spirv)?;
    }
    let (kind, words) = match &program.stages[..] {
        [compute] => (
            "ComputeShader",
            format!("spirv: {},", spirv_name(&compute.file)),
        ),
        stages => (
            "GraphicsShaders",
            stages.iter().fold(String::new(), |mut words, stage| {
                let name = spirv_name(&stage.file);
                let _ = write!(words, "{}: {name},", name.to_lowercase());
                words
            }),
        ),
    };
    writeln!(
        out,
        "pub static SHADER: crate::vk::{kind}<'static> = crate::vk::{kind} {{ {words} \
         interface: crate::vk::Interface::of::<Bindings<'static>, Parameters>() }};",
    )
}

fn spirv_name(file: &str) -> &'static str {
    match file.rsplit('.').next() {
        Some("comp") => "COMPUTE",
        Some("vert") => "VERTEX",
        _ => "FRAGMENT",
    }
}

/// Every module, for tests.
fn all(out: &mut String, programs: &BTreeMap<String, Program>) -> fmt::Result {
    writeln!(out, "/// Every module, by name.")?;
    writeln!(out, "pub static ALL: &[Compiled] = &[")?;
    for (stem, program) in programs {
        let stages: Vec<_> = (program.stages.iter())
            .map(|stage| format!("{stem}::{}", spirv_name(&stage.file)))
            .collect();
        writeln!(
            out,
            "Compiled {{ name: {stem:?}, stages: &[{}], interface: {stem}::SHADER.interface }},",
            stages.join(", ")
        )?;
    }
    writeln!(out, "];")
}
