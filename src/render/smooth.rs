//! From one irradiance an element to one a corner, so that shading runs smoothly over an even surface and breaks at its
//! edges.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::scene::Scene;

/// Cosine of 35°, the greatest angle between normals that counts as one smooth surface.
const CREASE_COS: f64 = 0.819_152_044_288_992;

/// Most elements about a vertex that are compared with one another, so that a fan of 100,000 triangles does not cost 10¹⁰
/// steps. About a vertex of more, every element keeps its own value.
const MOST_AROUND: usize = 512;

/// Irradiance at each corner, `[triangle][corner]`, W·m⁻², RGB.
///
/// That of corner k of element e is the mean over the elements about the same vertex whose normals lie within the crease
/// angle of e's, weighted by their angles there: a fan's diagonals then do not matter.
pub fn corner_irradiance(scene: &Scene, irradiance: &[Vec3]) -> Vec<[Vec3; 3]> {
    let around = Around::new(scene);
    let shapes: Vec<_> = scene
        .triangles
        .par_iter()
        .map(|t| {
            let [a, b, c] = scene.corners(t);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            (normal, [angle(a, b, c), angle(b, c, a), angle(c, a, b)])
        })
        .collect();
    scene
        .triangles
        .par_iter()
        .enumerate()
        .map(|(e, triangle)| {
            triangle.vertices.map(|vertex| {
                let corners = around.corners(vertex);
                if corners.len() > MOST_AROUND {
                    return irradiance[e];
                }
                let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
                for &corner in corners {
                    let (other, k) = (corner as usize / 3, corner as usize % 3);
                    if other == e || shapes[e].0.dot(shapes[other].0) >= CREASE_COS {
                        let angle = shapes[other].1[k];
                        sum += irradiance[other].as_dvec3() * angle;
                        weight += angle;
                    }
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

/// The angle at `a`, radians.
fn angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    u.cross(v).length().atan2(u.dot(v))
}

/// The corners about each vertex, ascending: a sum over them has one order.
struct Around {
    /// `[vertex]`, where its corners start; one more at the end.
    first: Vec<u32>,
    /// 3 · triangle + corner.
    corners: Vec<u32>,
}

impl Around {
    fn new(scene: &Scene) -> Self {
        let mut first = vec![0; scene.vertices.len() + 1];
        let all = || scene.triangles.iter().flat_map(|t| t.vertices);
        for vertex in all() {
            first[vertex as usize + 1] += 1;
        }
        for v in 1..first.len() {
            first[v] += first[v - 1];
        }
        let mut next = first.clone();
        let mut corners = vec![0; 3 * scene.triangles.len()];
        for (corner, vertex) in all().enumerate() {
            let place = &mut next[vertex as usize];
            corners[*place as usize] = corner as u32;
            *place += 1;
        }
        Self { first, corners }
    }

    fn corners(&self, vertex: u32) -> &[u32] {
        let [from, to] = [vertex, vertex + 1].map(|v| self.first[v as usize] as usize);
        &self.corners[from..to]
    }
}
