//! Texels of relief as shaders read them, scalar layout; `shaders/shared/types.glsl` has the same
//! fields in the same order.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Where an element with a relief lies in its texture.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct MesoTexel {
    pub uv_a: Vec2,
    pub uv_b: Vec2,
    pub uv_c: Vec2,
    /// Facet of the texture among those of all textures: two a cell, as in [`super::HeightField`].
    pub first: u32,
    pub columns: u32,
    pub rows: u32,
}

/// A facet of a texture, as the pixel estimator looks it up.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct TextureFacet {
    pub reflectance: Vec3,
    /// A bit for each of the first 32 directions less than 90° from its normal, and for each of the
    /// others.
    pub above_low: u32,
    pub above_high: u32,
}
