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
