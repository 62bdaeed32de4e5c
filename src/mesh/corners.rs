//! Corners of a mesh's triangles that share a vertex of a smooth surface, and their weights there.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::scene::Scene;

/// Cosine of 35°, the greatest angle between normals that counts as one smooth surface.
const CREASE_COS: f64 = 0.819_152_044_288_992;

/// Most elements about a vertex that are compared with one another, so that a fan of 100,000
/// triangles does not cost 10¹⁰ steps. About a vertex with more, no elements are joined.
const MOST_AROUND: usize = 512;

/// The corners about each vertex, ascending, so that sums over them have a fixed order.
pub struct Corners {
    /// `[triangle]`, unit.
    pub normals: Vec<DVec3>,
    /// `[triangle][corner]`, radians.
    angles: Vec<[f64; 3]>,
    /// `[vertex]`, where its corners start; one more at the end.
    first: Vec<u32>,
    /// 3 · triangle + corner.
    corners: Vec<u32>,
}

impl Corners {
    pub fn new(scene: &Scene) -> Self {
        let (normals, angles) = scene
            .triangles
            .par_iter()
            .map(|t| {
                let [a, b, c] = scene.corners(t);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                (normal, [angle(a, b, c), angle(b, c, a), angle(c, a, b)])
            })
            .unzip();
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
        Self {
            normals,
            angles,
            first,
            corners,
        }
    }

    /// The triangles about a vertex of triangle `e` that continue its surface there, itself among
    /// them, each with its angle at the vertex: with these weights the diagonals of a fan do not
    /// matter.
    pub fn smooth(&self, e: usize, vertex: u32) -> impl Iterator<Item = (usize, f64)> {
        let [from, to] = [vertex, vertex + 1].map(|v| self.first[v as usize] as usize);
        let crowded = to - from > MOST_AROUND;
        self.corners[from..to]
            .iter()
            .map(|&corner| (corner as usize / 3, corner as usize % 3))
            .filter(move |&(other, _)| {
                let even = || self.normals[e].dot(self.normals[other]) >= CREASE_COS;
                other == e || (!crowded && even())
            })
            .map(|(other, k)| (other, self.angles[other][k]))
    }
}

/// The angle at `a`, radians.
fn angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (u, v) = (b - a, c - a);
    u.cross(v).length().atan2(u.dot(v))
}

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
