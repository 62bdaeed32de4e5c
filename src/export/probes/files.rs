//! Files of probes: JSON, and safetensors with the same in binary form.

use std::path::Path;

use serde_json::json;

use super::{COEFFICIENTS, Probes, SIDE};
use crate::atomic_file::write_atomically;
use crate::bake::solution::{Tensor, write_tensors};
use crate::error::{Error, Result};

/// Name and version of the layout.
const FORMAT: &str = "mesolux probes 2";

/// What the file says of its coefficients.
const HARMONICS: &str = "real, orthonormal: 00, 1-1, 10, 11, 2-2, 2-1, 20, 21, 22; \
                         E(n) = sum c Y(n), W/m2";

/// What it says of its walls.
const PLANES: &str = "[row][column][x, y, z, distance] over an octahedral map, x and y along its \
                      columns and rows: a place p is seen if (p - position) . xyz <= distance, \
                      scene units";

/// A kind of file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProbeFile {
    Json,
    Tensors,
}

impl ProbeFile {
    /// By a path's ending, in upper or lower case.
    ///
    /// # Errors
    /// Any other ending.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("json") => Ok(Self::Json),
            Some("safetensors") => Ok(Self::Tensors),
            _ => Err(Error::Usage(format!(
                "{}: probes are written as .json or .safetensors",
                path.display()
            ))),
        }
    }
}

impl Probes {
    /// Writes them as the path's ending says; `docs/probe-format.md` says what the file holds.
    ///
    /// # Errors
    /// Any other ending; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        match ProbeFile::of(path)? {
            ProbeFile::Json => self.write_json(path),
            ProbeFile::Tensors => self.write_binary(path),
        }
    }

    fn write_json(&self, path: &Path) -> Result<()> {
        let of_each = self.list.iter().zip(&self.walls);
        let each: Vec<_> = of_each
            .map(|(probe, walls)| {
                json!({
                    "position": probe.position.to_array(),
                    "valid": probe.valid,
                    "irradiance": probe.irradiance.map(|c| c.to_array()),
                    "walls": walls.planes,
                })
            })
            .collect();
        let mut all = json!({
            "format": FORMAT,
            "harmonics": HARMONICS,
            "planes": PLANES,
            "side": SIDE,
            "probes": each,
        });
        if let Some(grid) = self.grid {
            all["counts"] = json!(grid.counts);
            all["low"] = json!(grid.low.to_array());
            all["high"] = json!(grid.high.to_array());
        }
        let text = serde_json::to_string(&all).map_err(|e| Error::file(path, e.to_string()))?;
        write_atomically(path, |out| out.write_all(text.as_bytes()))
    }

    fn write_binary(&self, path: &Path) -> Result<()> {
        let n = self.list.len();
        let list = || self.list.iter();
        let position = list().flat_map(|probe| probe.position.as_vec3().to_array());
        let irradiance = list().flat_map(|probe| &probe.irradiance);
        let valid: Vec<u32> = list().map(|probe| probe.valid.into()).collect();
        let planes = self.walls.iter().flat_map(|of| of.planes.as_flattened());
        let tensors = [
            Tensor::floats("position", &[n, 3], position),
            Tensor::words("valid", &valid),
            Tensor::vectors("irradiance", &[n, COEFFICIENTS, 3], irradiance),
            Tensor::floats("walls", &[n, SIDE, SIDE, 4], planes.copied()),
        ];
        let mut metadata = vec![
            ("format", FORMAT.to_owned()),
            ("harmonics", HARMONICS.to_owned()),
            ("planes", PLANES.to_owned()),
        ];
        if let Some(grid) = self.grid {
            metadata.push(("counts", json!(grid.counts).to_string()));
            metadata.push(("low", json!(grid.low.to_array()).to_string()));
            metadata.push(("high", json!(grid.high.to_array()).to_string()));
        }
        let metadata = metadata
            .into_iter()
            .map(|(key, value)| (key.to_owned(), value));
        write_tensors(path, &tensors, metadata.collect())
    }
}
