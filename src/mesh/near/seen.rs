//! The parts of a source, as its near receivers see them.

use glam::DVec3;

use super::parts::{Part, PartTree};
use crate::math::form_factor::{sample_points, vector_to_triangle};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// A part further off than this many of its radii, and wholly above the receiver's horizon, counts as
/// a disc seen along its axis: off by less than 1 %.
const AS_DISC: f64 = 5.0;

/// A member further off than this many of its radii counts as three points: off by less than 1 %.
const AS_POINTS: f64 = 2.5;

/// As [`AS_DISC`], for a plane part where a form factor within [`ROUGH`] of the true one will do.
const AS_ROUGH_DISC: f64 = 3.0;

/// Of a form factor, the least that [`Seen::is_less`] may take it for: 64/81 of a disc's at three
/// radii, near its plane.
const ROUGH: f64 = 0.6;

/// Sine of the largest angle between a part's axis and a member's normal, for a part that is not in
/// one plane to count as a disc.
const NARROW: f64 = 0.1;

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
    /// `[part]`
    discs: Vec<Disc>,
}

/// A part as seen from afar.
#[derive(Debug, Clone, Copy, Default)]
struct Disc {
    /// Centroid of the area.
    centre: DVec3,
    /// Of a ball about the centre that holds such a ball of each member.
    radius: f64,
    /// Box that holds it.
    low: DVec3,
    high: DVec3,
    area: f64,
    /// Sum of area times normal.
    vector_area: DVec3,
    /// Sine of the angle above the plane across the axis from which on a place sees the front of
    /// every member, at [`AS_DISC`] radii; 0 of a part in one plane, and more than 1 of one that is
    /// not narrow.
    front: f64,
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
        let members: Vec<Disc> = (triangles.iter().zip(normals))
            .map(|(triangle, normal)| Disc::of_member(triangle, normal))
            .collect();
        let mut discs = vec![Disc::default(); tree.part_count()];
        if !members.is_empty() {
            fill(tree.whole(), &members, source.cone == 0.0, &mut discs);
        }
        Self {
            middle: source.centroid,
            radius: source.radius,
            tree,
            triangles,
            discs,
        }
    }

    /// Form factor from a receiver's samples to a part, as if nothing stood between. Notes it in
    /// `factors`, `[part]`, and those that it is the sum of.
    pub fn note(&self, part: Part, before: &Before, factors: &mut [f64]) -> f64 {
        let (disc, n) = (&self.discs[part.index], before.normal);
        let add = |sum: f64, &(p, weight): &(DVec3, f64)| {
            let factor = disc.vector(p, n, AS_DISC)?.dot(n).max(0.0);
            Some(sum + weight * factor)
        };
        let as_disc = before.samples.iter().try_fold(0.0, add);
        let factor = match (as_disc, part.count) {
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
        self.factor_by(part, p, n, AS_DISC)
    }

    /// Whether the form factor from a place to the whole is surely less than `least`.
    pub fn is_less(&self, p: DVec3, n: DVec3, least: f64) -> bool {
        self.factor_by(self.tree.whole(), p, n, AS_ROUGH_DISC) < ROUGH * least
    }

    fn factor_by(&self, part: Part, p: DVec3, n: DVec3, as_disc: f64) -> f64 {
        match (self.discs[part.index].vector(p, n, as_disc), part.count) {
            (Some(vector), _) => vector.dot(n).max(0.0),
            (None, 1) => self.of_member(part, p, n).dot(n).max(0.0),
            (None, _) => {
                let [one, other] = part.halves();
                self.factor_by(one, p, n, as_disc) + self.factor_by(other, p, n, as_disc)
            }
        }
    }

    /// [`Self::factor`] as a vector; see [`vector_to_triangle`].
    pub fn vector(&self, part: Part, p: DVec3, n: DVec3) -> DVec3 {
        match (self.discs[part.index].vector(p, n, AS_DISC), part.count) {
            (Some(vector), _) => vector,
            (None, 1) => self.of_member(part, p, n),
            (None, _) => (part.halves().into_iter())
                .map(|half| self.vector(half, p, n))
                .sum(),
        }
    }

    /// Form factor as a vector from a place that sees the front of a member.
    fn of_member(&self, part: Part, p: DVec3, n: DVec3) -> DVec3 {
        let (disc, triangle) = (&self.discs[part.index], &self.triangles[part.first]);
        let middle = disc.centre - p;
        let least = AS_POINTS * disc.radius;
        if !disc.is_above(p, n) || middle.length_squared() <= least * least {
            return vector_to_triangle(p, n, triangle);
        }
        let [a, b, c] = triangle.map(|v| v - p);
        let of = |&[u, v, weight]: &[f64; 3]| {
            let way = a + u * (b - a) + v * (c - a);
            way * (weight / way.length_squared().powi(2))
        };
        let sum: DVec3 = sample_points(true, false).iter().map(of).sum();
        sum * (-middle.dot(disc.vector_area) / std::f64::consts::PI)
    }

    /// The least distance from a place to the ball about a member other than element `but`, where
    /// it is less than `most`.
    pub fn nearest(&self, part: Part, p: DVec3, but: usize, most: f64) -> f64 {
        let disc = &self.discs[part.index];
        let gap = disc.centre.distance(p) - disc.radius;
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

    /// The member before and after which lie halves of a part, by the form factors of [`Self::note`]
    /// and within parts that have none by area.
    pub fn middle_member(&self, mut part: Part, factors: &[f64]) -> usize {
        let mut share = 0.5;
        while part.count > 1 {
            let [one, other] = part.halves();
            let of_one = match factors[one.index].is_nan() {
                true => self.discs[one.index].area / self.discs[part.index].area,
                false => factors[one.index] / factors[part.index],
            };
            (part, share) = match share <= of_one {
                true => (one, share / of_one),
                false => (other, (share - of_one) / (1.0 - of_one)),
            };
        }
        part.first
    }

    pub fn centroid(&self, member: usize) -> DVec3 {
        centroid(&self.triangles[member])
    }
}

impl Disc {
    fn of_member(triangle: &[DVec3; 3], normal: DVec3) -> Self {
        let [a, b, c] = *triangle;
        let centre = centroid(triangle);
        let area = 0.5 * (b - a).cross(c - a).length();
        let distances = triangle.map(|v| v.distance(centre));
        Self {
            centre,
            radius: distances.into_iter().fold(0.0, f64::max),
            low: a.min(b).min(c),
            high: a.max(b).max(c),
            area,
            vector_area: area * normal,
            front: 0.0,
        }
    }

    /// Of a part, which lies in one plane or not.
    fn of_part(members: &[Self], plane: bool) -> Self {
        let area: f64 = members.iter().map(|m| m.area).sum();
        let weighted: DVec3 = members.iter().map(|m| m.area * m.centre).sum();
        let centre = weighted / area;
        let vector_area: DVec3 = members.iter().map(|m| m.vector_area).sum();
        let radii = members.iter().map(|m| m.centre.distance(centre) + m.radius);
        let axis = vector_area.normalize_or_zero();
        let cosines = members.iter().map(|m| m.vector_area.dot(axis) / m.area);
        let cosine = cosines.fold(1.0, f64::min);
        let sine = (1.0 - cosine * cosine).sqrt();
        Self {
            centre,
            radius: radii.fold(0.0, f64::max),
            low: members.iter().fold(centre, |low, m| low.min(m.low)),
            high: members.iter().fold(centre, |high, m| high.max(m.high)),
            area,
            vector_area,
            front: match plane {
                true => 0.0,
                false if cosine <= 0.0 || sine > NARROW => 2.0,
                false => sine * (1.0 - AS_DISC.powi(-2)).sqrt() + cosine / AS_DISC,
            },
        }
    }

    /// Form factor as a vector from a place with this normal; none where the part does not count as
    /// one disc. One in a plane does from `as_disc` radii on.
    fn vector(&self, p: DVec3, n: DVec3, as_disc: f64) -> Option<DVec3> {
        let way = self.centre - p;
        let facing = -way.dot(self.vector_area);
        let is_plane = self.front == 0.0;
        if self.is_above(p, -n) || is_plane && facing <= ABOVE * self.area {
            return Some(DVec3::ZERO);
        }
        let square = way.length_squared();
        let least = self.radius * if is_plane { as_disc } else { AS_DISC };
        let is_far = square > least * least;
        let turned = self.front * self.area;
        if !is_far || !is_plane && facing * facing <= turned * turned * square {
            return None;
        }
        if facing <= 0.0 {
            return Some(DVec3::ZERO);
        }
        let disc = std::f64::consts::PI * square + self.area;
        (self.is_above(p, n)).then(|| way * (facing / (square * disc)))
    }

    /// Whether all of it lies above the horizon of a place with this normal.
    fn is_above(&self, p: DVec3, n: DVec3) -> bool {
        let lowest = DVec3::select(n.cmpgt(DVec3::ZERO), self.low, self.high);
        (lowest - p).dot(n) >= -ABOVE
    }
}

fn centroid(triangle: &[DVec3; 3]) -> DVec3 {
    (triangle[0] + triangle[1] + triangle[2]) / 3.0
}

/// Finds the discs of a part and of those below it.
fn fill(part: Part, members: &[Disc], plane: bool, discs: &mut [Disc]) {
    discs[part.index] = match part.count {
        1 => members[part.first],
        count => {
            for half in part.halves() {
                fill(half, members, plane, discs);
            }
            Disc::of_part(&members[part.first..part.first + count], plane)
        }
    };
}
