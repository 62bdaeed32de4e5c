//! The parts of a source, as its near receivers see them.

use glam::DVec3;

use super::far::{Afar, centroid};
use super::parts::{Part, PartTree};
use crate::math::form_factor::{to_triangle, vector_to_triangle};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// Of a form factor, the least that [`Seen::roughly`] may take it for.
pub(super) const ROUGH: f64 = 0.4;

/// Height above a plane from which on a place sees its front, internal units.
pub(super) const ABOVE: f64 = 1e-7;

/// Form factor of a part that none was found for: it counts within a larger part.
pub(super) const WITHIN: f64 = f64::NAN;

/// A receiver before a source.
pub(super) struct Before<'a> {
    pub element: usize,
    pub normal: DVec3,
    /// Places on it, and their weights.
    pub samples: &'a [(DVec3, f64)],
    /// Whether nothing can stand between.
    pub clear: bool,
}

/// A source as its near receivers see it.
pub(super) struct Seen {
    /// Of the ball that holds the source.
    pub middle: DVec3,
    pub radius: f64,
    pub tree: PartTree,
    /// Of the members, in the tree's order.
    pub triangles: Vec<[DVec3; 3]>,
    afar: Afar,
}

impl Seen {
    pub fn new(elements: &Elements, source: &Source) -> Self {
        let tree = PartTree::of(elements, source);
        // An element that is cut into several sources.
        let cut = source.element_count == 1;
        let triangle = |&e: &u32| match source.contour.first().map(Vec::as_slice) {
            Some(&[a, b, c]) if cut => [a, b, c],
            _ => elements.triangle(e as usize),
        };
        let triangles: Vec<[DVec3; 3]> = tree.members.iter().map(triangle).collect();
        let normals = tree.members.iter().map(|&e| elements.normal[e as usize]);
        let afar = Afar::new(&tree, &triangles, normals, source.cone == 0.0);
        Self {
            middle: source.centroid,
            radius: source.radius,
            tree,
            triangles,
            afar,
        }
    }

    /// Form factor from a receiver's samples to a part, as if nothing stood between. Notes it in
    /// `factors`, `[part]`, and those that it is the sum of.
    pub fn note(&self, part: Part, before: &Before, factors: &mut [f64]) -> f64 {
        let n = before.normal;
        let add = |sum: f64, &(p, weight): &(DVec3, f64)| {
            Some(sum + weight * self.afar.factor(part, p, n)?)
        };
        let as_far = before.samples.iter().try_fold(0.0, add);
        let factor = match (as_far, part.count) {
            (Some(factor), 1) => factor,
            (Some(factor), _) => {
                for half in part.halves() {
                    factors[half.index] = WITHIN;
                }
                factor
            }
            (None, 1) if self.tree.members[part.first] as usize == before.element => 0.0,
            (None, 1) => (before.samples.iter())
                .map(|&(p, weight)| weight * self.factor(part, p, n))
                .sum(),
            (None, _) => {
                let [one, other] = part.halves();
                self.note(one, before, factors) + self.note(other, before, factors)
            }
        };
        factors[part.index] = factor;
        factor
    }

    /// Form factor from a place to a part, as if nothing stood between.
    pub fn factor(&self, part: Part, p: DVec3, n: DVec3) -> f64 {
        match (self.afar.factor(part, p, n), part.count) {
            (Some(factor), _) => factor,
            (None, 1) => self.of_member(part.first, p, n),
            (None, _) => {
                let [one, other] = part.halves();
                self.factor(one, p, n) + self.factor(other, p, n)
            }
        }
    }

    /// The form factor from a place to the whole, in the tests' scenes at least [`ROUGH`] of it.
    pub fn roughly(&self, p: DVec3, n: DVec3) -> f64 {
        self.part_roughly(self.tree.whole(), p, n)
    }

    fn part_roughly(&self, part: Part, p: DVec3, n: DVec3) -> f64 {
        match (self.afar.roughly(part, p, n), part.count) {
            (Some(factor), _) => factor,
            (None, 1) => self.of_member(part.first, p, n),
            (None, _) => {
                let [one, other] = part.halves();
                self.part_roughly(one, p, n) + self.part_roughly(other, p, n)
            }
        }
    }

    fn of_member(&self, member: usize, p: DVec3, n: DVec3) -> f64 {
        to_triangle(p, n, &self.triangles[member]).max(0.0)
    }

    /// [`Self::factor`] as a vector; see [`vector_to_triangle`].
    pub fn vector(&self, part: Part, p: DVec3, n: DVec3) -> DVec3 {
        match (self.afar.vector(part, p, n), part.count) {
            (Some(vector), _) => vector,
            (None, 1) => vector_to_triangle(p, n, &self.triangles[part.first]),
            (None, _) => (part.halves().into_iter())
                .map(|half| self.vector(half, p, n))
                .sum(),
        }
    }

    /// [`Self::factor`] as a vector: without the members that turn their backs.
    pub fn facing(&self, part: Part, p: DVec3, n: DVec3) -> DVec3 {
        let vector = match (self.afar.vector(part, p, n), part.count) {
            (Some(vector), _) => vector,
            (None, 1) => vector_to_triangle(p, n, &self.triangles[part.first]),
            (None, _) => {
                return (part.halves().into_iter())
                    .map(|half| self.facing(half, p, n))
                    .sum();
            }
        };
        match vector.dot(n) > 0.0 {
            true => vector,
            false => DVec3::ZERO,
        }
    }

    /// The least distance from a place to the ball about a member other than element `but`, where
    /// it is less than `most`.
    pub fn nearest(&self, part: Part, p: DVec3, but: usize, most: f64) -> f64 {
        let gap = self.centre(part).distance(p) - self.afar.radius(part);
        if gap >= most {
            return most;
        }
        match part.count {
            1 if self.tree.members[part.first] as usize == but => most,
            1 => gap,
            _ => (part.halves().into_iter())
                .fold(most, |most, half| self.nearest(half, p, but, most)),
        }
    }

    /// Places whose hull holds the source.
    pub fn hull(&self, source: &Source) -> Vec<DVec3> {
        match source.cone == 0.0 && !source.contour.is_empty() {
            true => source.contour.concat(),
            false => self.triangles.concat(),
        }
    }

    /// The member before which lies this share of a part's form factor. Notes in `factors` what it
    /// finds on the way.
    pub fn member_at(
        &self,
        mut left: f64,
        mut part: Part,
        before: &Before,
        factors: &mut [f64],
    ) -> usize {
        while part.count > 1 {
            let [of_one, of_other] = part.halves().map(|half| {
                if factors[half.index].is_nan() {
                    self.note(half, before, factors);
                }
                factors[half.index]
            });
            let [one, other] = part.halves();
            let share = of_one / (of_one + of_other);
            (part, left) = match left <= share {
                true => (one, left / share),
                false => (other, (left - share) / (1.0 - share)),
            };
        }
        part.first
    }

    /// Whether a part is further off than this many of its radii.
    pub fn is_beyond(&self, part: Part, p: DVec3, radii: f64) -> bool {
        self.centre(part).distance(p) > radii * self.afar.radius(part)
    }

    /// Centroid of a part's area.
    pub fn centre(&self, part: Part) -> DVec3 {
        self.afar.centre(part)
    }

    pub fn centroid(&self, member: usize) -> DVec3 {
        centroid(&self.triangles[member])
    }
}
