//! Light points, what casts shadows, and what light points light.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::constants::LEAF_TRIANGLES;

/// A place that light comes straight from: a part of an emitter, or a point light.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct LightPoint {
    /// From the eye, internal units.
    pub position: Vec3,
    pub kind: u32,
    pub normal: Vec3,
    /// Of the part of an emitter, internal units.
    pub area: f32,
    /// Le times its area, or radiant intensity, in internal units.
    pub strength: Vec3,
}

/// A box of the tree of what casts shadows, in depth-first order.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowNode {
    pub low: Vec3,
    /// The node that follows all that is in this one.
    pub skip: u32,
    pub high: Vec3,
    /// [`LEAF_TRIANGLES`] times its first triangle, plus how many a leaf has; others have none.
    pub leaf: u32,
}

impl ShadowNode {
    /// Of a leaf.
    pub fn triangles(&self) -> std::ops::Range<usize> {
        let first = self.leaf / LEAF_TRIANGLES;
        first as usize..(first + self.leaf % LEAF_TRIANGLES) as usize
    }
}

/// What casts a shadow.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowTriangle {
    pub a: Vec3,
    pub b: Vec3,
    pub c: Vec3,
    /// 1: it stands for a relief about it.
    pub relief: u32,
}

/// What hides places from a source, and where it does.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct ShadowOccluder {
    pub a: Vec3,
    /// The connected part that it is of.
    pub component: u32,
    pub b: Vec3,
    /// 1: that part is closed, with all normals outward.
    pub closed: u32,
    pub c: Vec3,
    /// normal · x on its plane.
    pub height: f32,
    pub normal: Vec3,
    pub unused: u32,
}

/// A straight way from `from` to `to`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ShadowRay {
    pub from: Vec3,
    /// Share of the way before which triangles with a relief are passed over.
    pub clear: f32,
    pub to: Vec3,
}

/// A plain triangle that is lit straight, from the eye, internal units.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct LitTriangle {
    pub a: Vec3,
    pub b: Vec3,
    pub c: Vec3,
    /// Of the smooth surface at the corners.
    pub normal_a: Vec3,
    pub normal_b: Vec3,
    pub normal_c: Vec3,
    /// Its own normal.
    pub plane: Vec3,
    /// What rays start above it.
    pub above: f32,
    /// 1: nothing stands between it and the lights.
    pub open: u32,
}
