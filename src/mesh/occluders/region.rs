//! Regions: elements connected over edges that lie in one plane to rounding.

use glam::DVec3;

use crate::constants::NONE;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;

/// Elements of one plane.
pub struct Region {
    /// The member whose plane the region lies in.
    pub item: u32,
    /// Two or more, ascending.
    pub members: Vec<u32>,
}

/// Farthest that a corner may lie from the item's plane: a fifth of the least height that passes
/// distinguish, because heights in f32 use up part of that.
const PLANE: f64 = 2e-7;
/// Largest sine of the angle between a member's normal and the item's, beyond the effect of
/// rounding.
const SINE: f64 = 1e-6;
/// How far two corners' rounding (see [`crate::mesh::elements`]) may lift one over the other: √3
/// steps of 2⁻²⁶, and a margin.
const ROUNDING: f64 = 4e-8;

/// All regions of two or more elements, in order of their first members; they do not overlap. Each
/// member is compared with the item's plane, not with that of the neighbour it was reached from, so
/// that even a gentle bend ends a region.
pub fn regions(elements: &Elements, connections: &Connections) -> Vec<Region> {
    let mut growth = Growth {
        elements,
        connections,
        taken: vec![false; elements.len()],
        reached: vec![NONE; elements.len()],
        round: 0,
    };
    let mut regions = Vec::new();
    for e in 0..elements.len() as u32 {
        // A region about a better item may not include element e.
        while !growth.taken[e as usize] {
            let (item, mut members) = growth.best(e);
            for &m in &members {
                growth.taken[m as usize] = true;
            }
            if members.len() > 1 {
                members.sort_unstable();
                regions.push(Region { item, members });
            }
        }
    }
    regions.sort_by_key(|region| region.members[0]);
    regions
}

struct Growth<'a> {
    elements: &'a Elements,
    connections: &'a Connections,
    taken: Vec<bool>,
    /// Round in which each element was last reached.
    reached: Vec<u32>,
    round: u32,
}

impl Growth<'_> {
    /// The item and the members of the region about an element. Normals of small elements are
    /// imprecise unless they are along an axis: the member whose normal is nearest to the mean
    /// becomes the item until the region grows no more.
    fn best(&mut self, seed: u32) -> (u32, Vec<u32>) {
        let normal = |e: u32| self.elements.normal[e as usize];
        let area = |e: u32| self.elements.area[e as usize];
        let mut item = seed;
        let mut members = self.grow(seed);
        loop {
            let weighed = members.iter().map(|&e| normal(e) * area(e));
            let mean = weighed.sum::<DVec3>().normalize_or(normal(item));
            let off = |e: u32| normal(e).distance_squared(mean);
            let best = members
                .iter()
                .copied()
                .min_by(|&a, &b| off(a).total_cmp(&off(b)))
                .filter(|&best| off(best) < off(item));
            let Some(best) = best else {
                return (item, members);
            };
            let again = self.grow(best);
            if again.len() <= members.len() {
                return (item, members);
            }
            (item, members) = (best, again);
        }
    }

    /// The free elements that are connected to `item` through others of its plane.
    fn grow(&mut self, item: u32) -> Vec<u32> {
        self.round += 1;
        self.reached[item as usize] = self.round;
        let mut members = vec![item];
        let mut next = 0;
        while next < members.len() {
            let neighbours = self.connections.neighbours[members[next] as usize];
            for n in neighbours.into_iter().flatten() {
                let i = n as usize;
                if self.reached[i] != self.round && !self.taken[i] {
                    self.reached[i] = self.round;
                    if fits(self.elements, item as usize, i) {
                        members.push(n);
                    }
                }
            }
            next += 1;
        }
        members
    }
}

fn fits(elements: &Elements, item: usize, e: usize) -> bool {
    let normal = elements.normal[item];
    let sine = SINE + ROUNDING / altitude(elements, item) + ROUNDING / altitude(elements, e);
    let height = |v: DVec3| (v - elements.centroid[item]).dot(normal);
    normal.dot(elements.normal[e]) > 0.0
        && normal.cross(elements.normal[e]).length() <= sine
        && elements
            .triangle(e)
            .into_iter()
            .all(|v| height(v).abs() <= PLANE)
}

/// Of a triangle over its longest edge.
fn altitude(elements: &Elements, e: usize) -> f64 {
    let [a, b, c] = elements.triangle(e);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    2.0 * elements.area[e] / longest
}
