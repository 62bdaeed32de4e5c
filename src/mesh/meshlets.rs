//! Meshlets: up to 64 consecutive occluders with a ball and a cone of normals, culled as a whole.

use std::ops::Range;

use glam::DVec3;

use crate::constants::MESHLET_TRIANGLES;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;

#[derive(Debug, Clone, Copy)]
pub struct Meshlet {
    pub centre: DVec3,
    pub radius: f64,
    /// Axis of the cone of normals.
    pub axis: DVec3,
    /// Sine of the cone's half angle; 2 where no direction sees only backs.
    pub cutoff: f64,
    pub first: u32,
    pub count: u32,
    pub component: u32,
}

/// A new chart starts a new meshlet if the last one has at least this many triangles.
const ENOUGH: u32 = MESHLET_TRIANGLES / 3;

/// Cuts the occluders, in order, into meshlets of one connected part each. `chart` is `[element]`.
pub fn build(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
    chart: &[u32],
) -> Vec<Meshlet> {
    let item = |i: usize| occluders.items[i] as usize;
    let mut meshlets = Vec::new();
    let mut first = 0;
    for i in 1..=occluders.len() {
        let count = (i - first) as u32;
        let ends = i == occluders.len()
            || count == MESHLET_TRIANGLES
            || i == occluders.own
            || (chart[item(i)] != chart[item(i - 1)] && count >= ENOUGH)
            || connections.component[item(i)] != connections.component[item(i - 1)];
        if ends {
            let component = connections.component[item(first)];
            meshlets.push(bound(elements, occluders, first..i, component));
            first = i;
        }
    }
    meshlets
}

fn bound(
    elements: &Elements,
    occluders: &Occluders,
    range: Range<usize>,
    component: u32,
) -> Meshlet {
    let corners = || range.clone().flat_map(|i| occluders.triangle(elements, i));
    let normals = || {
        range
            .clone()
            .map(|i| elements.normal[occluders.items[i] as usize])
    };
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for v in corners() {
        low = low.min(v);
        high = high.max(v);
    }
    let centre = 0.5 * (low + high);
    let first = elements.normal[occluders.items[range.start] as usize];
    let axis = normals().sum::<DVec3>().normalize_or(first);
    let cosine = normals().map(|n| n.dot(axis)).fold(1.0, f64::min);
    Meshlet {
        centre,
        // Enlarged slightly for the rounding to f32.
        radius: corners().map(|v| v.distance(centre)).fold(0.0, f64::max) * (1.0 + 1e-5) + 1e-7,
        axis,
        cutoff: if cosine > 0.1 {
            (1.0 - cosine * cosine).sqrt() + 1e-5
        } else {
            2.0
        },
        first: range.start as u32,
        count: range.len() as u32,
        component,
    }
}
