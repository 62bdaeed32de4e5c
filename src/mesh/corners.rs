//! Corners of a mesh's triangles that share a vertex of a smooth surface, and their weights there.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::scene::Scene;

/// Cosine of 35°, the greatest angle between normals that counts as one smooth surface.
const CREASE_COS: f64 = 0.819_152_044_288_992;

/// Cosine of 2°, the greatest angle between normals that counts as one plane.
pub const PLANE_COS: f64 = 0.999_390_827_019_096;

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
        self.within(e, vertex, CREASE_COS)
    }

    /// The same of triangles whose normals have this cosine at least with that of `e`.
    fn within(&self, e: usize, vertex: u32, cosine: f64) -> impl Iterator<Item = (usize, f64)> {
        let [from, to] = [vertex, vertex + 1].map(|v| self.first[v as usize] as usize);
        let crowded = to - from > MOST_AROUND;
        self.corners[from..to]
            .iter()
            .map(|&corner| (corner as usize / 3, corner as usize % 3))
            .filter(move |&(other, _)| {
                let even = || self.normals[e].dot(self.normals[other]) >= cosine;
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

/// Of two elements of one plane, the least light of one over the other's with which it is one
/// light: beneath what stands on it a floor is dark up to an edge.
const LEAST_ALIKE: f32 = 0.25;

/// Of the elements about a vertex, the least light of one over the brightest's with which it counts
/// in pictures: what is covered is not seen, and would darken what it is joined to.
const LEAST_OPEN: f32 = 0.02;

/// What elements about a vertex have light in common there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Joined {
    /// Those of one smooth surface, to 35°, as pictures show it.
    Smooth,
    /// Those of one plane, to 2°: the facets of a curved surface turn to other light, each its own.
    Plane,
}

impl Corners {
    /// Means at each corner of what triangles of its smooth surface have, `[triangle][corner]`, by
    /// their angles there.
    pub fn means<const N: usize>(
        &self,
        scene: &Scene,
        values: &[[Vec3; N]],
    ) -> Vec<[[Vec3; N]; 3]> {
        let triangles = scene.triangles.par_iter().enumerate();
        let mean = |e: usize, vertex: u32| {
            let (mut sum, mut weight) = ([DVec3::ZERO; N], 0.0);
            for (other, angle) in self.smooth(e, vertex) {
                for (sum, value) in sum.iter_mut().zip(values[other]) {
                    *sum += value.as_dvec3() * angle;
                }
                weight += angle;
            }
            match weight > 0.0 {
                true => sum.map(|sum| (sum / weight).as_vec3()),
                false => values[e],
            }
        };
        triangles
            .map(|(e, triangle)| triangle.vertices.map(|v| mean(e, v)))
            .collect()
    }

    /// Irradiance at each corner, `[triangle][corner]`, W·m⁻², RGB. Linear between the corners and
    /// continuous where triangles are joined, it has nearly the means of the triangles: the mean of
    /// the triangles about a corner, and of what that mean leaves of theirs (one step of
    /// Landweber's iteration), no brighter or darker than they are.
    pub fn irradiance(&self, scene: &Scene, irradiance: &[Vec3], joined: Joined) -> Vec<[Vec3; 3]> {
        let cosine = match joined {
            Joined::Smooth => CREASE_COS,
            Joined::Plane => PLANE_COS,
        };
        let each = |find: &(dyn Fn(usize, u32) -> Vec3 + Sync)| -> Vec<[Vec3; 3]> {
            let triangles = scene.triangles.par_iter().enumerate();
            triangles
                .map(|(e, triangle)| triangle.vertices.map(|v| find(e, v)))
                .collect()
        };
        let brightness = |e: usize| irradiance[e].max_element();
        // What is covered is no part of the surface beside it.
        let about = |e: usize, vertex: u32| {
            let all = || self.within(e, vertex, cosine);
            let brightest = all()
                .map(|(other, _)| brightness(other))
                .fold(0.0, f32::max);
            let alike = move |&(other, _): &(usize, f64)| match joined {
                Joined::Smooth => brightness(other) >= LEAST_OPEN * brightest,
                Joined::Plane => {
                    let (one, other) = (brightness(e), brightness(other));
                    one.min(other) >= LEAST_ALIKE * one.max(other)
                }
            };
            all().filter(alike)
        };
        let mean = |values: &[Vec3], e: usize, vertex: u32| -> Vec3 {
            let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
            for (other, angle) in about(e, vertex) {
                sum += values[other].as_dvec3() * angle;
                weight += angle;
            }
            match weight > 0.0 {
                true => (sum / weight).as_vec3(),
                false => values[e],
            }
        };
        let means = each(&|e, vertex| mean(irradiance, e, vertex));
        let left: Vec<Vec3> = (irradiance.iter().zip(&means))
            .map(|(whole, [a, b, c])| whole - (a + b + c) / 3.0)
            .collect();
        each(&|e, vertex| {
            let values = || about(e, vertex).map(|(other, _)| irradiance[other]);
            let low = values().fold(Vec3::INFINITY, Vec3::min);
            let high = values().fold(Vec3::NEG_INFINITY, Vec3::max);
            let found = mean(irradiance, e, vertex) + mean(&left, e, vertex);
            found.clamp(low, high)
        })
    }
}

/// [`Corners::irradiance`] of a scene's own corners.
pub fn corner_irradiance(scene: &Scene, irradiance: &[Vec3], joined: Joined) -> Vec<[Vec3; 3]> {
    Corners::new(scene).irradiance(scene, irradiance, joined)
}
