//! How the structs that shaders read are made.

use bytemuck::Zeroable;
use glam::Vec3;

use crate::constants::{KIND_SURFACE, NONE};
use crate::mesh::{meshlets, sources};
use crate::meso::{HeightPyramid, Horizons};
pub use crate::structs::*;

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

impl Source {
    /// A beam, whose shares stand from `first` on in so many columns and rows.
    pub fn beam(source: &sources::Source, (first, columns): (u32, u32), rows: u32) -> Self {
        Self {
            part_count: rows,
            ..Self::new(source, (first, columns), 0)
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

impl Slot {
    /// Without a source.
    pub const EMPTY: Self = Self::of(NONE);

    /// Of a source that is to be drawn, and sends nothing yet.
    pub const fn of(source: u32) -> Self {
        Self {
            emitted: Vec3::ZERO,
            source,
            reflected: Vec3::ZERO,
            scale: 1.0,
        }
    }
}

impl HeightTile {
    /// `first` counts the values before this pyramid's in their buffer, and `first_horizon` the
    /// blocks.
    pub fn new(
        (pyramid, first): (&HeightPyramid, u32),
        (horizons, first_horizon): (&Horizons, u32),
    ) -> Self {
        Self {
            first,
            width: pyramid.width,
            height: pyramid.height,
            top: pyramid.top(),
            highest: pyramid.highest,
            first_horizon,
            horizon_columns: horizons.columns,
            horizon_rows: horizons.rows,
            horizon_step: horizons.step,
            ..Self::zeroed()
        }
    }
}
