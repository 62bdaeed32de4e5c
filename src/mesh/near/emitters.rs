//! What a place sees of an emitter, up to the edges of the shadows on it.

use glam::DVec3;

use super::parts::Part;
use super::rays::{blocked, is_clear};
use super::seen::Seen;
use crate::math::form_factor::vector_to_triangle;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::structs::ShadowOccluder;

/// Of the view of a place: the share that a part fills at most whose corners alone are looked at.
const PART: f64 = 1.0 / 192.0;

/// The same of what the place would see of the whole emitter.
const OF_WHOLE: f64 = 1.0 / 8.0;

/// A part is this many of its radii off before it counts as points: then its form factor is within
/// some 10⁻⁵.
const POINTS: f64 = 8.0;

/// Times that a member is cut in four.
const CUTS: u32 = 5;

/// Steps by which the edge of a shadow is found on a side of a triangle: to 1/1024 of it.
const STEPS: u32 = 10;

/// Corners are looked at this share of the way from the middle, since at an edge other surfaces
/// begin.
const INSIDE: f64 = 1.0 - 1e-4;

/// An emitter and the corners of its parts.
pub(super) struct Emitter {
    /// Places whose hull holds it.
    hull: Vec<DVec3>,
    /// Corners of each part that are furthest along some directions, `[part][direction]`.
    furthest: Vec<DVec3>,
    directions: usize,
}

/// A place that looks at an emitter.
pub(super) struct Looker<'a> {
    pub occluders: &'a ShadowTree<ShadowOccluder>,
    pub place: DVec3,
    pub normal: DVec3,
    /// Whether each piece is to fill no more than [`PART`] of the view, for its direction.
    pub by_direction: bool,
}

impl Emitter {
    pub fn new(source: &Source, seen: &Seen) -> Self {
        let is_plane = source.cone == 0.0;
        let (s, t) = (source.tangent, source.bitangent);
        // At angles at which rectangles along usual axes show each of their corners.
        let (sin, cos) = 0.4_f64.sin_cos();
        let turn = [cos * s + sin * t, cos * t - sin * s];
        let directions: Vec<DVec3> = match is_plane {
            true => turn.into_iter().flat_map(|way| [way, -way]).collect(),
            false => (0..8)
                .map(|i| {
                    let sign = |bit: u32| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
                    sign(0) * turn[0] + sign(1) * turn[1] + sign(2) * source.normal
                })
                .collect(),
        };
        let mut furthest = vec![DVec3::ZERO; seen.tree.part_count() * directions.len()];
        if !seen.triangles.is_empty() {
            fill(seen, seen.tree.whole(), &directions, &mut furthest);
        }
        Self {
            hull: seen.hull(source),
            furthest,
            directions: directions.len(),
        }
    }

    fn corners(&self, part: Part) -> &[DVec3] {
        &self.furthest[part.index * self.directions..][..self.directions]
    }
}

fn fill(seen: &Seen, part: Part, directions: &[DVec3], furthest: &mut [DVec3]) {
    let count = directions.len();
    let candidates: Vec<DVec3> = match part.count {
        1 => seen.triangles[part.first].into(),
        _ => (part.halves().into_iter())
            .flat_map(|half| {
                fill(seen, half, directions, furthest);
                furthest[half.index * count..][..count].to_vec()
            })
            .collect(),
    };
    for (k, way) in directions.iter().enumerate() {
        let far = |p: &&DVec3, q: &&DVec3| way.dot(**p).total_cmp(&way.dot(**q));
        if let Some(&corner) = candidates.iter().max_by(far) {
            furthest[part.index * count + k] = corner;
        }
    }
}

impl Looker<'_> {
    /// Each part of the emitter that is seen, with the form factor of what is seen of it as a
    /// vector, in one piece or several. `uneven` says whether a part emits too unevenly to count as
    /// one, by its whole form factor.
    pub fn look(
        &self,
        seen: &Seen,
        emitter: &Emitter,
        uneven: impl Fn(Part, f64) -> bool,
        mut each: impl FnMut(Part, DVec3),
    ) {
        let whole = seen.tree.whole();
        let all = self.towards(seen, whole);
        let height = |vector: DVec3| vector.dot(self.normal);
        if height(all) <= 0.0 {
            return;
        }
        let clear = is_clear(self.occluders, &[self.place], &emitter.hull);
        let most = PART.min(OF_WHOLE * height(all));
        let mut stack = vec![(whole, all)];
        while let Some((part, vector)) = stack.pop() {
            let factor = height(vector);
            let even = part.count == 1 || !uneven(part, factor);
            let narrow = !self.by_direction || factor <= PART;
            let small = part.count == 1 || seen.is_beyond(part, self.place, POINTS);
            if clear && even && small && narrow {
                each(part, vector);
                continue;
            }
            if part.count == 1 {
                let triangle = seen.triangles[part.first];
                let cuts = if narrow { 0 } else { CUTS };
                self.pieces(triangle, vector, cuts, &mut |piece, vector| {
                    let open = match clear {
                        true => vector,
                        false => self.open(piece, vector, most, CUTS),
                    };
                    if height(open) > 0.0 {
                        each(part, open);
                    }
                });
                continue;
            }
            if factor <= most && even && small && !clear {
                let middle = seen.centre(part);
                let inside = |&corner: &DVec3| middle + INSIDE * (corner - middle);
                let mut views = emitter.corners(part).iter().map(inside).chain([middle]);
                let first = views.next().is_some_and(|at| self.sees(at));
                if views.all(|at| self.sees(at) == first) {
                    if first {
                        each(part, vector);
                    }
                    continue;
                }
            }
            let halves = part.halves();
            let halves = halves.map(|half| (half, self.towards(seen, half)));
            stack.extend(
                halves
                    .into_iter()
                    .filter(|(_, vector)| height(*vector) > 0.0),
            );
        }
    }

    /// Form factor to a part as if nothing stood between, as a vector.
    fn towards(&self, seen: &Seen, part: Part) -> DVec3 {
        match part.count {
            1 => self.of(&seen.triangles[part.first]),
            _ => seen.facing(part, self.place, self.normal),
        }
    }

    /// A triangle cut in four until each piece fills [`PART`] of the view or less, or so often.
    fn pieces(
        &self,
        triangle: [DVec3; 3],
        vector: DVec3,
        cuts: u32,
        each: &mut impl FnMut(&[DVec3; 3], DVec3),
    ) {
        if cuts == 0 || vector.dot(self.normal) <= PART {
            each(&triangle, vector);
            return;
        }
        for quarter in quarters(&triangle) {
            self.pieces(quarter, self.of(&quarter), cuts - 1, each);
        }
    }

    fn sees(&self, at: DVec3) -> bool {
        !blocked(self.occluders, self.place, at)
    }

    /// Form factor of what is seen of a triangle, whose whole form factor this is, as vectors.
    fn open(&self, triangle: &[DVec3; 3], all: DVec3, most: f64, cuts: u32) -> DVec3 {
        let factor = all.dot(self.normal);
        if factor <= 0.0 {
            return DVec3::ZERO;
        }
        let quarters = || {
            let each = quarters(triangle);
            each.map(|quarter| self.open(&quarter, self.of(&quarter), most, cuts - 1))
                .into_iter()
                .sum()
        };
        if cuts > 0 && factor > most {
            return quarters();
        }
        let middle = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
        let corners = triangle.map(|corner| middle + INSIDE * (corner - middle));
        let views = corners.map(|corner| self.sees(corner));
        let of_middle = self.sees(middle);
        // The corner that is alone on its side of an edge.
        let odd = (0..3)
            .find(|&k| views[(k + 1) % 3] == views[(k + 2) % 3] && views[k] != views[(k + 1) % 3]);
        let Some(odd) = odd else {
            return match (views[0] == of_middle, of_middle) {
                (true, true) => all,
                (true, false) => DVec3::ZERO,
                (false, _) if cuts > 0 => quarters(),
                (false, true) => 0.25 * all,
                (false, false) => 0.75 * all,
            };
        };
        let tip = corners[odd];
        let ends = [1, 2].map(|k| {
            let to = corners[(odd + k) % 3];
            let (mut near, mut far) = (0.0, 1.0);
            for _ in 0..STEPS {
                let half = 0.5 * (near + far);
                match self.sees(tip + half * (to - tip)) == views[odd] {
                    true => near = half,
                    false => far = half,
                }
            }
            0.5 * (near + far)
        });
        let place =
            |k: usize| triangle[odd] + ends[k - 1] * (triangle[(odd + k) % 3] - triangle[odd]);
        // An edge that is straight leaves the middle on the side that it has been seen on; on the
        // tip's, where it lies within the tip's part: 1/ends sum to less than 3.
        let with_tip = ends.iter().map(|end| 1.0 / end.max(1e-9)).sum::<f64>() < 3.0;
        if (of_middle == views[odd]) != with_tip && cuts > 0 {
            return quarters();
        }
        let of_tip = self.of(&[triangle[odd], place(1), place(2)]);
        match (views[odd], of_tip.dot(self.normal) < factor) {
            (true, true) => of_tip,
            (true, false) => all,
            (false, true) => all - of_tip,
            (false, false) => DVec3::ZERO,
        }
    }

    /// Of a triangle that shows its front; else zero.
    fn of(&self, triangle: &[DVec3; 3]) -> DVec3 {
        let vector = vector_to_triangle(self.place, self.normal, triangle);
        match vector.dot(self.normal) > 0.0 {
            true => vector,
            false => DVec3::ZERO,
        }
    }
}

fn quarters(&[a, b, c]: &[DVec3; 3]) -> [[DVec3; 3]; 4] {
    let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
