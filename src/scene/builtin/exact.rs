//! Closed surfaces in an exact number of triangles.

use std::collections::{BinaryHeap, HashMap};

use glam::DVec3;

use super::surface_nets::{Surface, polygonise, towards_surface};

/// Share of the triangles left for splitting, so that a grid which happens to give a few more does not give too many.
const SPARE: f64 = 0.02;

/// Polygonises `distance` = 0, all of whose inside lies between `low` and `high`, into exactly `triangles`: closed,
/// every edge shared by two.
///
/// A grid gives a few less; the longest edges are then split, their middles moved on to the surface. None where no grid
/// gives a manifold with so few triangles. The number must be even, as that of every closed surface is.
pub(super) fn sculpt(
    distance: impl Fn(DVec3) -> f64,
    low: DVec3,
    high: DVec3,
    triangles: usize,
) -> Option<Surface> {
    assert!(triangles.is_multiple_of(2), "a closed surface is even");
    // The number goes with the inverse square of the cell's edge.
    let wanted = triangles as f64 * (1.0 - SPARE);
    let mut cell = (high - low).max_element() / 24.0;
    for _ in 0..3 {
        let found = polygonise(&distance, low, high, cell).triangles.len();
        cell *= (found.max(4) as f64 / wanted).sqrt().clamp(0.1, 4.0);
    }
    // A saddle that just touches a grid plane joins four quads at one edge; where depends on the grid alone, so other
    // grids are tried.
    for attempt in 0..100 {
        let shift = (DVec3::new(0.755, 0.570, 0.430) * f64::from(attempt)).fract();
        let mut surface = polygonise(&distance, low - shift * cell, high, cell);
        if surface.triangles.len() > triangles {
            cell *= 1.003;
        } else if surface.is_manifold() && surface.triangles.len() >= triangles / 2 {
            split_longest(&mut surface, triangles, |at| {
                towards_surface(&distance, at, cell)
            });
            return Some(surface);
        }
    }
    None
}

/// An edge in the queue: the longest first, then the one with the lowest vertices, whatever order they came in.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Edge {
    /// Bits of a number that is not negative: they are in its order.
    length: u64,
    vertices: std::cmp::Reverse<[u32; 2]>,
}

/// Splits the longest edges of a closed manifold, two triangles more each, until there are `count`; `place` moves the
/// middle of an edge to where it belongs.
pub(super) fn split_longest(surface: &mut Surface, count: usize, place: impl Fn(DVec3) -> DVec3) {
    let mut left_of: HashMap<[u32; 2], usize> = HashMap::new();
    let mut queue = BinaryHeap::new();
    for (index, &corners) in surface.triangles.iter().enumerate() {
        enter(&mut left_of, index, corners);
        for [a, b] in edges(corners) {
            if a < b {
                queue.push(surface.edge(a, b));
            }
        }
    }
    while surface.triangles.len() < count {
        let Some(Edge { vertices, .. }) = queue.pop() else {
            unreachable!("a closed surface has edges");
        };
        let [a, b] = vertices.0;
        let middle = surface.positions.len() as u32;
        let [p, q] = [a, b].map(|v| surface.positions[v as usize]);
        surface.positions.push(place((p + q) / 2.0));
        for [from, to] in [[a, b], [b, a]] {
            let index = left_of[&[from, to]];
            let corners = surface.triangles[index];
            let Some(across) = corners.into_iter().find(|&v| v != from && v != to) else {
                unreachable!("a triangle has three corners");
            };
            let halves = [[from, middle, across], [middle, to, across]];
            surface.triangles[index] = halves[0];
            enter(&mut left_of, index, halves[0]);
            enter(&mut left_of, surface.triangles.len(), halves[1]);
            surface.triangles.push(halves[1]);
            queue.push(surface.edge(across.min(middle), across.max(middle)));
        }
        queue.push(surface.edge(a, middle));
        queue.push(surface.edge(b, middle));
    }
}

impl Surface {
    fn edge(&self, a: u32, b: u32) -> Edge {
        let [p, q] = [a, b].map(|v| self.positions[v as usize]);
        Edge {
            length: p.distance_squared(q).to_bits(),
            vertices: std::cmp::Reverse([a, b]),
        }
    }
}

fn enter(left_of: &mut HashMap<[u32; 2], usize>, index: usize, corners: [u32; 3]) {
    for edge in edges(corners) {
        left_of.insert(edge, index);
    }
}

fn edges([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}
