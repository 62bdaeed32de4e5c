//! Meshlets: up to 64 consecutive elements with a ball and a cone of normals, culled as a whole.

use glam::DVec3;

use crate::charts::Connections;
use crate::constants::MESHLET_TRIANGLES;
use crate::elements::Elements;

#[derive(Debug, Clone, Copy)]
pub struct Meshlet {
    pub centre: DVec3,
    pub radius: f64,
    /// Axis of the cone of normals.
    pub axis: DVec3,
    /// Sine of the cone's half angle; 2 where the normals leave no side that shows only backs.
    pub cutoff: f64,
    pub first: u32,
    pub count: u32,
    pub component: u32,
}

/// A new chart starts a new meshlet once this many elements are in the last one.
const ENOUGH: u32 = MESHLET_TRIANGLES / 3;

/// Cuts the elements, in order, into meshlets of one part each.
pub fn build(elements: &Elements, connections: &Connections, chart: &[u32]) -> Vec<Meshlet> {
    let mut meshlets = Vec::new();
    let mut first = 0;
    for e in 1..=elements.len() {
        let count = (e - first) as u32;
        let ends = e == elements.len()
            || count == MESHLET_TRIANGLES
            || (chart[e] != chart[e - 1] && count >= ENOUGH)
            || connections.component[e] != connections.component[e - 1];
        if ends {
            meshlets.push(bound(elements, connections, first, e));
            first = e;
        }
    }
    meshlets
}

fn bound(elements: &Elements, connections: &Connections, first: usize, end: usize) -> Meshlet {
    let corners = || (first..end).flat_map(|e| elements.triangle(e));
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for v in corners() {
        low = low.min(v);
        high = high.max(v);
    }
    let centre = 0.5 * (low + high);
    let axis = (first..end)
        .map(|e| elements.normal[e])
        .sum::<DVec3>()
        .normalize_or(elements.normal[first]);
    let cosine = (first..end)
        .map(|e| elements.normal[e].dot(axis))
        .fold(1.0, f64::min);
    Meshlet {
        centre,
        // A little more than it is, for the rounding to f32.
        radius: corners().map(|v| v.distance(centre)).fold(0.0, f64::max) * (1.0 + 1e-5) + 1e-7,
        axis,
        cutoff: if cosine > 0.1 {
            (1.0 - cosine * cosine).sqrt() + 1e-5
        } else {
            2.0
        },
        first: first as u32,
        count: (end - first) as u32,
        component: connections.component[first],
    }
}
