//! The parts of a source, as its near receivers see them.

use glam::DVec3;

use super::parts::{Part, PartTree};
use crate::math::form_factor::{to_triangle, vector_to_triangle};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// A part further off than this many of its radii, and wholly above the receiver's horizon, counts
/// as four points with its moments of area up to the second.
const AS_POINTS: f64 = 3.0;

/// A part further off than this many of its radii counts as one point where a form factor within
/// [`ROUGH`] of the true one will do.
const AS_ROUGH_POINT: f64 = 2.5;

/// Of a part that crosses a horizon: the share of its height above the lowest it may have that
/// counts as its height, at least.
const CROSSES: f64 = 0.15;

/// Of a form factor, the least that [`Seen::roughly`] may take it for.
pub(super) const ROUGH: f64 = 0.4;

/// Sine of the largest angle between a part's axis and a member's normal, for a part that is not in
/// one plane to count as a far.
const NARROW: f64 = 0.1;

/// As [`NARROW`], where a form factor within [`ROUGH`] of the true one will do.
const NARROW_ROUGHLY: f64 = 0.7;

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
    far: Vec<Far>,
}

/// A part as seen from afar.
#[derive(Debug, Clone, Copy, Default)]
struct Far {
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
    /// The four points `centre` ± a ± b have the second moments of its area.
    spread: [DVec3; 2],
    /// Sine of the largest angle between the axis and a member's normal; 0 of a part in one plane,
    /// and more than 1 of one that turns further than a right angle.
    turned: f64,
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
        let members: Vec<Far> = (triangles.iter().zip(normals))
            .map(|(triangle, normal)| Far::of_member(triangle, normal))
            .collect();
        let mut far = vec![Far::default(); tree.part_count()];
        if !members.is_empty() {
            fill(tree.whole(), &members, source.cone == 0.0, &mut far);
        }
        Self {
            middle: source.centroid,
            radius: source.radius,
            tree,
            triangles,
            far,
        }
    }

    /// Form factor from a receiver's samples to a part, as if nothing stood between. Notes it in
    /// `factors`, `[part]`, and those that it is the sum of.
    pub fn note(&self, part: Part, before: &Before, factors: &mut [f64]) -> f64 {
        let (far, n) = (&self.far[part.index], before.normal);
        let add = |sum: f64, &(p, weight): &(DVec3, f64)| {
            let factor = far.vector(p, n)?.dot(n).max(0.0);
            Some(sum + weight * factor)
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
        match (self.far[part.index].vector(p, n), part.count) {
            (Some(vector), _) => vector.dot(n).max(0.0),
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
        match (self.far[part.index].roughly(p, n), part.count) {
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
        match (self.far[part.index].vector(p, n), part.count) {
            (Some(vector), _) => vector,
            (None, 1) => vector_to_triangle(p, n, &self.triangles[part.first]),
            (None, _) => (part.halves().into_iter())
                .map(|half| self.vector(half, p, n))
                .sum(),
        }
    }

    /// [`Self::factor`] as a vector: without the members that turn their backs.
    pub fn facing(&self, part: Part, p: DVec3, n: DVec3) -> DVec3 {
        let vector = match (self.far[part.index].vector(p, n), part.count) {
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
        let far = &self.far[part.index];
        let gap = far.centre.distance(p) - far.radius;
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
        let far = &self.far[part.index];
        far.centre.distance(p) > radii * far.radius
    }

    /// Centroid of a part's area.
    pub fn centre(&self, part: Part) -> DVec3 {
        self.far[part.index].centre
    }

    pub fn centroid(&self, member: usize) -> DVec3 {
        centroid(&self.triangles[member])
    }
}

impl Far {
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
            spread: spread(normal, triangle.map(|v| (v - centre) / 12_f64.sqrt())),
            turned: 0.0,
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
        let moments = members.iter().flat_map(|m| {
            let [a, b] = m.spread;
            [m.centre - centre, a, b].map(|v| v * (m.area / area).sqrt())
        });
        let spread = spread(axis, moments);
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
            spread,
            turned: match plane {
                true => 0.0,
                false if cosine <= 0.0 => 2.0,
                // Members at several heights may face one way.
                false => sine.max(1e-9),
            },
        }
    }

    /// Form factor as a vector from a place with this normal; none where the part does not count as
    /// points.
    fn vector(&self, p: DVec3, n: DVec3) -> Option<DVec3> {
        let way = self.centre - p;
        let facing = -way.dot(self.vector_area);
        let is_plane = self.turned == 0.0;
        if self.is_above(p, -n) || is_plane && facing <= ABOVE * self.area {
            return Some(DVec3::ZERO);
        }
        let square = way.length_squared();
        let least = AS_POINTS * self.radius;
        if square <= least * least || self.turned > NARROW {
            return None;
        }
        let front = front(self.turned, 1.0 / AS_POINTS) * self.area;
        if !is_plane && facing * facing <= front * front * square {
            return None;
        }
        if facing <= 0.0 {
            return Some(DVec3::ZERO);
        }
        let [a, b] = self.spread;
        let points = [a + b, a - b, b - a, -a - b].map(|off| way + off);
        let of = |way: &DVec3| *way / way.length_squared().powi(2);
        let share = facing / (4.0 * std::f64::consts::PI);
        (self.is_above(p, n)).then(|| share * points.iter().map(of).sum::<DVec3>())
    }

    /// About the form factor from a place, rather too large than too small; none where the part
    /// does not count as a point.
    fn roughly(&self, p: DVec3, n: DVec3) -> Option<f64> {
        let way = self.centre - p;
        let facing = -way.dot(self.vector_area);
        let is_plane = self.turned == 0.0;
        if self.is_above(p, -n) || is_plane && facing <= ABOVE * self.area {
            return Some(0.0);
        }
        let square = way.length_squared();
        let least = AS_ROUGH_POINT * self.radius;
        if square <= least * least || self.turned > NARROW_ROUGHLY {
            return None;
        }
        // Of a part that crosses a horizon, its own or the place's, something is seen.
        let above = |height: f64, most: f64| height.max(CROSSES * (height + most)).max(0.0);
        let facing = match is_plane {
            true => facing,
            false => {
                let front = front(self.turned, 1.0 / AS_ROUGH_POINT);
                above(facing, front * self.area * square.sqrt())
            }
        };
        let height = above(way.dot(n), self.radius);
        Some(facing * height / (std::f64::consts::PI * square * square))
    }

    /// Whether all of it lies above the horizon of a place with this normal.
    fn is_above(&self, p: DVec3, n: DVec3) -> bool {
        let lowest = DVec3::select(n.cmpgt(DVec3::ZERO), self.low, self.high);
        (lowest - p).dot(n) >= -ABOVE
    }
}

/// Sine of the angle above the plane across a part's axis from which on a place sees the front of
/// every member: the sum of two angles, of which these are the sines: of the part's normals, and
/// under which its radius is seen.
fn front(turned: f64, radius: f64) -> f64 {
    let cosine = |sine: f64| (1.0 - sine * sine).sqrt();
    turned * cosine(radius) + cosine(turned) * radius
}

fn centroid(triangle: &[DVec3; 3]) -> DVec3 {
    (triangle[0] + triangle[1] + triangle[2]) / 3.0
}

/// Two vectors across an axis with the second moments of these: a aᵀ + b bᵀ = Σ v vᵀ.
fn spread(axis: DVec3, of: impl IntoIterator<Item = DVec3>) -> [DVec3; 2] {
    let (s, t) = axis
        .try_normalize()
        .unwrap_or(DVec3::Z)
        .any_orthonormal_pair();
    let (mut ss, mut st, mut tt) = (0.0, 0.0, 0.0);
    for v in of {
        let (x, y) = (v.dot(s), v.dot(t));
        (ss, st, tt) = (ss + x * x, st + x * y, tt + y * y);
    }
    // Cholesky's factors.
    let along = ss.sqrt();
    let across = if along > 0.0 { st / along } else { 0.0 };
    let rest = (tt - across * across).max(0.0).sqrt();
    [along * s + across * t, rest * t]
}

/// Finds how a part and those below it are seen from afar.
fn fill(part: Part, members: &[Far], plane: bool, far: &mut [Far]) {
    far[part.index] = match part.count {
        1 => members[part.first],
        count => {
            for half in part.halves() {
                fill(half, members, plane, far);
            }
            Far::of_part(&members[part.first..part.first + count], plane)
        }
    };
}
