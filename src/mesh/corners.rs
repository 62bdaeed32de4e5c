//! Corners of a mesh's triangles that share a vertex of a smooth surface, and their weights there.

use std::sync::OnceLock;

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
    /// `[triangle][corner]`
    vertices: Vec<[u32; 3]>,
    /// Of smooth surfaces, once it is asked for.
    smooth: OnceLock<Around>,
}

/// The corners at each corner's vertex that continue its triangle's surface.
struct Around {
    /// `[3 · triangle + corner]`, where they start; one more at the end.
    first: Vec<u32>,
    /// 3 · triangle + corner, ascending.
    corners: Vec<u32>,
}

impl Around {
    /// Of triangles whose normals have this cosine at least.
    fn new(of: &Corners, cosine: f64) -> Self {
        let found: Vec<[Vec<u32>; 3]> = (of.vertices.par_iter().enumerate())
            .map(|(e, vertices)| vertices.map(|v| of.within(e, v, cosine).collect()))
            .collect();
        let mut around = Self {
            first: vec![0],
            corners: Vec::new(),
        };
        for corners in found.iter().flatten() {
            around.corners.extend(corners);
            around.first.push(around.corners.len() as u32);
        }
        around
    }

    fn of(&self, corner: usize) -> &[u32] {
        let [from, to] = [corner, corner + 1].map(|c| self.first[c] as usize);
        &self.corners[from..to]
    }
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
            vertices: scene.triangles.iter().map(|t| t.vertices).collect(),
            smooth: OnceLock::new(),
        }
    }

    /// Smooth surfaces; found when they are first asked for.
    pub fn smooth(&self) -> Smooth<'_> {
        // Nothing is locked meanwhile: a thread that waits for others takes up work that may ask
        // for them, too.
        let around = self.smooth.get().unwrap_or_else(|| {
            let found = Around::new(self, CREASE_COS);
            self.smooth.get_or_init(|| found)
        });
        Smooth {
            corners: self,
            around,
        }
    }

    /// The corners at a vertex of triangle `e` of triangles whose normals have this cosine at least
    /// with its own.
    fn within(&self, e: usize, vertex: u32, cosine: f64) -> impl Iterator<Item = u32> {
        let [from, to] = [vertex, vertex + 1].map(|v| self.first[v as usize] as usize);
        let crowded = to - from > MOST_AROUND;
        let corners = self.corners[from..to].iter().copied();
        corners.filter(move |&corner| {
            let other = corner as usize / 3;
            let even = || self.normals[e].dot(self.normals[other]) >= cosine;
            other == e || (!crowded && even())
        })
    }
}

/// Smooth surfaces, to 35°, about the corners.
#[derive(Clone, Copy)]
pub struct Smooth<'a> {
    corners: &'a Corners,
    around: &'a Around,
}

impl<'a> Smooth<'a> {
    /// The triangles about a corner of triangle `e` that continue its surface there, itself among
    /// them, each with its angle at the vertex: with these weights the diagonals of a fan do not
    /// matter.
    pub fn about(self, e: usize, corner: usize) -> impl Iterator<Item = (usize, f64)> + use<'a> {
        let around = self.around.of(3 * e + corner).iter();
        let around = around.map(|&c| (c as usize / 3, c as usize % 3));
        around.map(move |(other, k)| (other, self.corners.angles[other][k]))
    }

    /// At the corners of triangle `e`, unit.
    pub fn normals(self, e: usize) -> [DVec3; 3] {
        let normals = &self.corners.normals;
        [0, 1, 2].map(|corner| {
            let about = self.about(e, corner);
            let sum: DVec3 = about.map(|(t, angle)| normals[t] * angle).sum();
            sum.try_normalize().unwrap_or(normals[e])
        })
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
    pub fn means<const N: usize>(&self, values: &[[Vec3; N]]) -> Vec<[[Vec3; N]; 3]> {
        let smooth = self.smooth();
        let mean = |e: usize, corner: usize| {
            let (mut sum, mut weight) = ([DVec3::ZERO; N], 0.0);
            for (other, angle) in smooth.about(e, corner) {
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
        (0..values.len())
            .into_par_iter()
            .map(|e| [0, 1, 2].map(|corner| mean(e, corner)))
            .collect()
    }

    /// Irradiance at each corner, `[triangle][corner]`, W·m⁻², RGB. Linear between the corners and
    /// continuous where triangles are joined, it has nearly the means of the triangles: the mean of
    /// the triangles about a corner, and of what that mean leaves of theirs (one step of
    /// Landweber's iteration), no brighter or darker than they are.
    pub fn irradiance(&self, irradiance: &[Vec3], joined: Joined) -> Vec<[Vec3; 3]> {
        let of_planes;
        let around = match joined {
            Joined::Smooth => self.smooth().around,
            Joined::Plane => {
                of_planes = Around::new(self, PLANE_COS);
                &of_planes
            }
        };
        let brightness: Vec<f32> = irradiance.iter().map(|e| e.max_element()).collect();
        // What is covered is no part of the surface beside it.
        let alike = |e: usize, corner: usize| {
            let all = around.of(3 * e + corner);
            let brightest = all.iter().map(|&c| brightness[c as usize / 3]);
            let brightest = brightest.fold(0.0, f32::max);
            let brightness = &brightness;
            let alike = move |other: usize| match joined {
                Joined::Smooth => brightness[other] >= LEAST_OPEN * brightest,
                Joined::Plane => {
                    let (one, other) = (brightness[e], brightness[other]);
                    one.min(other) >= LEAST_ALIKE * one.max(other)
                }
            };
            let found = all.iter().map(|&c| (c as usize / 3, c as usize % 3));
            found.filter(move |&(other, _)| alike(other))
        };
        let mean = |sum: DVec3, weight: f64, own: Vec3| match weight > 0.0 {
            true => (sum / weight).as_vec3(),
            false => own,
        };
        let triangles = || (0..irradiance.len()).into_par_iter();
        let left: Vec<Vec3> = triangles()
            .map(|e| {
                let [a, b, c] = [0, 1, 2].map(|corner| {
                    let (mut sum, mut weight) = (DVec3::ZERO, 0.0);
                    for (other, k) in alike(e, corner) {
                        let angle = self.angles[other][k];
                        sum += irradiance[other].as_dvec3() * angle;
                        weight += angle;
                    }
                    mean(sum, weight, irradiance[e])
                });
                irradiance[e] - (a + b + c) / 3.0
            })
            .collect();
        let find = |e: usize, corner: usize| {
            let [mut sum, mut sum_left] = [DVec3::ZERO; 2];
            let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
            let mut weight = 0.0;
            for (other, k) in alike(e, corner) {
                let angle = self.angles[other][k];
                sum += irradiance[other].as_dvec3() * angle;
                sum_left += left[other].as_dvec3() * angle;
                weight += angle;
                (low, high) = (low.min(irradiance[other]), high.max(irradiance[other]));
            }
            let found = mean(sum, weight, irradiance[e]) + mean(sum_left, weight, left[e]);
            found.clamp(low, high)
        };
        let each = triangles().map(|e| [0, 1, 2].map(|corner| find(e, corner)));
        each.collect()
    }
}

/// [`Corners::irradiance`] of a scene's own corners.
pub fn corner_irradiance(scene: &Scene, irradiance: &[Vec3], joined: Joined) -> Vec<[Vec3; 3]> {
    Corners::new(scene).irradiance(irradiance, joined)
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::{RecvTimeoutError, channel};
    use std::time::Duration;

    use super::*;
    use crate::scene::Triangle;

    /// A strip of `n` triangles that bends by 10° at each edge.
    fn strip(n: u32) -> Scene {
        let vertex = |i: u32| {
            let turn = 10_f64.to_radians() * f64::from(i / 2);
            DVec3::new(turn.cos(), turn.sin(), f64::from(i % 2))
        };
        let triangle = |i: u32| Triangle {
            vertices: match i % 2 {
                0 => [i, i + 2, i + 1],
                _ => [i, i + 1, i + 2],
            },
            ..Triangle::default()
        };
        Scene {
            vertices: (0..n + 2).map(vertex).collect(),
            triangles: (0..n).map(triangle).collect(),
            ..Scene::default()
        }
    }

    /// Threads of a pool that wait for smooth surfaces take up work that asks for them, too.
    #[test]
    fn many_threads_ask_at_once() {
        let (done, all_done) = channel();
        std::thread::spawn(move || {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(32)
                .build()
                .unwrap();
            let scene = strip(50_000);
            let alone = Corners::new(&scene);
            for _ in 0..60 {
                let corners = Corners::new(&scene);
                // Threads with work of another kind come back for parts of what others do.
                let ask = |e: usize| match e % 2 {
                    0 => assert_eq!(corners.smooth().normals(e), alone.smooth().normals(e)),
                    _ => std::thread::sleep(Duration::from_micros(20 * (e as u64 % 7))),
                };
                let each = (0..64).into_par_iter().with_max_len(1);
                pool.install(|| each.for_each(ask));
            }
            done.send(()).unwrap();
        });
        match all_done.recv_timeout(Duration::from_secs(120)) {
            Ok(()) => {}
            Err(RecvTimeoutError::Timeout) => panic!("threads wait for one another"),
            Err(RecvTimeoutError::Disconnected) => panic!("the results differ"),
        }
    }
}
