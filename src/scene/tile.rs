//! The size of textures on a surface.

use glam::DVec2;

use super::Scene;

/// Size of one repeat along u and v, scene units: the means of |dP/du| and |dP/dv| over the area
/// with this material.
pub(super) fn tile_size(scene: &Scene, material: u32) -> Option<DVec2> {
    let (mut sum, mut area) = (DVec2::ZERO, 0.0);
    for triangle in scene.triangles.iter().filter(|t| t.material == material) {
        let [p, q, r] = scene.corners(triangle);
        let [a, b, c] = triangle.uv.map(|uv| DVec2::from(uv.map(f64::from)));
        let (pq, pr, ab, ac) = (q - p, r - p, b - a, c - a);
        let along_u = (pq * ac.y - pr * ab.y) / ab.perp_dot(ac);
        let along_v = (pr * ab.x - pq * ac.x) / ab.perp_dot(ac);
        let weight = pq.cross(pr).length();
        let size = DVec2::new(along_u.length(), along_v.length());
        // Coordinates on a line or in a point span no area.
        if size.is_finite() && size.min_element() > 0.0 {
            sum += size * weight;
            area += weight;
        }
    }
    (area > 0.0).then(|| sum / area)
}
