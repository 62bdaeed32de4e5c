//! The outline of a group of elements: closed loops of corners, straight runs joined.
//!
//! By Lambert's formula an inner edge is traversed in both directions and adds nothing to a group's
//! form factor: the outline suffices.

use std::collections::BTreeMap;

use glam::DVec3;

use crate::mesh::elements::Elements;

/// A closed loop of corners; the last is joined to the first.
pub type Loop = Vec<DVec3>;

/// Loops about the elements of a range, counter-clockwise seen from the front, holes clockwise.
pub fn contour(elements: &Elements, range: std::ops::Range<usize>) -> Vec<Loop> {
    // Directed edges that no partner cancels, with their multiplicity.
    let mut edges: BTreeMap<(u32, u32), u32> = BTreeMap::new();
    for e in range {
        let corners = elements.corners[e];
        for i in 0..3 {
            let (a, b) = (corners[i], corners[(i + 1) % 3]);
            match edges.get_mut(&(b, a)) {
                Some(1) => {
                    edges.remove(&(b, a));
                }
                Some(n) => *n -= 1,
                None => *edges.entry((a, b)).or_default() += 1,
            }
        }
    }
    let mut loops = Vec::new();
    while let Some((&(start, _), _)) = edges.first_key_value() {
        let mut vertices = Vec::new();
        let mut at = start;
        // As many edges leave a vertex as enter it, so that every walk closes.
        while let Some((&edge, _)) = edges.range((at, 0)..=(at, u32::MAX)).next() {
            match edges.get_mut(&edge) {
                Some(n) if *n > 1 => *n -= 1,
                _ => {
                    edges.remove(&edge);
                }
            }
            vertices.push(at);
            at = edge.1;
            if at == start {
                break;
            }
        }
        let corners: Vec<_> = vertices
            .iter()
            .map(|&v| elements.vertices[v as usize])
            .collect();
        loops.push(straightened(&corners));
    }
    loops
}

/// Removes the corners at which a loop is straight.
fn straightened(corners: &[DVec3]) -> Loop {
    let mut out: Vec<DVec3> = corners.to_vec();
    let mut i = 0;
    while out.len() > 3 && i < out.len() {
        let count = out.len();
        let before = out[i] - out[(i + count - 1) % count];
        let after = out[(i + 1) % count] - out[i];
        let straight = before.dot(after) > 0.0
            && before.cross(after).length() <= 1e-9 * before.length() * after.length();
        if straight {
            out.remove(i);
        } else {
            i += 1;
        }
    }
    out
}
