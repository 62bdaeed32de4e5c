//! What a bake holds, and its file: safetensors with every tensor in scene units and in the order of the input.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};
use safetensors::{Dtype, SafeTensors, tensor::TensorView};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::atomic_file::write_atomically;
use crate::elements::Elements;
use crate::error::{Error, Result};
use crate::meso::Relief;
use crate::scene::Scene;
use crate::solver::{Light, ReliefLight, Report};

/// Version of the file's layout.
pub const VERSION: &str = "1";

/// A solution, `[triangle]` in the order of the input.
pub struct Solution {
    /// Corners, scene units.
    pub vertices: Vec<[DVec3; 3]>,
    /// Scene units squared.
    pub area: Vec<f64>,
    pub normal: Vec<DVec3>,
    /// Index into the scene's materials.
    pub material: Vec<u32>,
    /// W·m⁻², RGB, direct and indirect.
    pub irradiance: Vec<Vec3>,
    /// W·m⁻², RGB, straight from emitters and point lights.
    pub irradiance_direct: Vec<Vec3>,
    /// W·m⁻², RGB: πLe + ρE; of an element with a relief, the mean of what it sends.
    pub radiosity: Vec<Vec3>,
    /// Light by direction of the elements with a relief; none where no element has one.
    pub relief: Option<DirectionalLight>,
    pub report: Report,
}

/// Light by direction, `[meso element]` in the order of the input; slots as in [`crate::directions::Directions`].
pub struct DirectionalLight {
    /// Triangles of the input.
    pub elements: Vec<u32>,
    /// Middles of the slots in the tangent frame, `[slot]`.
    pub directions: Vec<DVec3>,
    /// Tangent (along u), bitangent (along v) and normal.
    pub frames: Vec<[Vec3; 3]>,
    /// ∫ L ω dω in the tangent frame, `[meso element][slot][colour]`, W·m⁻².
    pub incident_moment: Vec<[Vec3; 3]>,
    /// Of this what comes straight from emitters and point lights.
    pub incident_moment_direct: Vec<[Vec3; 3]>,
    /// πL sent into each slot, `[meso element][slot]`, RGB, W·m⁻².
    pub exitant: Vec<Vec3>,
}

impl DirectionalLight {
    fn new(elements: &Elements, relief: &Relief, light: &ReliefLight) -> Self {
        let k = relief.directions.count();
        let mut order: Vec<usize> = (0..light.elements.len()).collect();
        let input = |m: usize| elements.input_index[light.elements[m] as usize];
        order.sort_by_key(|&m| input(m));
        let slots = |m: usize| m * k..(m + 1) * k;
        Self {
            elements: order.iter().map(|&m| input(m)).collect(),
            directions: (0..k).map(|slot| relief.directions.centre(slot)).collect(),
            frames: order
                .iter()
                .map(|&m| light.elements[m] as usize)
                .map(|e| {
                    [
                        relief.tangent[e],
                        relief.bitangent[e],
                        elements.normal[e].as_vec3(),
                    ]
                })
                .collect(),
            incident_moment: order
                .iter()
                .flat_map(|&m| light.moments[slots(m)].to_vec())
                .collect(),
            incident_moment_direct: order
                .iter()
                .flat_map(|&m| light.moments_direct[slots(m)].to_vec())
                .collect(),
            exitant: order
                .iter()
                .flat_map(|&m| light.exitant[slots(m)].to_vec())
                .collect(),
        }
    }
}

/// Where a bake's scene came from: enough to read it again.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Origin {
    /// As on the command line: a built-in name, or a path made absolute.
    pub scene: String,
    pub patches: Option<usize>,
    pub statue: Option<std::path::PathBuf>,
    /// [`Scene::hash`].
    pub hash: String,
}

impl Solution {
    pub fn new(scene: &Scene, elements: &Elements, light: &Light, report: Report) -> Self {
        let unit = elements.unit;
        let area: Vec<f64> = elements.area.iter().map(|a| a * unit * unit).collect();
        Self {
            vertices: scene.triangles.iter().map(|t| scene.corners(t)).collect(),
            area: elements.to_input_order(&area),
            normal: elements.to_input_order(&elements.normal),
            material: elements.to_input_order(&elements.material),
            irradiance: elements.to_input_order(&light.irradiance),
            irradiance_direct: elements.to_input_order(&light.irradiance_direct),
            radiosity: elements.to_input_order(&light.radiosity),
            relief: elements
                .relief
                .as_ref()
                .zip(light.relief.as_ref())
                .map(|(relief, light)| DirectionalLight::new(elements, relief, light)),
            report,
        }
    }

    /// Writes the solution beside `path`, syncs it, and renames it there.
    pub fn save(&self, path: &Path, origin: &Origin, settings: &impl Serialize) -> Result<()> {
        let json = |value: serde_json::Result<String>| {
            value.map_err(|e| Error::file(path, format!("metadata: {e}")))
        };
        let mut metadata = HashMap::from([
            ("version".to_owned(), VERSION.to_owned()),
            (
                "program".to_owned(),
                format!("mesolux {}", env!("CARGO_PKG_VERSION")),
            ),
            ("scene_hash".to_owned(), origin.hash.clone()),
            ("scene".to_owned(), json(serde_json::to_string(origin))?),
            (
                "settings".to_owned(),
                json(serde_json::to_string(settings))?,
            ),
            (
                "report".to_owned(),
                json(serde_json::to_string(&self.report))?,
            ),
        ]);
        let count = self.area.len();
        let floats = |values: &mut dyn Iterator<Item = f32>| -> Vec<u8> {
            values.flat_map(f32::to_le_bytes).collect()
        };
        let rgb = |values: &[Vec3]| floats(&mut values.iter().flat_map(Vec3::to_array));
        let material: Vec<u8> = self.material.iter().flat_map(|m| m.to_le_bytes()).collect();
        let mut parts: Vec<(&str, Dtype, Vec<usize>, Vec<u8>)> = vec![
            (
                "vertices",
                Dtype::F32,
                vec![count, 3, 3],
                floats(
                    &mut self
                        .vertices
                        .iter()
                        .flatten()
                        .flat_map(|v| v.as_vec3().to_array()),
                ),
            ),
            (
                "area",
                Dtype::F32,
                vec![count],
                floats(&mut self.area.iter().map(|&a| a as f32)),
            ),
            (
                "normal",
                Dtype::F32,
                vec![count, 3],
                floats(&mut self.normal.iter().flat_map(|n| n.as_vec3().to_array())),
            ),
            ("material", Dtype::U32, vec![count], material),
            (
                "irradiance",
                Dtype::F32,
                vec![count, 3],
                rgb(&self.irradiance),
            ),
            (
                "irradiance_direct",
                Dtype::F32,
                vec![count, 3],
                rgb(&self.irradiance_direct),
            ),
            (
                "radiosity",
                Dtype::F32,
                vec![count, 3],
                rgb(&self.radiosity),
            ),
        ];
        if let Some(relief) = &self.relief {
            let (m, k) = (relief.elements.len(), relief.directions.len());
            let blocks = |values: &[[Vec3; 3]]| {
                floats(&mut values.iter().flatten().flat_map(Vec3::to_array))
            };
            let words = relief
                .elements
                .iter()
                .flat_map(|e| e.to_le_bytes())
                .collect();
            let directions: Vec<Vec3> = relief.directions.iter().map(|d| d.as_vec3()).collect();
            let f32s = Dtype::F32;
            parts.extend([
                ("meso_elements", Dtype::U32, vec![m], words),
                ("directions", f32s, vec![k, 3], rgb(&directions)),
                ("meso_frames", f32s, vec![m, 3, 3], blocks(&relief.frames)),
                (
                    "incident_moment",
                    f32s,
                    vec![m, k, 3, 3],
                    blocks(&relief.incident_moment),
                ),
                (
                    "incident_moment_direct",
                    f32s,
                    vec![m, k, 3, 3],
                    blocks(&relief.incident_moment_direct),
                ),
                ("exitant", f32s, vec![m, k, 3], rgb(&relief.exitant)),
            ]);
        }
        let parts_of_file = parts.iter().map(|(name, .., bytes)| (*name, &bytes[..]));
        metadata.insert("sha256".to_owned(), checksum(parts_of_file));
        let tensors = parts
            .iter()
            .map(|(name, dtype, shape, bytes)| {
                TensorView::new(*dtype, shape.clone(), bytes).map(|view| (*name, view))
            })
            .collect::<std::result::Result<Vec<_>, _>>()
            .map_err(|e| Error::file(path, e.to_string()))?;
        let bytes = safetensors::serialize(tensors, Some(metadata.into_iter().collect()))
            .map_err(|e| Error::file(path, e.to_string()))?;
        write_atomically(path, |file| file.write_all(&bytes))
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

/// What drawing needs of a bake file.
pub struct Bake {
    pub origin: Origin,
    /// W·m⁻², RGB, `[triangle]` in the order of the input.
    pub irradiance: Vec<Vec3>,
    pub irradiance_direct: Vec<Vec3>,
    pub relief: Option<DirectionalLight>,
}

impl Bake {
    /// Reads a bake; refuses files of another make or version, and those whose tensors are not what was written.
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
            relief: tensors.relief(irradiance.len())?,
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

    /// Values of a tensor of so many dimensions whose last ones are `inner`.
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

    /// Light by direction of some of so many triangles.
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
