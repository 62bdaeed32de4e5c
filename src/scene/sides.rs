//! Which sides of surfaces light falls on.
//!
//! Only the front of a triangle sends and receives light, and modellers do not show which side that
//! is. Random paths from the lights, off either side of what they meet, find the pieces that show
//! light only their backs: a room whose normals point outward is one.

mod starts;

use std::collections::HashSet;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::geometry::{ABOVE, Geometry};
use super::{Scene, Triangle};
use crate::math::groups::{Edge, Groups, edges, shared};
use crate::math::sampling::{Random, cosine_direction};
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
const PATHS: u64 = 8192;
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
    let edges = edges_of(&scene.triangles);
    // Of a closed piece each edge is run along to and fro.
    let mut open: HashSet<u32> = HashSet::new();
    for run in shared(&edges) {
        let way = |edge: &Edge| if edge.ascends { 1 } else { -1 };
        let mut ways: Vec<(u32, i64)> = (run.iter())
            .map(|edge| (pieces[edge.triangle as usize], way(edge)))
            .collect();
        ways.sort_unstable();
        for of in ways.chunk_by(|a, b| a.0 == b.0) {
            if of.iter().map(|(_, way)| way).sum::<i64>() != 0 {
                open.insert(of[0].0);
            }
        }
    }
    (0..choices.len())
        .filter(|&t| choices[t] == Choice::Two && open.contains(&pieces[t]))
        .filter(|&t| !scene.materials[scene.triangles[t].material as usize].emits())
        .collect()
}

/// Turns pieces that show light only their backs, where there is a choice, with a note. Gives the
/// triangles of two sides whose pieces show light both, without those that emit: a lamp is a front.
pub(super) fn turn_dark(scene: &mut Scene, choices: &[Choice]) -> Vec<usize> {
    let is_given = choices.iter().all(|&choice| choice == Choice::None);
    if is_given {
        return Vec::new();
    }
    // What cannot be met by rays is refused when the scene is checked.
    let Ok(geometry) = Geometry::for_few_rays(scene) else {
        return Vec::new();
    };
    let starts = Starts::of(scene, &geometry);
    let pieces = pieces(&scene.triangles);
    let count = pieces.iter().max().map_or(0, |&last| last as usize + 1);
    // Meetings of each piece, [front, back].
    let mut met = vec![[0_u32; 2]; count];
    for path in 0..PATHS {
        let mut random = Random::new(0, 0, path);
        let Some((mut from, mut direction)) = starts.ray(&mut random) else {
            break;
        };
        for _ in 0..BOUNCES {
            let Some(hit) = geometry.hit(from, direction) else {
                break;
            };
            met[pieces[hit.triangle] as usize][usize::from(!hit.front)] += 1;
            let side = if hit.front { hit.normal } else { -hit.normal };
            direction = cosine_direction(side, random.square());
            from = hit.place + ABOVE * side;
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
    let turned = |[a, b, c]: [[f32; 2]; 3]| [a, c, b];
    let [a, b, c] = triangle.vertices;
    Triangle {
        vertices: [a, c, b],
        uv: turned(triangle.uv),
        emission_uv: triangle.emission_uv.map(turned),
        light_uv: triangle.light_uv.map(turned),
        ..*triangle
    }
}

/// A number for each triangle, the same for those that are joined by edges along which their fronts
/// are on one side.
fn pieces(triangles: &[Triangle]) -> Vec<u32> {
    let mut groups = Groups::new(triangles.len());
    for run in shared(&edges_of(triangles)) {
        if let [one, other] = run
            && one.ascends != other.ascends
        {
            groups.join(one.triangle, other.triangle);
        }
    }
    groups.numbers(0..triangles.len() as u32)
}

fn edges_of(triangles: &[Triangle]) -> Vec<Edge> {
    edges(triangles.iter().map(|t| t.vertices))
}
