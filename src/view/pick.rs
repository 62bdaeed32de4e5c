//! The element that a ray hits first.

use glam::DVec3;

use crate::scene::Scene;

/// Index of the triangle that a ray from `eye` hits first, on either side.
pub fn first_hit(scene: &Scene, eye: DVec3, ray: DVec3) -> Option<u32> {
    let mut nearest: Option<(f64, u32)> = None;
    for (e, triangle) in (0..).zip(&scene.triangles) {
        let [a, b, c] = scene.corners(triangle);
        let (u, v, t) = (b - a, c - a, eye - a);
        let p = ray.cross(v);
        let determinant = u.dot(p);
        if determinant == 0.0 {
            continue;
        }
        let q = t.cross(u);
        let (x, y) = (t.dot(p) / determinant, ray.dot(q) / determinant);
        let along = v.dot(q) / determinant;
        let inside = x >= 0.0 && y >= 0.0 && x + y <= 1.0;
        if inside && along > 0.0 && nearest.is_none_or(|(before, _)| along < before) {
            nearest = Some((along, e));
        }
    }
    nearest.map(|(_, e)| e)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Triangle;

    #[test]
    fn the_nearer_of_two_is_hit() {
        let corner = |x, y, z| DVec3::new(x, y, z);
        let triangle = |first| Triangle {
            vertices: [first, first + 1, first + 2],
            uv: [[0.0; 2]; 3],
            emission_uv: None,
            light_uv: None,
            material: 0,
        };
        let scene = Scene {
            vertices: vec![
                corner(0.0, 0.0, 0.0),
                corner(1.0, 0.0, 0.0),
                corner(0.0, 1.0, 0.0),
                corner(0.0, 0.0, 1.0),
                corner(1.0, 0.0, 1.0),
                corner(0.0, 1.0, 1.0),
            ],
            triangles: vec![triangle(0), triangle(3)],
            ..Scene::default()
        };
        let from = |z| DVec3::new(0.2, 0.2, z);
        assert_eq!(first_hit(&scene, from(5.0), DVec3::NEG_Z), Some(1));
        assert_eq!(first_hit(&scene, from(-5.0), DVec3::Z), Some(0));
        assert_eq!(first_hit(&scene, from(5.0), DVec3::Z), None);
    }
}
