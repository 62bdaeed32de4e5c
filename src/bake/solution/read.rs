//! The file of a solution, read.

use std::collections::HashMap;
use std::path::Path;

use glam::Vec3;
use rayon::prelude::*;
use safetensors::{Dtype, SafeTensors};
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::write::{VERSION, checksum};
use super::{DirectionalLight, Origin};
use crate::error::{Error, Result};
use crate::input_file::read;
use crate::scene::OnInput;
use crate::scene::contents::{Contents, ElementCounts};
use crate::solver::BY_PAPER;

/// The part of a bake file that drawing needs.
pub struct Bake {
    pub origin: Origin,
    /// W·m⁻², RGB, `[triangle]` in the order of the input.
    pub irradiance: Vec<Vec3>,
    pub irradiance_direct: Vec<Vec3>,
    /// W·m⁻², RGB: πLe + ρE; of an element with a relief, the mean of what it sends.
    pub radiosity: Vec<Vec3>,
    /// At the corners, `[triangle][corner]`; none of a bake that was stopped before it had them.
    pub corner_irradiance: Option<Vec<[Vec3; 3]>>,
    /// Of this the part straight from emitters and point lights.
    pub corner_irradiance_direct: Option<Vec<[Vec3; 3]>>,
    pub relief: Option<DirectionalLight>,
    /// Where each triangle lies in the scene as it was read.
    pub on_input: Vec<OnInput>,
    /// Whether it was made by the paper's method.
    pub by_paper: bool,
}

impl Bake {
    /// Reads a bake.
    ///
    /// # Errors
    /// A file that is not a bake, is of another version, or whose tensors differ from what was
    /// written.
    pub fn load(path: &Path) -> Result<Self> {
        let (bake, ()) = Self::load_with(path, |_, _| Ok(()))?;
        Ok(bake)
    }

    /// Reads a bake, and meanwhile what `scene` makes of where it says that its scene is and where
    /// its triangles lie in that.
    ///
    /// # Errors
    /// As [`Self::load`]; then those of `scene`.
    pub fn load_with<T: Send>(
        path: &Path,
        scene: impl FnOnce(&Origin, &[OnInput]) -> Result<T> + Send,
    ) -> Result<(Self, T)> {
        let bytes = read(path)?;
        let file = File::new(path, &bytes)?;
        let (origin, on_input) = match (file.origin(), file.on_input()) {
            (Ok(origin), Ok(on_input)) => (origin, on_input),
            (origin, on_input) => {
                file.check()?;
                (origin?, on_input?)
            }
        };
        let (scene, (sound, bake)) = rayon::join(
            || scene(&origin, &on_input),
            || rayon::join(|| file.check(), || Self::of(&file)),
        );
        sound?;
        let bake = Self {
            origin,
            on_input,
            ..bake?
        };
        match bake.on_input.len() == bake.irradiance.len() {
            true => Ok((bake, scene?)),
            false => Err(file.bad("input_triangle", "not of as many triangles as irradiance")),
        }
    }

    /// All but `origin` and `on_input`.
    fn of(file: &File<'_>) -> Result<Self> {
        let path = file.path;
        let irradiance = file.vectors("irradiance", &[])?;
        let bake = Self {
            origin: Origin::default(),
            on_input: Vec::new(),
            irradiance_direct: file.vectors("irradiance_direct", &[])?,
            radiosity: file.vectors("radiosity", &[])?,
            corner_irradiance: file.corners("corner_irradiance", irradiance.len())?,
            corner_irradiance_direct: file.corners("corner_irradiance_direct", irradiance.len())?,
            relief: file.relief(irradiance.len())?,
            by_paper: file.json::<Value>("report")?["estimator"] == BY_PAPER,
            irradiance,
        };
        if file.words("material")?.len() != bake.irradiance.len() {
            return Err(file.bad("material", "not of as many triangles as irradiance"));
        }
        let alike = [&bake.irradiance_direct, &bake.radiosity].map(Vec::len);
        match alike == [bake.irradiance.len(); 2] {
            true => Ok(bake),
            false => Err(Error::file(
                path,
                "irradiance, irradiance_direct and radiosity differ in length",
            )),
        }
    }
}

/// What a bake file says of its scene and of how it was made.
pub struct About {
    pub origin: Origin,
    /// The program that made it, with its version.
    pub program: String,
    pub elements: usize,
    /// None of a bake of an earlier program.
    pub contents: Option<(Contents, ElementCounts)>,
    /// As JSON objects.
    pub settings: Value,
    pub report: Value,
}

impl About {
    /// Reads what a bake says of itself, and counts its elements.
    ///
    /// # Errors
    /// As [`Bake::load`]; metadata that is not there, is no JSON, or does not fit the tensors.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = read(path)?;
        let file = File::new(path, &bytes)?;
        file.check()?;
        let material = file.words("material")?;
        let triangle = file.words("input_triangle")?;
        if material.len() != triangle.len() {
            return Err(file.bad("material", "not of as many elements as input_triangle"));
        }
        let elements = material.len();
        let contents = match file.metadata.contains_key("contents") {
            false => None,
            true => {
                let contents: Contents = file.json("contents")?;
                let of = triangle.into_iter().zip(material);
                let counts = (contents.count(of)).map_err(|what| file.bad("contents", &what))?;
                Some((contents, counts))
            }
        };
        Ok(Self {
            origin: file.origin()?,
            program: file.text("program")?.to_owned(),
            elements,
            contents,
            settings: file.json("settings")?,
            report: file.json("report")?,
        })
    }
}

/// A bake file whose version is right.
struct File<'a> {
    tensors: SafeTensors<'a>,
    metadata: HashMap<String, String>,
    path: &'a Path,
}

impl<'a> File<'a> {
    fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self> {
        let bad = |what: String| Error::file(path, what);
        let (_, header) = SafeTensors::read_metadata(bytes)
            .map_err(|e| bad(format!("not a safetensors file: {e}")))?;
        let metadata = header.metadata().clone().unwrap_or_default();
        match metadata.get("version").map(String::as_str) {
            Some(VERSION) => {}
            Some(other) => {
                return Err(bad(format!(
                    "a bake of version {}; this program reads version {VERSION}",
                    other.escape_debug()
                )));
            }
            None => return Err(bad("not a bake: it has no version".into())),
        }
        let tensors = SafeTensors::deserialize(bytes).map_err(|e| bad(e.to_string()))?;
        Ok(Self {
            tensors,
            metadata: metadata.into_iter().collect(),
            path,
        })
    }

    /// Whether the tensors are those that were written.
    fn check(&self) -> Result<()> {
        // Bakes of earlier programs have none.
        let Some(expected) = self.metadata.get("sha256") else {
            return Ok(());
        };
        let tensors = (self.tensors.iter()).map(|(name, tensor)| (name, tensor.data()));
        match checksum(tensors) == *expected {
            true => Ok(()),
            false => Err(Error::file(
                self.path,
                "damaged: its tensors are not those that were written",
            )),
        }
    }

    fn origin(&self) -> Result<Origin> {
        self.json("scene")
    }

    fn text(&self, key: &str) -> Result<&str> {
        let found = self.metadata.get(key).map(String::as_str);
        found.ok_or_else(|| self.bad(key, "the metadata lacks it: bake again"))
    }

    fn json<T: DeserializeOwned>(&self, key: &str) -> Result<T> {
        let wrong = |e: serde_json::Error| self.bad(key, &format!("damaged metadata: {e}"));
        serde_json::from_str(self.text(key)?).map_err(wrong)
    }

    fn words(&self, name: &str) -> Result<Vec<u32>> {
        let words = self.tensor(name, Dtype::U32, &[])?;
        Ok(words.iter().copied().map(u32::from_le_bytes).collect())
    }

    fn bad(&self, name: &str, what: &str) -> Error {
        Error::file(self.path, format!("{name}: {what}"))
    }

    /// Words of a tensor of the shape `[N, inner…]`.
    fn tensor(&self, name: &str, dtype: Dtype, inner: &[usize]) -> Result<&'a [[u8; 4]]> {
        let tensor = self
            .tensors
            .tensor(name)
            .map_err(|e| self.bad(name, &e.to_string()))?;
        let shape = tensor.shape();
        if tensor.dtype() != dtype || shape.len() != 1 + inner.len() || shape[1..] != *inner {
            return Err(self.bad(name, &format!("not {dtype:?} [N, {inner:?}]")));
        }
        Ok(tensor.data().as_chunks().0)
    }

    /// Vectors, `[N][inner]`.
    fn vectors(&self, name: &str, inner: &[usize]) -> Result<Vec<Vec3>> {
        let blocks = self.blocks::<1>(name, inner)?;
        Ok(blocks.into_iter().map(|[vector]| vector).collect())
    }

    /// The same, in blocks of so many.
    fn blocks<const N: usize>(&self, name: &str, inner: &[usize]) -> Result<Vec<[Vec3; N]>> {
        let words = self.tensor(name, Dtype::F32, &[inner, &[3]].concat())?;
        let vectors = words.as_chunks().0;
        let blocks = vectors.as_chunks().0.par_iter();
        let blocks: Vec<[Vec3; N]> = blocks
            .map(|block| block.map(|vector| Vec3::from_array(vector.map(f32::from_le_bytes))))
            .collect();
        match blocks.par_iter().flatten_iter().all(|v| v.is_finite()) {
            true => Ok(blocks),
            false => Err(self.bad(name, "not all numbers are finite")),
        }
    }

    /// Light at the corners of so many triangles, where the file has it.
    fn corners(&self, name: &str, triangles: usize) -> Result<Option<Vec<[Vec3; 3]>>> {
        if !self.tensors.names().contains(&name) {
            return Ok(None);
        }
        let corners = self.blocks(name, &[3])?;
        match corners.len() == triangles {
            true => Ok(Some(corners)),
            false => Err(self.bad(name, "not of as many triangles as irradiance")),
        }
    }

    /// Where each triangle lies in the input.
    fn on_input(&self) -> Result<Vec<OnInput>> {
        let words = self.words("input_triangle")?;
        let corners = self.tensor("input_corners", Dtype::F32, &[3, 2])?;
        let corners: Vec<f64> = (corners.iter())
            .map(|&word| f64::from(f32::from_le_bytes(word)))
            .collect();
        if corners.len() != 6 * words.len() {
            return Err(self.bad(
                "input_corners",
                "not of as many triangles as input_triangle",
            ));
        }
        if !corners.iter().all(|weight| (0.0..=1.0).contains(weight)) {
            return Err(self.bad("input_corners", "a corner lies outside its triangle"));
        }
        let on_input = words.into_iter().zip(corners.chunks_exact(6));
        Ok(on_input
            .map(|(triangle, c)| OnInput {
                triangle,
                corners: [[c[0], c[1]], [c[2], c[3]], [c[4], c[5]]],
            })
            .collect())
    }

    /// Light by direction of some of the scene's `triangles` triangles.
    fn relief(&self, triangles: usize) -> Result<Option<DirectionalLight>> {
        if !self.tensors.names().contains(&"meso_elements") {
            return Ok(None);
        }
        let elements = self.words("meso_elements")?;
        if elements.windows(2).any(|pair| pair[0] >= pair[1])
            || elements.last().is_some_and(|&e| e as usize >= triangles)
        {
            return Err(self.bad("meso_elements", "not ascending triangles of the scene"));
        }
        let directions = self.vectors("directions", &[])?;
        let k = directions.len();
        let light = DirectionalLight {
            directions: directions.iter().map(|d| d.as_dvec3()).collect(),
            frames: self.blocks("meso_frames", &[3])?,
            incident_moment: self.blocks("incident_moment", &[k, 3])?,
            incident_moment_direct: self.blocks("incident_moment_direct", &[k, 3])?,
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
