//! Texture coordinates for surfaces without any.

use glam::DVec3;

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
