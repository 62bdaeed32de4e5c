//! Maps of the fine relief: heights and normals.

use std::path::PathBuf;

/// Heights over a surface; bilinear between the centres of the texels, and repeats outside 0..1.
///
/// White is high. The surface of the mesh lies at the map's mean height.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The file it came from; of a map made by code, the name that it is given when it is written.
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row. In 0..=1 for integer images (the code as it is, no gamma), as stored for OpenEXR.
    pub values: Vec<f32>,
}

impl HeightMap {
    /// Whether every value is the same: no relief at all.
    pub fn is_constant(&self) -> bool {
        self.values.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Mean of the values.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&v| f64::from(v)).sum::<f64>() / self.values.len() as f64
    }
}

/// Normals of the relief in the tangent frame; repeats outside 0..1.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMap {
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row. Unit vectors: x along growing u, y along growing v (up in the image), z outward.
    pub normals: Vec<[f32; 3]>,
}
