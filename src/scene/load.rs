//! Resolves a scene argument and reads the scene.

use std::path::Path;

use super::assemble::Assembly;
use super::material::TextureCache;
#[cfg(feature = "formats")]
use super::scene_file;
use super::text_file::stem;
use super::{BuiltinOptions, Scene, builtin, check, obj};
use crate::error::{Error, Result};

/// Reads the scene that `spec` names: a built-in one ([`builtin::NAMES`]), an `.obj` file or a
/// `scene.toml` file.
///
/// # Errors
/// A name that is none of these; a file that cannot be read or used, with the line or the material;
/// a scene that cannot be baked.
pub fn load(spec: &str, options: &BuiltinOptions) -> Result<Scene> {
    if builtin::NAMES.contains(&spec) {
        return builtin::build(spec, options);
    }
    let path = Path::new(spec);
    let extension = path
        .extension()
        .map(|e| e.to_string_lossy().to_lowercase())
        .unwrap_or_default();
    if !matches!(extension.as_str(), "obj" | "toml") {
        return Err(Error::Usage(format!(
            "scene \"{spec}\" is neither a built-in scene ({}) nor a path that ends in .obj or .toml",
            builtin::NAMES.join(", ")
        )));
    }
    if options.patches.is_some() || options.statue.is_some() {
        return Err(Error::Usage(format!(
            "a number of patches and a statue belong to the built-in scenes ({}), not to {spec}",
            builtin::NAMES.join(", ")
        )));
    }
    match extension.as_str() {
        "obj" => load_obj(path),
        #[cfg(feature = "formats")]
        _ => scene_file::load(path),
        #[cfg(not(feature = "formats"))]
        _ => Err(Error::Usage(format!(
            "scene {spec}: scene.toml needs the Cargo feature `formats`"
        ))),
    }
}

fn load_obj(path: &Path) -> Result<Scene> {
    let mesh = obj::read(path, &mut TextureCache::default())?;
    let mut assembly = Assembly::new(stem(path), Some(path));
    let materials = assembly.add_materials(&mesh.materials);
    assembly.add_mesh(&mesh, &materials)?;
    assembly.scene.notes.extend(mesh.notes);
    assembly
        .scene
        .notes
        .extend(mesh.made_up.iter().map(|made_up| made_up.to_string()));
    check::finish(assembly.into_scene())
}
