//! The outline of a region.

use crate::constants::NONE;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;

use super::region::Region;

/// The edges about a region, from vertex to vertex, the inside on the left seen from the front:
/// every edge that no other member shares. Triangles of this outline cover the same pixels as the
/// members do, because both have the same corners along it.
pub struct Outline {
    pub edges: Vec<(u32, u32)>,
}

impl Outline {
    /// Ascending.
    pub fn vertices(&self) -> Vec<u32> {
        let mut vertices: Vec<_> = self.edges.iter().flat_map(|&(a, b)| [a, b]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}

pub fn outlines(
    elements: &Elements,
    connections: &Connections,
    regions: &[Region],
) -> Vec<Outline> {
    let mut region_of = vec![NONE; elements.len()];
    for (r, region) in (0..).zip(regions) {
        for &e in &region.members {
            region_of[e as usize] = r;
        }
    }
    let outline = |(r, region): (u32, &Region)| {
        let mut edges = Vec::new();
        for &e in &region.members {
            let corners = elements.corners[e as usize];
            for (i, neighbour) in connections.neighbours[e as usize].iter().enumerate() {
                if neighbour.is_none_or(|n| region_of[n as usize] != r) {
                    edges.push((corners[i], corners[(i + 1) % 3]));
                }
            }
        }
        edges.sort_unstable();
        Outline { edges }
    };
    (0..).zip(regions).map(outline).collect()
}
