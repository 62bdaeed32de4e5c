//! The file of a solution, written: safetensors with every tensor in scene units and in the order
//! of the input.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;
pub use safetensors::Dtype;
use safetensors::tensor::TensorView;
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{DirectionalLight, Origin, Solution};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

/// Version of the file's layout.
pub const VERSION: &str = "2";

/// One tensor of a bake's file.
#[derive(Debug, Clone, PartialEq)]
pub struct Tensor {
    pub name: &'static str,
    pub dtype: Dtype,
    pub shape: Vec<usize>,
    /// Little-endian.
    pub bytes: Vec<u8>,
}

impl Tensor {
    pub(crate) fn floats(
        name: &'static str,
        shape: &[usize],
        values: impl Iterator<Item = f32>,
    ) -> Self {
        Self {
            name,
            dtype: Dtype::F32,
            shape: shape.to_vec(),
            bytes: values.flat_map(f32::to_le_bytes).collect(),
        }
    }

    pub(crate) fn vectors<'a>(
        name: &'static str,
        shape: &[usize],
        values: impl IntoIterator<Item = &'a Vec3>,
    ) -> Self {
        Self::floats(name, shape, values.into_iter().flat_map(Vec3::to_array))
    }

    pub(crate) fn words(name: &'static str, values: &[u32]) -> Self {
        Self {
            name,
            dtype: Dtype::U32,
            shape: vec![values.len()],
            bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }
}

/// Writes tensors to a temporary file beside `path`, syncs it, and renames it to `path`.
///
/// # Errors
/// A file that cannot be written.
pub(crate) fn write_tensors(
    path: &Path,
    tensors: &[Tensor],
    metadata: HashMap<String, String>,
) -> Result<()> {
    let views = tensors
        .iter()
        .map(|t| TensorView::new(t.dtype, t.shape.clone(), &t.bytes).map(|v| (t.name, v)))
        .collect::<std::result::Result<Vec<_>, _>>()
        .map_err(|e| Error::file(path, e.to_string()))?;
    let bytes = safetensors::serialize(views, Some(metadata.into_iter().collect()))
        .map_err(|e| Error::file(path, e.to_string()))?;
    write_atomically(path, |file| file.write_all(&bytes))
}

impl Solution {
    /// Writes the solution to a temporary file beside `path`, syncs it, and renames it to `path`.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn save(&self, path: &Path, origin: &Origin, settings: &impl Serialize) -> Result<()> {
        let tensors = self.tensors();
        let mut metadata = self.metadata(path, origin, settings)?;
        let bytes_by_name = tensors.iter().map(|t| (t.name, &t.bytes[..]));
        metadata.insert("sha256".to_owned(), checksum(bytes_by_name));
        write_tensors(path, &tensors, metadata)
    }

    fn metadata(
        &self,
        path: &Path,
        origin: &Origin,
        settings: &impl Serialize,
    ) -> Result<HashMap<String, String>> {
        let json = |value: serde_json::Result<String>| {
            value.map_err(|e| Error::file(path, format!("metadata: {e}")))
        };
        let origin = origin.seen_from(path);
        let mut entries = vec![
            ("version", VERSION.to_owned()),
            ("program", format!("mesolux {}", env!("CARGO_PKG_VERSION"))),
            ("scene_hash", origin.hash.clone()),
            ("scene", json(serde_json::to_string(&origin))?),
            ("settings", json(serde_json::to_string(settings))?),
            ("report", json(serde_json::to_string(&self.report))?),
        ];
        if let Some(contents) = &self.contents {
            entries.push(("contents", json(serde_json::to_string(contents))?));
        }
        let entries = entries.into_iter();
        Ok(entries
            .map(|(key, value)| (key.to_owned(), value))
            .collect())
    }

    /// What is written, in scene units and in the order of the input; `docs/bake-format.md` says
    /// what each tensor is.
    pub fn tensors(&self) -> Vec<Tensor> {
        let n = self.area.len();
        let vertices = self.vertices.iter().flatten();
        let mut tensors = vec![
            Tensor::floats(
                "vertices",
                &[n, 3, 3],
                vertices.flat_map(|v| v.as_vec3().to_array()),
            ),
            Tensor::floats("area", &[n], self.area.iter().map(|&a| a as f32)),
            Tensor::floats(
                "normal",
                &[n, 3],
                self.normal.iter().flat_map(|n| n.as_vec3().to_array()),
            ),
            Tensor::words("material", &self.material),
            Tensor::vectors("irradiance", &[n, 3], &self.irradiance),
            Tensor::vectors("irradiance_direct", &[n, 3], &self.irradiance_direct),
            Tensor::vectors("radiosity", &[n, 3], &self.radiosity),
        ];
        let triangles: Vec<u32> = self.on_input.iter().map(|on| on.triangle).collect();
        tensors.push(Tensor::words("input_triangle", &triangles));
        let corners = self
            .on_input
            .iter()
            .flat_map(|on| on.corners.as_flattened());
        let corners = corners.map(|&weight| weight as f32);
        tensors.push(Tensor::floats("input_corners", &[n, 3, 2], corners));
        if let Some(corners) = &self.corners {
            let at_corners = |name, light: &[[Vec3; 3]]| {
                Tensor::vectors(name, &[n, 3, 3], light.iter().flatten())
            };
            let direct = &corners.irradiance_direct;
            tensors.push(at_corners("corner_irradiance", &corners.irradiance));
            tensors.push(at_corners("corner_irradiance_direct", direct));
        }
        if let Some(relief) = &self.relief {
            tensors.extend(relief.tensors());
        }
        tensors
    }
}

impl DirectionalLight {
    fn tensors(&self) -> [Tensor; 6] {
        let (m, k) = (self.elements.len(), self.directions.len());
        let directions: Vec<Vec3> = self.directions.iter().map(|d| d.as_vec3()).collect();
        let moments = |name, moments: &[[Vec3; 3]]| {
            Tensor::vectors(name, &[m, k, 3, 3], moments.iter().flatten())
        };
        [
            Tensor::words("meso_elements", &self.elements),
            Tensor::vectors("directions", &[k, 3], &directions),
            Tensor::vectors("meso_frames", &[m, 3, 3], self.frames.iter().flatten()),
            moments("incident_moment", &self.incident_moment),
            moments("incident_moment_direct", &self.incident_moment_direct),
            Tensor::vectors("exitant", &[m, k, 3], &self.exitant),
        ]
    }
}

/// SHA-256 in hexadecimal over tensors by name, with their names and lengths.
pub(super) fn checksum<'a>(tensors: impl Iterator<Item = (&'a str, &'a [u8])>) -> String {
    let mut tensors: Vec<_> = tensors.collect();
    tensors.sort_unstable();
    let mut hash = Sha256::new();
    for (name, bytes) in tensors {
        hash.update(format!("{name} {}\n", bytes.len()));
        hash.update(bytes);
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}
