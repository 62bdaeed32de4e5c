//! Elements with a relief, height maps, and relief as it is drawn.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use crate::meso::HeightPyramid;

/// An element with a relief.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct MesoElement {
    pub tangent: Vec3,
    pub response: u32,
    pub bitangent: Vec3,
    pub scale: Vec3,
}

/// Reflected radiosity of an element with a relief, with the rounding error of its last sum.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Reflected {
    pub sum: Vec3,
    pub error: Vec3,
}

/// One height map's part of the buffer of pyramids.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct HeightTile {
    pub first: u32,
    pub width: u32,
    pub height: u32,
    pub top: u32,
    pub highest: f32,
}

impl HeightTile {
    /// `first` counts the values before this pyramid's in the buffer.
    pub fn new(pyramid: &HeightPyramid, first: u32) -> Self {
        Self {
            first,
            width: pyramid.width,
            height: pyramid.height,
            top: pyramid.top(),
            highest: pyramid.highest(),
        }
    }
}

/// A straight segment over a height map: (u, v, height) at its ends.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct HeightRay {
    pub from: Vec3,
    pub tile: u32,
    pub to: Vec3,
}

/// Where a segment first passes below the surface.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct HeightHit {
    /// 0 at the segment's start, 1 at its end.
    pub t: f32,
    /// `row * width + column` of the texel at the low corner of the cell that holds the hit; `NONE`
    /// where there is none.
    pub cell: u32,
    /// Place in the cell, 0..=1 to the next column and to the next row.
    pub local: Vec2,
    /// Height of the surface there.
    pub height: f32,
    /// ∂h/∂u and ∂h/∂v of the cell's bilinear patch.
    pub gradient: Vec2,
    /// Steps of the march, hit or not.
    pub steps: u32,
}

/// A triangle with relief, extruded; see `shaders/shared/types.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Prism {
    pub low_a: Vec3,
    pub low_b: Vec3,
    pub low_c: Vec3,
    pub high_a: Vec3,
    pub high_b: Vec3,
    pub high_c: Vec3,
    pub uv_a: Vec2,
    pub uv_b: Vec2,
    pub uv_c: Vec2,
    pub light_a: u32,
    pub light_b: u32,
    pub light_c: u32,
    pub surface: u32,
    pub tangent: Vec3,
    pub texel: f32,
    pub bitangent: Vec3,
    pub normal: Vec3,
    pub first_cluster: u32,
    pub cluster_count: u32,
    pub slots: Vec3,
}

/// A parallel light on a face; see `shaders/shared/types.glsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ParallelLight {
    pub towards: Vec3,
    pub fluence_a: Vec3,
    pub fluence_b: Vec3,
    pub fluence_c: Vec3,
}

/// A relief as it is drawn.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReliefSurface {
    /// Of the prisms, in the map's heights.
    pub lowest: f32,
    pub top: f32,
    pub mean: f32,
    /// Of the height field that the factors belong to.
    pub columns: u32,
    pub rows: u32,
    pub rank: u32,
    pub first_factor: u32,
    /// Scene heights a texture repeat in u and in v for a unit of height.
    pub slope: Vec2,
}
