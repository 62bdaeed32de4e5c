//! Where light breaks off within a triangle: along the outlines of what stands on it, hovers close
//! above it or sticks through it.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::Scene;
use super::cutting::{length, longest};
use super::surroundings::Surroundings;

/// Of a triangle's size: an edge as high above it, or lower, has an outline on it.
const REACH: f64 = 1.0 / 8.0;

/// Of a triangle's size: what is smaller and sticks through it has no outline on it.
const LEAST: f64 = 1.0 / 4.0;

/// Cosine between the normals of two triangles whose edge is part of an outline.
const SHARP: f64 = 0.94;

/// A line on a triangle of the input, by the barycentric coordinates of its ends.
pub(super) type Line = [DVec2; 2];

/// Lines on each triangle of the input, `[triangle]`, if triangles are cut to `size`.
pub(super) fn outlines(input: &Scene, surroundings: &Surroundings, size: f64) -> Vec<Vec<Line>> {
    let sharp = sharp_edges(input);
    (0..input.triangles.len())
        .into_par_iter()
        .map(|t| on_triangle(input, surroundings, &sharp, size, t))
        .collect()
}

fn on_triangle(
    input: &Scene,
    surroundings: &Surroundings,
    sharp: &[[bool; 3]],
    size: f64,
    t: usize,
) -> Vec<Line> {
    let triangle = &input.triangles[t];
    // Relief stays on its texels.
    if input.materials[triangle.material as usize].has_relief() {
        return Vec::new();
    }
    let corners @ [a, b, c] = input.corners(triangle);
    let size = size.min(length(corners, longest(corners, triangle.vertices)));
    let (reach, flat) = (REACH * size, surroundings.flat);
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let mut lines = Vec::new();
    surroundings.about(corners, reach, |o| {
        let other = input.corners(&input.triangles[o]);
        let heights = other.map(|v| (v - a).dot(normal));
        let (low, high) = heights
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &h| {
                (low.min(h), high.max(h))
            });
        if o == t || low > reach || high < -flat {
            return;
        }
        for k in (0..3).filter(|&k| sharp[o][k]) {
            let next = (k + 1) % 3;
            let edge = [other[k], other[next]];
            let of = [heights[k], heights[next]];
            lines.extend(between(edge, of, -flat, reach));
        }
        let is_large =
            || length(other, longest(other, input.triangles[o].vertices)) >= LEAST * size;
        if low < -flat && high > flat && is_large() {
            lines.extend(crossing(other, heights));
        }
    });
    let shortest = 1e-3 * size;
    lines
        .into_iter()
        .map(|[p, q]| [p, q].map(|p| p - (p - a).dot(normal) * normal))
        .filter(|[p, q]| p.distance(*q) > shortest)
        .filter_map(|ends| clipped(ends.map(|p| barycentric(corners, p))))
        .collect()
}

/// The part of an edge whose heights lie within a range.
fn between([p, q]: [DVec3; 2], [at_p, at_q]: [f64; 2], low: f64, high: f64) -> Option<[DVec3; 2]> {
    let [from, to] = share_above([[at_p - low, at_q - low], [high - at_p, high - at_q]])?;
    Some([p + from * (q - p), p + to * (q - p)])
}

/// Where a triangle goes through height 0.
fn crossing(corners: [DVec3; 3], heights: [f64; 3]) -> Option<[DVec3; 2]> {
    let mut ends = (0..3).filter_map(|k| {
        let next = (k + 1) % 3;
        let (from, to) = (heights[k], heights[next]);
        let at = from / (from - to);
        ((from < 0.0) != (to < 0.0)).then(|| corners[k] + at * (corners[next] - corners[k]))
    });
    Some([ends.next()?, ends.next()?])
}

/// Weights of the second and the third corner.
fn barycentric([a, b, c]: [DVec3; 3], p: DVec3) -> DVec2 {
    let normal = (b - a).cross(c - a);
    let all = normal.length_squared();
    DVec2::new(
        (p - a).cross(c - a).dot(normal) / all,
        (b - a).cross(p - a).dot(normal) / all,
    )
}

/// The part of a line within the triangle of these coordinates.
pub(super) fn clipped([p, q]: Line) -> Option<Line> {
    let sides = |p: DVec2| [p.x, p.y, 1.0 - p.x - p.y];
    let [one, other] = [sides(p), sides(q)];
    let [from, to] = share_above([0, 1, 2].map(|k| [one[k], other[k]]))?;
    Some([p.lerp(q, from), p.lerp(q, to)])
}

/// From where to where on a way all these are above 0, each of which is linear along it and given
/// at its two ends.
fn share_above<const N: usize>(of: [[f64; 2]; N]) -> Option<[f64; 2]> {
    let (mut from, mut to) = (0.0_f64, 1.0_f64);
    for [start, end] in of {
        let slope = end - start;
        if slope > 0.0 {
            from = from.max(-start / slope);
        } else if slope < 0.0 {
            to = to.min(-start / slope);
        } else if start < 0.0 {
            return None;
        }
    }
    (from < to).then_some([from, to])
}

/// Of each triangle its edges, from corner k to the next, that end a surface or at which it turns
/// away; each by one of its triangles.
fn sharp_edges(input: &Scene) -> Vec<[bool; 3]> {
    let mut places: HashMap<[u64; 3], u32> = HashMap::new();
    let known: Vec<u32> = (0..)
        .zip(&input.vertices)
        .map(|(v, place)| {
            *places
                .entry(place.to_array().map(f64::to_bits))
                .or_insert(v)
        })
        .collect();
    let normal = |t: usize| {
        let [a, b, c] = input.corners(&input.triangles[t]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut sharp = vec![[true; 3]; input.triangles.len()];
    let mut first: HashMap<[u32; 2], (usize, usize)> = HashMap::new();
    for (t, triangle) in input.triangles.iter().enumerate() {
        let v = triangle.vertices.map(|v| known[v as usize]);
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            if let Some(&(o, of)) = first.get(&[a.min(b), a.max(b)]) {
                sharp[t][k] = false;
                sharp[o][of] &= normal(t).dot(normal(o)) < SHARP;
            } else {
                first.insert([a.min(b), a.max(b)], (t, k));
            }
        }
    }
    sharp
}
