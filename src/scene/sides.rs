//! Which sides of surfaces light falls on.
//!
//! Only the front of a triangle sends and receives light, and modellers do not show which side that
//! is. Random paths from the lights, off either side of what they meet, find the pieces that show
//! light only their backs: a room whose normals point outward is one.

mod starts;

use std::collections::{HashMap, HashSet};
use std::time::Duration;

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::CwBvh;
use obvhs::cwbvh::builder::build_cwbvh;
use obvhs::ray::{Ray, RayHit};
use obvhs::{Boundable, BvhBuildParams};
use serde::{Deserialize, Serialize};

use super::{Scene, Triangle};
use crate::math::random;
use starts::Starts;

/// Which side of a mesh is the front.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize)]
pub(super) enum Sides {
    /// That of the file.
    #[serde(rename = "as given")]
    AsGiven,
    /// That which faces away from the middle of each of its pieces.
    #[serde(rename = "outward")]
    Outward,
    #[serde(rename = "inward")]
    Inward,
    /// Both: each triangle is there twice, back to back.
    #[serde(rename = "both")]
    Both,
}

/// What is left to be found of the sides of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    None,
    /// Which is the front.
    One,
    /// Its file has two: whether light falls on both.
    Two,
}

/// Paths from the lights, and surfaces that each meets at most.
const PATHS: usize = 8192;
const BOUNCES: usize = 6;

/// Meetings with the back of a piece, at least, that show which side is lit.
const ENOUGH: u32 = 8;

/// Turns the pieces of the triangles from `first` on so that they face outward, or inward.
pub(super) fn face(scene: &mut Scene, first: usize, outward: bool) {
    let pieces = pieces(&scene.triangles[first..]);
    let count = pieces.iter().max().map_or(0, |&last| last as usize + 1);
    let own = || scene.triangles[first..].iter().zip(&pieces);
    // Area and its first moment of each piece.
    let mut sums = vec![(0.0, DVec3::ZERO); count];
    for (triangle, &piece) in own() {
        let [a, b, c] = scene.corners(triangle);
        let area = (b - a).cross(c - a).length();
        let sum = &mut sums[piece as usize];
        *sum = (sum.0 + area, sum.1 + area * (a + b + c) / 3.0);
    }
    let mut flow = vec![0.0; count];
    for (triangle, &piece) in own() {
        let [a, b, c] = scene.corners(triangle);
        let (area, moment) = sums[piece as usize];
        let away = (a + b + c) / 3.0 - moment / area;
        flow[piece as usize] += (b - a).cross(c - a).dot(away);
    }
    for (triangle, &piece) in scene.triangles[first..].iter_mut().zip(&pieces) {
        if (flow[piece as usize] < 0.0) == outward {
            *triangle = turned(triangle);
        }
    }
}

/// The triangles of two sides whose pieces are open, without those that emit: a lamp is a front.
pub(super) fn of_sheets(scene: &Scene, choices: &[Choice]) -> Vec<usize> {
    if !choices.contains(&Choice::Two) {
        return Vec::new();
    }
    let pieces = pieces(&scene.triangles);
    // How often each edge of a piece is run along, to and fro.
    let mut edges: HashMap<([u32; 2], u32), [u32; 2]> = HashMap::new();
    for (triangle, &piece) in scene.triangles.iter().zip(&pieces) {
        let [a, b, c] = triangle.vertices;
        for [p, q] in [[a, b], [b, c], [c, a]] {
            let of = edges.entry(([p.min(q), p.max(q)], piece)).or_default();
            of[usize::from(p < q)] += 1;
        }
    }
    let ends = edges.iter().filter(|(_, of)| of[0] != of[1]);
    let open: HashSet<u32> = ends.map(|((_, piece), _)| *piece).collect();
    (0..choices.len())
        .filter(|&t| choices[t] == Choice::Two && open.contains(&pieces[t]))
        .filter(|&t| !scene.materials[scene.triangles[t].material as usize].emits())
        .collect()
}

/// Turns pieces that show light only their backs, where there is a choice, with a note. Gives the
/// triangles of two sides whose pieces show light both, without those that emit: a lamp is a front.
pub(super) fn turn_dark(scene: &mut Scene, choices: &[Choice]) -> Vec<usize> {
    let is_given = choices.iter().all(|&choice| choice == Choice::None);
    let Some(starts) = Starts::of(scene).filter(|_| !is_given) else {
        return Vec::new();
    };
    let pieces = pieces(&scene.triangles);
    let count = pieces.iter().max().map_or(0, |&last| last as usize + 1);
    // Meetings of each piece, [front, back].
    let mut met = vec![[0_u32; 2]; count];
    let rays = Rays::new(scene);
    let mut state = 0;
    for _ in 0..PATHS {
        let (mut from, mut direction) = starts.ray(&rays, &mut state);
        for _ in 0..BOUNCES {
            let Some((t, place, normal)) = rays.first_met(from, direction) else {
                break;
            };
            let is_back = direction.dot(normal) > 0.0;
            met[pieces[t] as usize][usize::from(is_back)] += 1;
            let side = if is_back { -normal } else { normal };
            direction = diffuse(side, &mut state);
            from = place + ABOVE * side;
        }
    }
    let emits = |t: &Triangle| scene.materials[t.material as usize].emits();
    let mut keeps = vec![false; count];
    for ((t, &piece), &choice) in scene.triangles.iter().zip(&pieces).zip(choices) {
        keeps[piece as usize] |= emits(t) || choice == Choice::None;
    }
    let shows_both = |t: &usize| {
        let [front, back] = met[pieces[*t] as usize];
        choices[*t] == Choice::Two && front > 0 && back > 0 && !emits(&scene.triangles[*t])
    };
    let backs: Vec<usize> = (0..choices.len()).filter(shows_both).collect();
    let is_dark = |piece: u32| {
        let [front, back] = met[piece as usize];
        front == 0 && back >= ENOUGH && !keeps[piece as usize]
    };
    let mut materials: Vec<u32> = Vec::new();
    let mut count = 0;
    for (triangle, &piece) in scene.triangles.iter_mut().zip(&pieces) {
        if is_dark(piece) {
            *triangle = turned(triangle);
            count += 1;
            if !materials.contains(&triangle.material) {
                materials.push(triangle.material);
            }
        }
    }
    if count > 0 {
        let name = |&m: &u32| format!("\"{}\"", scene.materials[m as usize].name);
        let names: Vec<String> = materials.iter().map(name).collect();
        scene.notes.push(format!(
            "{count} triangles of {} showed light only their backs, and were turned; \
             --sides-as-given leaves them",
            names.join(", ")
        ));
    }
    backs
}

pub(super) fn turned(triangle: &Triangle) -> Triangle {
    let (mut vertices, mut uv) = (triangle.vertices, triangle.uv);
    vertices.swap(1, 2);
    uv.swap(1, 2);
    Triangle {
        vertices,
        uv,
        ..*triangle
    }
}

/// A number for each triangle, the same for those that are joined by edges along which their fronts
/// are on one side.
fn pieces(triangles: &[Triangle]) -> Vec<u32> {
    // Ends of each edge, the triangle, and whether it runs from the first end to the other.
    let mut edges: Vec<([u32; 2], u32, bool)> = Vec::with_capacity(3 * triangles.len());
    for (t, triangle) in (0..).zip(triangles) {
        let [a, b, c] = triangle.vertices;
        for [p, q] in [[a, b], [b, c], [c, a]] {
            edges.push(([p.min(q), p.max(q)], t, p < q));
        }
    }
    edges.sort_unstable();
    let mut parent: Vec<u32> = (0..triangles.len() as u32).collect();
    fn root(parent: &mut [u32], mut t: u32) -> u32 {
        while parent[t as usize] != t {
            parent[t as usize] = parent[parent[t as usize] as usize];
            t = parent[t as usize];
        }
        t
    }
    for of in edges.chunk_by(|a, b| a.0 == b.0) {
        if let [(_, t, along), (_, o, other)] = *of
            && along != other
        {
            let (t, o) = (root(&mut parent, t), root(&mut parent, o));
            parent[t.max(o) as usize] = t.min(o);
        }
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    (0..triangles.len() as u32)
        .map(|t| {
            let next = numbers.len() as u32;
            *numbers.entry(root(&mut parent, t)).or_insert(next)
        })
        .collect()
}

/// A direction of the unit sphere.
fn uniform(state: &mut u64) -> DVec3 {
    let z = 2.0 * random::unit(state) - 1.0;
    let angle = std::f64::consts::TAU * random::unit(state);
    let around = (1.0 - z * z).max(0.0).sqrt();
    DVec3::new(around * angle.cos(), around * angle.sin(), z)
}

/// A direction above a plane by the cosine.
fn diffuse(normal: DVec3, state: &mut u64) -> DVec3 {
    (normal + uniform(state)).normalize_or(normal)
}

/// Half the scene in the frame of [`Rays`]. obvhs skips a box that a ray leaves within its own 10⁻⁴:
/// at this scale every box reaches further beyond its triangle.
const SCALE: f64 = 1024.0;

/// Height of a path's start above a surface.
const ABOVE: f64 = 1e-6 * SCALE;

/// Boxes reach so far beyond what they hold, which is more than the rounding of f32.
const MARGIN: f32 = 1.0 / 128.0;

/// The middle of a scene, and the unit of [`Rays`] in scene units.
fn frame(scene: &Scene) -> (DVec3, f64) {
    let (origin, unit) = scene.local_frame();
    (origin, unit / SCALE)
}

/// The triangles of a scene about its middle, coordinates in −[`SCALE`]..[`SCALE`].
struct Rays {
    corners: Vec<[DVec3; 3]>,
    bvh: CwBvh,
}

struct Bounds<'a>(&'a [DVec3; 3]);

impl Boundable for Bounds<'_> {
    fn aabb(&self) -> Aabb {
        let mut bounds = Aabb::from_points(&self.0.map(|v| v.as_vec3a()));
        bounds.min -= MARGIN;
        bounds.max += MARGIN;
        bounds
    }
}

impl Rays {
    fn new(scene: &Scene) -> Self {
        let (origin, unit) = frame(scene);
        let corners: Vec<[DVec3; 3]> = (scene.triangles.iter())
            .map(|t| scene.corners(t).map(|p| (p - origin) / unit))
            .collect();
        let bounds: Vec<Bounds> = corners.iter().map(Bounds).collect();
        let bvh = build_cwbvh(
            &bounds,
            BvhBuildParams::fastest_build(),
            &mut Duration::default(),
        );
        Self { corners, bvh }
    }

    /// A point light far outside the scene is moved closer, to where f32 is still precise enough.
    fn inside(&self, place: DVec3) -> DVec3 {
        place.clamp(DVec3::splat(-100.0 * SCALE), DVec3::splat(100.0 * SCALE))
    }

    /// The triangle that a ray meets first, the place, and the triangle's normal.
    fn first_met(&self, from: DVec3, direction: DVec3) -> Option<(usize, DVec3, DVec3)> {
        let ray = Ray::new_inf(from.as_vec3a(), direction.as_vec3a());
        let mut nearest = f64::INFINITY;
        let mut found = None;
        self.bvh.ray_traverse(ray, &mut RayHit::none(), |_, place| {
            let t = self.bvh.primitive_indices[place] as usize;
            let Some(distance) = crossing(self.corners[t], from, direction) else {
                return f32::INFINITY;
            };
            if distance < nearest {
                (nearest, found) = (distance, Some(t));
            }
            distance as f32
        });
        let t = found?;
        let [a, b, c] = self.corners[t];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        Some((t, from + nearest * direction, normal))
    }
}

/// How far along a ray it goes through a triangle (Möller and Trumbore 1997).
fn crossing([a, b, c]: [DVec3; 3], from: DVec3, direction: DVec3) -> Option<f64> {
    let (ab, ac, way) = (b - a, c - a, from - a);
    let over = direction.cross(ac);
    let whole = ab.dot(over);
    let across = way.cross(ab);
    let (u, v) = (way.dot(over) / whole, direction.dot(across) / whole);
    let distance = ac.dot(across) / whole;
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
}
