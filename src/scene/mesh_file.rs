//! Files that hold a mesh: OBJ and glTF.

use std::path::Path;

use super::assemble::Mesh;
use super::material::TextureCache;
use super::{Camera, Lights, obj};
use crate::error::{Error, Result};

/// What such a file holds.
#[derive(Debug, Default)]
pub(super) struct MeshFile {
    pub mesh: Mesh,
    /// Whether surfaces of each material have two sides, `[material]`; none has beyond the list.
    pub two_sided: Vec<bool>,
    pub lights: Lights,
    pub cameras: Vec<Camera>,
}

/// Endings of files that hold a mesh, in lower case.
pub(super) const ENDINGS: [&str; 3] = ["obj", "gltf", "glb"];

/// The ending of a path, in lower case.
pub(super) fn ending(path: &Path) -> String {
    let ending = path.extension().unwrap_or_default();
    ending.to_string_lossy().to_lowercase()
}

/// Reads a mesh; `z_up` turns that of a format that does not say which axis points up.
///
/// # Errors
/// Those of [`obj::read`] and of glTF.
pub(super) fn read(path: &Path, z_up: bool, textures: &mut TextureCache) -> Result<MeshFile> {
    match ending(path).as_str() {
        #[cfg(feature = "formats")]
        "gltf" | "glb" => super::gltf_file::read(path),
        #[cfg(not(feature = "formats"))]
        "gltf" | "glb" => Err(Error::file(path, "glTF needs the Cargo feature `formats`")),
        "obj" => {
            let mut mesh = obj::read(path, textures)?;
            if z_up {
                mesh.turn_z_up();
            }
            Ok(MeshFile {
                mesh,
                ..MeshFile::default()
            })
        }
        _ => Err(Error::file(path, "a mesh is an .obj, .gltf or .glb file")),
    }
}
