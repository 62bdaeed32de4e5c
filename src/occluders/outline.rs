//! The outlines of regions, with no more corners than they all need together.

use std::collections::BTreeMap;

use super::region::Region;
use crate::charts::Connections;
use crate::constants::NONE;
use crate::elements::Elements;

/// The edges about a region, from vertex to vertex, its inside on the left seen from the front.
pub struct Outline {
    pub edges: Vec<(u32, u32)>,
}

impl Outline {
    /// How many vertices it has.
    pub fn corners(&self) -> usize {
        self.vertices().len()
    }

    /// Ascending.
    pub fn vertices(&self) -> Vec<u32> {
        let mut vertices: Vec<_> = self.edges.iter().flat_map(|&(a, b)| [a, b]).collect();
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }
}

/// Farthest that a vertex may lie from the edge that it is left out of: a few steps of what coordinates are rounded to.
const LINE: f64 = 1e-7;

/// Outlines of the regions. A vertex is left out where all that touches its place is regions, whose outlines pass it once and
/// straight: the same for all of them, so that they go on sharing edges.
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
    let mut kept = Kept::new(elements);
    for (e, corners) in elements.corners.iter().enumerate() {
        if region_of[e] == NONE {
            corners.iter().for_each(|&v| kept.keep(v));
        }
    }
    let loops: Vec<Loops> = (0..)
        .zip(regions)
        .map(|(r, region)| Loops::new(elements, connections, region, &region_of, r))
        .collect();
    for loops in &loops {
        loops.keep_bends(elements, &mut kept);
    }
    // What is straight at each vertex may still bend in all; what one outline keeps cuts the ways of others.
    let mut bent = true;
    while bent {
        bent = false;
        for loops in &loops {
            bent |= loops.keep_arcs(elements, &mut kept);
        }
    }
    loops.iter().map(|loops| loops.outline(&kept)).collect()
}

/// The vertices that stay in every outline. Those at one place that the scene does not join go together.
struct Kept {
    /// One number for all vertices of one place, `[vertex]`.
    place: Vec<u32>,
    kept: Vec<bool>,
}

impl Kept {
    fn new(elements: &Elements) -> Self {
        // Without the sign of a zero.
        let at = |v: u32| {
            (elements.vertices[v as usize] + 0.0)
                .to_array()
                .map(f64::to_bits)
        };
        let mut order: Vec<_> = (0..elements.vertices.len() as u32).collect();
        order.sort_unstable_by_key(|&v| at(v));
        let mut place = vec![0; order.len()];
        for same in order.chunk_by(|&a, &b| at(a) == at(b)) {
            for &v in same {
                place[v as usize] = same[0];
            }
        }
        Self {
            kept: vec![false; place.len()],
            place,
        }
    }

    fn keep(&mut self, v: u32) {
        self.kept[self.place[v as usize] as usize] = true;
    }

    fn keeps(&self, v: u32) -> bool {
        self.kept[self.place[v as usize] as usize]
    }
}

/// Whether `v` lies between two places, on the line through them.
fn between(elements: &Elements, a: u32, v: u32, b: u32) -> bool {
    let [a, v, b] = [a, v, b].map(|v| elements.vertices[v as usize]);
    let (before, after, chord) = (v - a, b - v, b - a);
    before.dot(chord) > 0.0
        && after.dot(chord) > 0.0
        && before.cross(chord).length() <= LINE * chord.length()
}

/// The edges of a region that no other member shares.
struct Loops {
    /// From each vertex to the next; more than one where the outline touches itself.
    next: BTreeMap<u32, Vec<u32>>,
    before: BTreeMap<u32, Vec<u32>>,
}

impl Loops {
    fn new(
        elements: &Elements,
        connections: &Connections,
        region: &Region,
        region_of: &[u32],
        r: u32,
    ) -> Self {
        let (mut next, mut before) = (BTreeMap::new(), BTreeMap::new());
        for &e in &region.members {
            let corners = elements.corners[e as usize];
            for (i, neighbour) in connections.neighbours[e as usize].iter().enumerate() {
                if neighbour.is_none_or(|n| region_of[n as usize] != r) {
                    let (a, b) = (corners[i], corners[(i + 1) % 3]);
                    next.entry(a).or_insert_with(Vec::new).push(b);
                    before.entry(b).or_insert_with(Vec::new).push(a);
                }
            }
        }
        Self { next, before }
    }

    /// Keeps the vertices at which the outline turns, ends or touches itself.
    fn keep_bends(&self, elements: &Elements, kept: &mut Kept) {
        for (&v, next) in &self.next {
            let straight = match (&self.before[&v][..], &next[..]) {
                (&[a], &[b]) => between(elements, a, v, b),
                _ => false,
            };
            if !straight {
                kept.keep(v);
            }
        }
    }

    /// Keeps the vertices of stretches that do not lie along the edge that would stand for them; whether there were any.
    fn keep_arcs(&self, elements: &Elements, kept: &mut Kept) -> bool {
        let mut stretches = self.stretches(kept);
        stretches.retain(|way| {
            let (a, b) = (way[0], way[way.len() - 1]);
            let mut inner = way[1..way.len() - 1].iter();
            !inner.all(|&v| between(elements, a, v, b))
        });
        for way in &stretches {
            way.iter().for_each(|&v| kept.keep(v));
        }
        !stretches.is_empty()
    }

    fn outline(&self, kept: &Kept) -> Outline {
        let stretches = self.stretches(kept);
        Outline {
            edges: stretches
                .iter()
                .map(|way| (way[0], way[way.len() - 1]))
                .collect(),
        }
    }

    /// The ways from one kept vertex to the next, both included.
    fn stretches(&self, kept: &Kept) -> Vec<Vec<u32>> {
        let starts = self.next.iter().filter(|(v, _)| kept.keeps(**v));
        let edges = starts.flat_map(|(&start, ends)| ends.iter().map(move |&end| (start, end)));
        edges
            .map(|(start, mut at)| {
                let mut way = vec![start, at];
                // Where a vertex is not kept, one edge comes in and one goes out.
                while !kept.keeps(at) {
                    at = self.next[&at][0];
                    way.push(at);
                }
                way
            })
            .collect()
    }
}
