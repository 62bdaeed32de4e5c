//! Irradiance at the corners from irradiance of the elements, so that shading is smooth over a
//! smooth surface and breaks at its edges.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::mesh::corners::Corners;
use crate::scene::Scene;

/// Irradiance at each corner, `[triangle][corner]`, W·m⁻², RGB: the mean of [`Corners::smooth`].
pub fn corner_irradiance(scene: &Scene, irradiance: &[Vec3]) -> Vec<[Vec3; 3]> {
    let corners = Corners::new(scene);
    scene
        .triangles
        .par_iter()
        .enumerate()
        .map(|(e, triangle)| {
            triangle.vertices.map(|vertex| {
                let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
                for (other, angle) in corners.smooth(e, vertex) {
                    sum += irradiance[other].as_dvec3() * angle;
                    weight += angle;
                }
                if weight > 0.0 {
                    (sum / weight).as_vec3()
                } else {
                    irradiance[e]
                }
            })
        })
        .collect()
}
