//! Texture coordinates: where maps lie on a surface, and those of surfaces without any.

use glam::DVec3;

/// From the texture coordinates of a mesh to those of its maps: scaled, then moved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct UvTransform {
    pub scale: [f32; 2],
    pub offset: [f32; 2],
}

impl Default for UvTransform {
    fn default() -> Self {
        Self {
            scale: [1.0; 2],
            offset: [0.0; 2],
        }
    }
}

impl UvTransform {
    pub fn apply(&self, uv: [f32; 2]) -> [f32; 2] {
        std::array::from_fn(|k| uv[k] * self.scale[k] + self.offset[k])
    }
}

/// Where the maps of a material lie on a surface.
#[derive(Debug, Clone, Default)]
pub(super) struct OnSurface {
    /// From the texture coordinates of the mesh to those of the maps.
    pub transform: UvTransform,
    /// What is wrong where the mesh has no texture coordinates, which `-s` and `-o` could change.
    pub moved: Option<String>,
    /// The statement of a map that `-clamp` keeps from repeating, and its line.
    pub clamped: Option<(String, usize)>,
}

/// Box projection: along the axis nearest to the normal, one repeat per scene unit, not mirrored
/// seen from the front.
///
/// Each triangle is shifted by whole repeats towards zero, so that f32 keeps its precision far from
/// the origin; a repeating texture looks the same.
pub(super) fn box_projection(corners: [DVec3; 3]) -> [[f32; 2]; 3] {
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let size = normal.abs();
    let project = |p: DVec3| {
        if size.x >= size.y && size.x >= size.z {
            [-normal.x.signum() * p.z, p.y]
        } else if size.y >= size.z {
            [p.x, -normal.y.signum() * p.z]
        } else {
            [normal.z.signum() * p.x, p.y]
        }
    };
    let uv = corners.map(project);
    let repeats: [f64; 2] = std::array::from_fn(|k| uv[0][k].min(uv[1][k]).min(uv[2][k]).floor());
    uv.map(|[u, v]| [(u - repeats[0]) as f32, (v - repeats[1]) as f32])
}
