//! Occluders: the triangles that item buffers are drawn from.
//!
//! The `receiver` estimator needs only the plane of an item. Neighbouring elements of one plane are
//! therefore drawn as the few triangles that fill their outline, each drawn as one element of that
//! plane. The outline keeps all its corners, also those on a straight line: neighbours share whole
//! edges, no crack opens, and the same pixels are covered.

mod outline;
mod region;
mod triangulate;

use glam::DVec3;
use rayon::prelude::*;

use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::structs::ShadowOccluder;
use outline::outlines;
use region::{Region, regions};

/// A region with the triangles that are drawn in place of its members.
struct Merged {
    region: Region,
    /// Corners, as of [`Elements::corners`].
    triangles: Vec<[u32; 3]>,
}

/// Structure of arrays, `[occluder]`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Occluders {
    /// Corners, as of [`Elements::corners`].
    pub corners: Vec<[u32; 3]>,
    /// The element that each is drawn as; both lie in the same plane and connected part.
    pub items: Vec<u32>,
    /// Number of occluders at the beginning of the list that are single elements, in their order.
    pub own: usize,
}

impl Occluders {
    /// The elements themselves.
    pub fn elements(elements: &Elements) -> Self {
        Self {
            corners: elements.corners.clone(),
            items: (0..elements.len() as u32).collect(),
            own: elements.len(),
        }
    }

    /// Elements of one plane merged where that gives fewer triangles.
    pub fn merged(elements: &Elements, connections: &Connections) -> Self {
        let regions = regions(elements, connections);
        let outlines = outlines(elements, connections, &regions);
        let drawn: Vec<_> = regions
            .into_par_iter()
            .zip(outlines)
            .filter_map(|(region, outline)| {
                let triangles = triangulate::triangulate(elements, &region, &outline)?;
                Some(Merged { region, triangles })
            })
            .collect();
        Self::from_regions(elements, connections, &drawn)
    }

    fn from_regions(elements: &Elements, connections: &Connections, drawn: &[Merged]) -> Self {
        let mut merged = vec![false; elements.len()];
        for &e in drawn.iter().flat_map(|m| &m.region.members) {
            merged[e as usize] = true;
        }
        let mut items: Vec<_> = (0..elements.len() as u32)
            .filter(|&e| !merged[e as usize])
            .collect();
        let mut corners: Vec<_> = items
            .iter()
            .map(|&e| elements.corners[e as usize])
            .collect();
        let own = items.len();
        // By connected part, because a meshlet holds elements of one part only.
        let mut by_part: Vec<_> = drawn.iter().collect();
        by_part.sort_by_key(|m| connections.component[m.region.item as usize]);
        for Merged { region, triangles } in by_part {
            items.extend(std::iter::repeat_n(region.item, triangles.len()));
            corners.extend(triangles);
        }
        Self {
            corners,
            items,
            own,
        }
    }

    pub fn len(&self) -> usize {
        self.items.len()
    }

    pub fn is_empty(&self) -> bool {
        self.items.is_empty()
    }

    /// For a tree of them: `[occluder]`, internal units.
    pub fn casters(&self, elements: &Elements, connections: &Connections) -> Vec<ShadowOccluder> {
        let caster = |(corners, &item): (&[u32; 3], &u32)| {
            let item = item as usize;
            let [a, b, c] = corners.map(|v| elements.vertices[v as usize].as_vec3());
            let component = connections.component[item];
            let normal = elements.normal[item];
            ShadowOccluder {
                a,
                component,
                b,
                closed: connections.closed[component as usize].into(),
                c,
                height: normal.dot(elements.centroid[item]) as f32,
                normal: normal.as_vec3(),
                unused: 0,
            }
        };
        self.corners.iter().zip(&self.items).map(caster).collect()
    }

    /// Corner positions of an occluder.
    pub fn triangle(&self, elements: &Elements, occluder: usize) -> [DVec3; 3] {
        self.corners[occluder].map(|v| elements.vertices[v as usize])
    }
}
