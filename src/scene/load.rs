//! Resolves a scene argument and reads the scene.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::assemble::Assembly;
use super::material::TextureCache;
#[cfg(feature = "formats")]
use super::scene_file;
use super::stem::stem;
use super::{Scene, builtin, check, mesh_file};
use crate::error::{Error, Result};

/// How a scene is read.
#[derive(Debug, Clone, Default)]
pub struct LoadOptions {
    /// Of a built-in scene: the exact number of elements.
    pub patches: Option<usize>,
    /// Of a built-in scene: an OBJ mesh, y up, head towards −z, in place of the statue made by
    /// code.
    pub statue: Option<PathBuf>,
    pub import: ImportOptions,
}

/// How the files of other programs are read.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ImportOptions {
    /// Integrates heights from a normal map that has none, so that it makes a relief.
    pub heights_from_normals: bool,
    /// Turns OBJ meshes by −90° about x: their z axis points up.
    pub z_up: bool,
    /// Leaves pieces that show light only their backs as they are, instead of turning them.
    pub sides_as_given: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            heights_from_normals: true,
            z_up: false,
            sides_as_given: false,
        }
    }
}

/// Reads the scene that `spec` names: a built-in one ([`builtin::NAMES`]), an `.obj` file or a
/// `scene.toml` file.
///
/// # Errors
/// A name that is none of these; a file that cannot be read or used, with the line or the material;
/// a scene that cannot be baked.
pub fn load(spec: &str, options: &LoadOptions) -> Result<Scene> {
    if builtin::NAMES.contains(&spec) {
        return builtin::build(spec, options);
    }
    let path = Path::new(spec);
    let ending = mesh_file::ending(path);
    let is_mesh = mesh_file::ENDINGS.contains(&ending.as_str());
    if !is_mesh && ending != "toml" {
        return Err(Error::Usage(format!(
            "scene \"{spec}\" is neither a built-in scene ({}) nor a path that ends in .obj, .gltf, \
             .glb or .toml",
            builtin::NAMES.join(", ")
        )));
    }
    if options.patches.is_some() || options.statue.is_some() {
        return Err(Error::Usage(format!(
            "a number of patches and a statue belong to the built-in scenes ({}), not to {spec}",
            builtin::NAMES.join(", ")
        )));
    }
    if is_mesh {
        return load_mesh(path, &options.import);
    }
    #[cfg(feature = "formats")]
    return scene_file::load(path, &options.import);
    #[cfg(not(feature = "formats"))]
    Err(Error::Usage(format!(
        "scene {spec}: scene.toml needs the Cargo feature `formats`"
    )))
}

fn load_mesh(path: &Path, import: &ImportOptions) -> Result<Scene> {
    let read = mesh_file::read(path, import.z_up, &mut TextureCache::default())?;
    let mut assembly = Assembly::new(stem(path), Some(path));
    assembly.add(read, None)?;
    check::finish(assembly.into_imported(import)?, import)
}
