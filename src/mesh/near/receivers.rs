//! Elements in blocks, each of which is passed over as a whole where it lies far off.

use glam::DVec3;

use crate::mesh::elements::Elements;

const BLOCK: usize = 64;

/// Elements as receivers: a ball about the centroids of consecutive ones.
pub(super) struct Receiver {
    pub elements: std::ops::Range<usize>,
    pub centre: DVec3,
    pub radius: f64,
    /// Radius of an element.
    pub largest: f64,
    /// Of the elements, each once.
    pub corners: Vec<DVec3>,
}

impl Receiver {
    /// Blocks of all elements.
    pub fn all(elements: &Elements) -> Vec<Self> {
        let end = elements.len();
        (0..end)
            .step_by(BLOCK)
            .map(|first| {
                let of = first..(first + BLOCK).min(end);
                let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
                for c in &elements.centroid[of.clone()] {
                    low = low.min(*c);
                    high = high.max(*c);
                }
                let centre = 0.5 * (low + high);
                let distances = elements.centroid[of.clone()].iter();
                let mut corners = elements.corners[of.clone()].concat();
                corners.sort_unstable();
                corners.dedup();
                let vertex = |&v: &u32| elements.vertices[v as usize];
                let radii = of.clone().map(|e| elements.radius(e));
                Self {
                    largest: radii.fold(0.0, f64::max),
                    corners: corners.iter().map(vertex).collect(),
                    elements: of,
                    centre,
                    radius: distances.map(|c| c.distance(centre)).fold(0.0, f64::max),
                }
            })
            .collect()
    }
}
