//! GLSL → SPIR-V. The compiled words are kept in `shaders/spirv` beside a hash of all that they
//! were made from, so that building the crate needs no shader compiler. With the feature
//! `compile-shaders` everything is compiled again with shaderc and must equal what is kept; with
//! MESOLUX_KEEP_SPIRV=1 as well, the result is written there instead.

use std::fmt::Write as _;
use std::fs;

use sha2::{Digest, Sha256};

use crate::{Files, constants};

/// The SPIR-V of a shader.
pub fn words(name: &str, source: &str, shared: &Files) -> Result<Vec<u32>, String> {
    let bytes = bytes(name, source, shared, &hash(name, source, shared))?;
    if bytes.len() % 4 != 0 {
        return Err(format!("shaders/spirv/{name}.spv is not whole words"));
    }
    let words = bytes.chunks_exact(4);
    Ok(words
        .map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]]))
        .collect())
}

fn hash(name: &str, source: &str, shared: &Files) -> String {
    let mut hasher = Sha256::new();
    hasher.update(name);
    hasher.update(source);
    for (name, text) in shared {
        hasher.update(name);
        hasher.update(text);
    }
    hasher.update(format!("{:?}", constants::SHARED));
    hasher.finalize().iter().fold(String::new(), |mut s, b| {
        let _ = write!(s, "{b:02x}");
        s
    })
}

#[cfg(not(feature = "compile-shaders"))]
fn bytes(name: &str, _: &str, _: &Files, hash: &str) -> Result<Vec<u8>, String> {
    let kept = format!("shaders/spirv/{name}.spv");
    let of = fs::read_to_string(format!("shaders/spirv/{name}.sha256")).unwrap_or_default();
    if of.trim() != hash {
        return Err(format!(
            "{kept} is missing or older than shaders/{name}: build once with \
             MESOLUX_KEEP_SPIRV=1 cargo build --features compile-shaders"
        ));
    }
    fs::read(&kept).map_err(|e| format!("{kept}: {e}"))
}

#[cfg(feature = "compile-shaders")]
fn bytes(name: &str, source: &str, shared: &Files, hash: &str) -> Result<Vec<u8>, String> {
    let bytes = compile(name, source, shared)?;
    let kept = format!("shaders/spirv/{name}.spv");
    if std::env::var("MESOLUX_KEEP_SPIRV").is_ok_and(|v| v == "1") {
        fs::write(&kept, &bytes).map_err(|e| format!("{kept}: {e}"))?;
        fs::write(format!("shaders/spirv/{name}.sha256"), format!("{hash}\n"))
            .map_err(|e| format!("{kept}: {e}"))?;
    } else {
        let of = fs::read_to_string(format!("shaders/spirv/{name}.sha256")).unwrap_or_default();
        if fs::read(&kept).ok().as_deref() != Some(&bytes) || of.trim() != hash {
            return Err(format!(
                "{kept} differs from what shaders/{name} compiles to: build once with \
                 MESOLUX_KEEP_SPIRV=1"
            ));
        }
    }
    Ok(bytes)
}

#[cfg(feature = "compile-shaders")]
fn compile(name: &str, source: &str, shared: &Files) -> Result<Vec<u8>, String> {
    use shaderc::{
        CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind,
    };

    let kind = match name.rsplit('.').next() {
        Some("comp") => ShaderKind::Compute,
        Some("vert") => ShaderKind::Vertex,
        _ => ShaderKind::Fragment,
    };
    let compiler = Compiler::new().map_err(|e| e.to_string())?;
    let mut options = CompileOptions::new().map_err(|e| e.to_string())?;
    options.set_target_env(shaderc::TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
    options.set_optimization_level(OptimizationLevel::Performance);
    options.set_warnings_as_errors();
    for (constant, value) in constants::SHARED {
        options.add_macro_definition(constant, Some(&format!("{value}u")));
    }
    options.set_include_callback(|wanted, _, _, _| {
        let file = wanted.strip_prefix("shared/").unwrap_or(wanted);
        match shared.get(file) {
            Some(text) => Ok(ResolvedInclude {
                resolved_name: wanted.to_owned(),
                content: text.clone(),
            }),
            None => Err(format!("no shaders/{wanted}")),
        }
    });
    let binary = compiler
        .compile_into_spirv(
            source,
            kind,
            &format!("shaders/{name}"),
            "main",
            Some(&options),
        )
        .map_err(|e| e.to_string())?;
    Ok(binary.as_binary_u8().to_vec())
}
