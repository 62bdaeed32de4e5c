//! The file of a solution: safetensors with every tensor in scene units and in the order of the
//! input.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::Serialize;
use sha2::{Digest, Sha256};

use super::{DirectionalLight, Origin, Solution};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::scene::OnInput;

/// Version of the file's layout.
pub const VERSION: &str = "2";

/// One tensor to be written.
struct Tensor {
    name: &'static str,
    dtype: Dtype,
    shape: Vec<usize>,
    /// Little-endian.
    bytes: Vec<u8>,
}

impl Tensor {
    fn floats(name: &'static str, shape: &[usize], values: impl Iterator<Item = f32>) -> Self {
        Self {
            name,
            dtype: Dtype::F32,
            shape: shape.to_vec(),
            bytes: values.flat_map(f32::to_le_bytes).collect(),
        }
    }

    fn vectors<'a>(
        name: &'static str,
        shape: &[usize],
        values: impl IntoIterator<Item = &'a Vec3>,
    ) -> Self {
        Self::floats(name, shape, values.into_iter().flat_map(Vec3::to_array))
    }

    fn words(name: &'static str, values: &[u32]) -> Self {
        Self {
            name,
            dtype: Dtype::U32,
            shape: vec![values.len()],
            bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }
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
        let views = tensors
            .iter()
            .map(|t| TensorView::new(t.dtype, t.shape.clone(), &t.bytes).map(|v| (t.name, v)))
            .collect::<std::result::Result<Vec<_>, _>>()
            .map_err(|e| Error::file(path, e.to_string()))?;
        let bytes = safetensors::serialize(views, Some(metadata.into_iter().collect()))
            .map_err(|e| Error::file(path, e.to_string()))?;
        write_atomically(path, |file| file.write_all(&bytes))
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
        let entries = [
            ("version", VERSION.to_owned()),
            ("program", format!("mesolux {}", env!("CARGO_PKG_VERSION"))),
            ("scene_hash", origin.hash.clone()),
            ("scene", json(serde_json::to_string(origin))?),
            ("settings", json(serde_json::to_string(settings))?),
            ("report", json(serde_json::to_string(&self.report))?),
        ];
        Ok(entries.map(|(key, value)| (key.to_owned(), value)).into())
    }

    fn tensors(&self) -> Vec<Tensor> {
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
fn checksum<'a>(tensors: impl Iterator<Item = (&'a str, &'a [u8])>) -> String {
    let mut tensors: Vec<_> = tensors.collect();
    tensors.sort_unstable();
    let mut hash = Sha256::new();
    for (name, bytes) in tensors {
        hash.update(format!("{name} {}\n", bytes.len()));
        hash.update(bytes);
    }
    hash.finalize().iter().map(|b| format!("{b:02x}")).collect()
}

/// The part of a bake file that drawing needs.
pub struct Bake {
    pub origin: Origin,
    /// W·m⁻², RGB, `[triangle]` in the order of the input.
    pub irradiance: Vec<Vec3>,
    pub irradiance_direct: Vec<Vec3>,
    /// At the corners, `[triangle][corner]`; none of a bake that was stopped before it had them.
    pub corner_irradiance: Option<Vec<[Vec3; 3]>>,
    pub relief: Option<DirectionalLight>,
    /// Where each triangle lies in the scene as it was read.
    pub on_input: Vec<OnInput>,
}

impl Bake {
    /// Reads a bake.
    ///
    /// # Errors
    /// A file that is not a bake, is of another version, or whose tensors differ from what was
    /// written.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::read(path, e))?;
        let bad = |what: String| Error::file(path, what);
        let (_, header) = SafeTensors::read_metadata(&bytes)
            .map_err(|e| bad(format!("not a safetensors file: {e}")))?;
        let metadata = header.metadata().clone().unwrap_or_default();
        match metadata.get("version").map(String::as_str) {
            Some(VERSION) => {}
            Some(other) => {
                return Err(bad(format!(
                    "a bake of version {other}; this program reads version {VERSION}"
                )));
            }
            None => return Err(bad("not a bake: it has no version".into())),
        }
        let origin = metadata
            .get("scene")
            .and_then(|s| serde_json::from_str(s).ok())
            .ok_or_else(|| bad("not a bake: it does not name its scene".into()))?;
        let file = SafeTensors::deserialize(&bytes).map_err(|e| bad(e.to_string()))?;
        // Bakes of earlier programs have none.
        if let Some(expected) = metadata.get("sha256") {
            let tensors = file.iter().map(|(name, tensor)| (name, tensor.data()));
            if checksum(tensors) != *expected {
                return Err(bad(
                    "damaged: its tensors are not those that were written".into()
                ));
            }
        }
        let tensors = Tensors { file: &file, path };
        let irradiance = tensors.vectors("irradiance", &[])?;
        let bake = Self {
            origin,
            irradiance_direct: tensors.vectors("irradiance_direct", &[])?,
            corner_irradiance: tensors.corners("corner_irradiance", irradiance.len())?,
            relief: tensors.relief(irradiance.len())?,
            on_input: tensors.on_input(irradiance.len())?,
            irradiance,
        };
        match bake.irradiance.len() == bake.irradiance_direct.len() {
            true => Ok(bake),
            false => Err(bad(
                "irradiance and irradiance_direct differ in length".into()
            )),
        }
    }
}

/// Tensors of a bake file.
struct Tensors<'a> {
    file: &'a SafeTensors<'a>,
    path: &'a Path,
}

impl Tensors<'_> {
    fn bad(&self, name: &str, what: &str) -> Error {
        Error::file(self.path, format!("{name}: {what}"))
    }

    /// Words of a tensor of the shape `[N, inner…]`.
    fn tensor(&self, name: &str, dtype: Dtype, inner: &[usize]) -> Result<Vec<[u8; 4]>> {
        let tensor = self
            .file
            .tensor(name)
            .map_err(|e| self.bad(name, &e.to_string()))?;
        let shape = tensor.shape();
        if tensor.dtype() != dtype || shape.len() != 1 + inner.len() || shape[1..] != *inner {
            return Err(self.bad(name, &format!("not {dtype:?} [N, {inner:?}]")));
        }
        let words = tensor.data().chunks_exact(4);
        Ok(words.map(|b| [b[0], b[1], b[2], b[3]]).collect())
    }

    /// Vectors, `[N][inner]`.
    fn vectors(&self, name: &str, inner: &[usize]) -> Result<Vec<Vec3>> {
        let words = self.tensor(name, Dtype::F32, &[inner, &[3]].concat())?;
        let values: Vec<f32> = words.into_iter().map(f32::from_le_bytes).collect();
        if values.iter().any(|v| !v.is_finite()) {
            return Err(self.bad(name, "not all numbers are finite"));
        }
        Ok(values.chunks_exact(3).map(Vec3::from_slice).collect())
    }

    /// Light at the corners of so many triangles, where the file has it.
    fn corners(&self, name: &str, triangles: usize) -> Result<Option<Vec<[Vec3; 3]>>> {
        if !self.file.names().contains(&name) {
            return Ok(None);
        }
        let values = self.vectors(name, &[3])?;
        match values.len() == 3 * triangles {
            true => Ok(Some(values.as_chunks().0.to_vec())),
            false => Err(self.bad(name, "not of as many triangles as irradiance")),
        }
    }

    /// Where each of so many triangles lies in the input.
    fn on_input(&self, triangles: usize) -> Result<Vec<OnInput>> {
        let words = self.tensor("input_triangle", Dtype::U32, &[])?;
        let corners = self.tensor("input_corners", Dtype::F32, &[3, 2])?;
        let corners: Vec<f64> = (corners.into_iter())
            .map(|word| f64::from(f32::from_le_bytes(word)))
            .collect();
        if words.len() != triangles || corners.len() != 6 * triangles {
            return Err(self.bad("input_corners", "not of as many triangles as irradiance"));
        }
        if !corners.iter().all(|weight| (0.0..=1.0).contains(weight)) {
            return Err(self.bad("input_corners", "a corner lies outside its triangle"));
        }
        let on_input = words.into_iter().zip(corners.chunks_exact(6));
        Ok(on_input
            .map(|(triangle, c)| OnInput {
                triangle: u32::from_le_bytes(triangle),
                corners: [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]]],
            })
            .collect())
    }

    /// Light by direction of some of the scene's `triangles` triangles.
    fn relief(&self, triangles: usize) -> Result<Option<DirectionalLight>> {
        if !self.file.names().contains(&"meso_elements") {
            return Ok(None);
        }
        let elements: Vec<u32> = self
            .tensor("meso_elements", Dtype::U32, &[])?
            .into_iter()
            .map(u32::from_le_bytes)
            .collect();
        if elements.windows(2).any(|pair| pair[0] >= pair[1])
            || elements.last().is_some_and(|&e| e as usize >= triangles)
        {
            return Err(self.bad("meso_elements", "not ascending triangles of the scene"));
        }
        let directions = self.vectors("directions", &[])?;
        let k = directions.len();
        let blocks = |values: Vec<Vec3>| -> Vec<[Vec3; 3]> {
            values.chunks_exact(3).map(|b| [b[0], b[1], b[2]]).collect()
        };
        let light = DirectionalLight {
            directions: directions.iter().map(|d| d.as_dvec3()).collect(),
            frames: blocks(self.vectors("meso_frames", &[3])?),
            incident_moment: blocks(self.vectors("incident_moment", &[k, 3])?),
            incident_moment_direct: blocks(self.vectors("incident_moment_direct", &[k, 3])?),
            exitant: self.vectors("exitant", &[k])?,
            elements,
        };
        let (m, slots) = (light.elements.len(), light.elements.len() * k);
        let fits = light.frames.len() == m
            && light.incident_moment.len() == slots
            && light.incident_moment_direct.len() == slots
            && light.exitant.len() == slots;
        match fits {
            true => Ok(Some(light)),
            false => Err(self.bad(
                "meso_elements",
                "the tensors of the relief differ in length",
            )),
        }
    }
}
