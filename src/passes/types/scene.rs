//! A scene without relief.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use crate::constants::KIND_SURFACE;
use crate::mesh::meshlets;
use crate::mesh::sources;

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Source {
    pub eye: Vec3,
    pub area: f32,
    pub normal: Vec3,
    pub radius: f32,
    pub tangent: Vec3,
    pub cone_sin: f32,
    pub bitangent: Vec3,
    pub cone_cos: f32,
    pub emitted: Vec3,
    pub kind: u32,
    pub first_element: u32,
    pub element_count: u32,
    pub first_contour: u32,
    pub contour_count: u32,
    pub component: u32,
    /// Centroid of the area.
    pub middle: Vec3,
    /// Area that a far place in the direction of `normal` sees.
    pub facing: f32,
    /// Of the largest part's ball; parts are counted in the buffer of all.
    pub part_radius: f32,
    pub first_part: u32,
    pub part_count: u32,
}

impl Source {
    /// `first_contour` and `contour_count` count the corners of [`contour_corners`].
    pub fn new(
        source: &sources::Source,
        (first_contour, contour_count): (u32, u32),
        first_part: u32,
    ) -> Self {
        let part_radius = source.parts.iter().map(|p| p.radius).fold(0.0, f64::max);
        Self {
            eye: source.eye.as_vec3(),
            area: source.area as f32,
            normal: source.normal.as_vec3(),
            // A little more than it is, for the rounding to f32.
            radius: (source.radius * (1.0 + 1e-6)) as f32,
            tangent: source.tangent.as_vec3(),
            cone_sin: source.cone.sin() as f32,
            bitangent: source.bitangent.as_vec3(),
            cone_cos: source.cone.cos() as f32,
            emitted: source.emitted,
            kind: source.kind,
            first_element: source.first_element,
            element_count: source.element_count,
            first_contour,
            contour_count,
            component: source.component,
            middle: source.centroid.as_vec3(),
            facing: source.facing as f32,
            part_radius: (part_radius * (1.0 + 1e-6)) as f32,
            first_part,
            part_count: source.parts.len() as u32,
        }
    }
}

/// A source's outline as the shader walks it: each loop's corners and its first once more; w is 1
/// where a loop starts.
pub fn contour_corners(source: &sources::Source) -> Vec<[f32; 4]> {
    let mut corners = Vec::new();
    if source.kind != KIND_SURFACE {
        return corners;
    }
    for closed in &source.contour {
        for (i, corner) in closed.iter().chain(closed.first()).enumerate() {
            let c = corner.as_vec3();
            corners.push([c.x, c.y, c.z, if i == 0 { 1.0 } else { 0.0 }]);
        }
    }
    corners
}

/// An element as it is gathered from, for loading by fours.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Triangle {
    pub a: Vec3,
    pub area: f32,
    pub b: Vec3,
    /// normal · x on its plane.
    pub height: f32,
    pub c: Vec3,
    pub unused_c: f32,
    pub normal: Vec3,
    pub unused: f32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Meshlet {
    pub centre: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    pub cutoff: f32,
    pub first: u32,
    pub count: u32,
    pub component: u32,
}

impl From<&meshlets::Meshlet> for Meshlet {
    fn from(m: &meshlets::Meshlet) -> Self {
        Self {
            centre: m.centre.as_vec3(),
            radius: m.radius as f32,
            axis: m.axis.as_vec3(),
            cutoff: m.cutoff as f32,
            first: m.first,
            count: m.count,
            component: m.component,
        }
    }
}

/// Consecutive elements as receivers: bounds of their centroids and normals.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ReceiverBlock {
    pub centre: Vec3,
    pub radius: f32,
    pub axis: Vec3,
    /// Of the cylinder about the axis.
    pub half_height: f32,
    pub cone_sin: f32,
    pub cone_cos: f32,
    /// Radius of an element.
    pub largest: f32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Component {
    pub low: Vec3,
    pub closed: u32,
    pub high: Vec3,
}
