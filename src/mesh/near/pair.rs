//! What one element receives of a near source, part by part.

use glam::{DVec3, Vec3};

use super::parts::{GOLDEN, Part};
use super::rays::{blocked, is_clear};
use super::receivers::Receiver;
use super::seen::{ABOVE, Before, ROUGH, Seen};
use super::{Nearness, OfSource, Pair};
use crate::math::form_factor::{sample_points, spread_in_triangle, to_triangle};
use crate::math::kept::{as_kept, direction_code, kept_direction};
use crate::mesh::elements::Elements;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::structs::{NearPart, ShadowOccluder};

/// An element this many of its radii from a member, or less, has several samples; at most one
/// radius off, more.
const CLOSE: f64 = 4.0;

/// Of the share of a view from which on a source is near: from which on a source is that the ball
/// about an element nearly touches, since a part of it may see what the source's eye does not.
const BESIDE: f64 = 0.1;

/// Times that a single member is cut in four for its visibility.
const CUTS: u32 = 3;

/// A scene in which elements look for near sources.
pub(super) struct Search<'a> {
    pub elements: &'a Elements,
    pub occluders: &'a ShadowTree<ShadowOccluder>,
    pub nearness: Nearness,
    /// Whether a part counts as seen by a place of its own choice on it, not by its middle. Middles
    /// err to one side near silhouettes; other places cancel out over many parts.
    pub scattered: bool,
}

impl Search<'_> {
    pub fn source(&self, source: &Source, receivers: &[Receiver]) -> OfSource {
        let seen = Seen::new(self.elements, source);
        let mut found = OfSource::default();
        let mut factors = vec![0.0; seen.tree.part_count()];
        // Where it is seen under that share of a view at most, however it is turned.
        let reach =
            (source.area / (std::f64::consts::PI * self.nearness.source)).sqrt() + source.radius;
        let hull = seen.hull(source);
        let curved = source.cone > 0.0;
        for block in receivers {
            let mut clear = None;
            let beside = source.radius + CLOSE * block.largest;
            if block.centre.distance(source.centroid) > reach.max(beside) + block.radius {
                continue;
            }
            for e in block.elements.clone() {
                if self.may_be_near(e, source) {
                    let is_clear = || is_clear(self.occluders, &block.corners, &hull);
                    let clear = || *clear.get_or_insert_with(is_clear);
                    self.pair(e, &seen, clear, curved, &mut factors, &mut found);
                }
            }
        }
        found.tree = seen.tree;
        found
    }

    /// Whether an element may see so much of the source, by what is quickly found.
    fn may_be_near(&self, e: usize, source: &Source) -> bool {
        let (p, n) = (self.elements.centroid[e], self.elements.normal[e]);
        let way = source.centroid - p;
        if way.dot(n) <= -source.radius {
            return false;
        }
        let distance = way.length();
        let plane = source.cone == 0.0;
        if plane && way.dot(source.normal) >= -ABOVE {
            return false;
        }
        let gap = distance - source.radius;
        if gap <= (0.5 * source.radius).max(CLOSE * self.elements.radius(e)) {
            return true;
        }
        let cosine = (way.dot(n) + source.radius) / distance;
        let facing = match plane {
            true => (-way.dot(source.normal) + source.radius) / distance,
            // Of the member that is turned to the element most.
            false => {
                let angle = (-way.dot(source.normal) / distance).clamp(-1.0, 1.0).acos();
                (angle - source.cone - (source.radius / distance).asin())
                    .max(0.0)
                    .cos()
            }
        };
        if facing <= 0.0 {
            return false;
        }
        let most = cosine.min(1.0) * facing.min(1.0) * source.area;
        most > self.nearness.source * std::f64::consts::PI * gap * gap
    }

    /// Adds an element and its parts if the source is near. `clear` finds whether nothing can stand
    /// between; `factors` is room, `[part]`.
    fn pair(
        &self,
        e: usize,
        seen: &Seen,
        clear: impl FnOnce() -> bool,
        curved: bool,
        factors: &mut [f64],
        found: &mut OfSource,
    ) {
        let (elements, whole) = (self.elements, seen.tree.whole());
        let centroid = elements.centroid[e];
        let size = elements.radius(e);
        let nearest = seen.nearest(whole, centroid, e, CLOSE * size);
        let close = nearest < CLOSE * size;
        let gap = centroid.distance(seen.middle) - seen.radius;
        let least = match gap <= CLOSE * size {
            true => BESIDE * self.nearness.source,
            false => self.nearness.source,
        };
        let is_beside = close && nearest <= size;
        // The centroid of a close element may see less than its other parts.
        let of_centroid = least * if close { 0.5 } else { 1.0 };
        let normal = elements.normal[e];
        let before = |samples, clear| Before {
            element: e,
            normal,
            samples,
            clear,
        };
        let middle = [(centroid, 1.0)];
        let [a, b, c] = elements.triangle(e);
        let place = |&[u, v, weight]: &[f64; 3]| (a + u * (b - a) + v * (c - a), weight);
        // The centroid of one beside a member may see nothing: across a thin gap a place sees no
        // further than the gap is wide.
        if is_beside {
            let roughly = |(p, weight)| weight * seen.roughly(p, normal);
            let rough: f64 = sample_points(true, !curved)
                .iter()
                .map(place)
                .map(roughly)
                .sum();
            if rough < ROUGH * 0.5 * least {
                return;
            }
        } else {
            let rough = seen.roughly(centroid, normal);
            if rough == 0.0 && !close && gap <= 0.0 && curved {
                found.pairs.push(Pair {
                    element: e as u32,
                    factor: Vec3::ZERO,
                    entries: 0,
                });
            }
            if rough < ROUGH * of_centroid
                || seen.note(whole, &before(&middle, false), factors) <= of_centroid
            {
                return;
            }
        }
        // Elements of a curved surface lie beside each other and see little of each other.
        let points = sample_points(close, is_beside && !curved);
        let mut samples = [(centroid, 1.0); 7];
        for (sample, point) in samples.iter_mut().zip(points) {
            *sample = place(point);
        }
        let before = before(&samples[..points.len()], clear());
        if close && seen.note(whole, &before, factors) <= least {
            return;
        }
        self.parts(seen, &before, factors, found);
    }

    /// Adds a pair with its parts.
    fn parts(&self, seen: &Seen, before: &Before, factors: &mut [f64], found: &mut OfSource) {
        let (elements, e) = (self.elements, before.element);
        let first = found.entries.len();
        let OfSource { entries, rays, .. } = found;
        let cut = |_: Part, _: f64| false;
        self.seen_parts(seen, before, factors, rays, cut, |part, factor| {
            let factor = match elements.is_meso(e) {
                true => self.by_direction(seen, before, part, factor),
                false => Vec3::new(0.0, 0.0, factor as f32),
            };
            let part = part.index as u32;
            entries.push(NearPart { factor, part });
        });
        let entries = &mut found.entries[first..];
        let whole: DVec3 = entries.iter().map(|entry| entry.factor.as_dvec3()).sum();
        let size = as_kept(whole.length() as f32);
        let factor = match elements.is_meso(e) && size > 0.0 {
            true => size * kept_direction(direction_code(whole.normalize().as_vec3())),
            false => Vec3::new(0.0, 0.0, size),
        };
        // The parts sum to what is kept of the whole, so that no light is made of the difference.
        let scale = match size > 0.0 {
            true => f64::from(size) / whole.length(),
            false => 0.0,
        };
        for entry in entries.iter_mut() {
            entry.factor = (entry.factor.as_dvec3() * scale).as_vec3();
        }
        // A source of one member sends what that sends, and relief sends by direction.
        if seen.triangles.len() == 1 || elements.is_meso(seen.tree.members[0] as usize) {
            found.entries.truncate(first);
        }
        found.pairs.push(Pair {
            element: e as u32,
            factor,
            entries: (found.entries.len() - first) as u32,
        });
    }

    /// Each part that a receiver sees any of, with its form factor. `cut` says whether a part is
    /// too uneven to count as one, by what its form factor would be.
    fn seen_parts(
        &self,
        seen: &Seen,
        before: &Before,
        factors: &mut [f64],
        rays: &mut u64,
        cut: impl Fn(Part, f64) -> bool,
        mut each: impl FnMut(Part, f64),
    ) {
        let mut stack = vec![seen.tree.whole()];
        while let Some(part) = stack.pop() {
            let all = match factors[part.index].is_nan() {
                true => seen.note(part, before, factors),
                false => factors[part.index],
            };
            if all <= 0.0 {
                continue;
            }
            if part.count > 1 && (all > self.nearness.part || cut(part, all)) {
                stack.extend(part.halves());
                continue;
            }
            let factor = self.seen_factor(seen, before, part, factors, rays);
            if factor > 0.0 {
                match self.scattered {
                    true => shares(seen, before, part, factor, LEVELS, factors, &mut each),
                    false => each(part, factor),
                }
            }
        }
    }

    /// What a place sees of a source: each part with its form factor. `factors` is room, `[part]`;
    /// `cut` as in [`Self::seen_parts`].
    pub fn seen_from(
        &self,
        place: DVec3,
        normal: DVec3,
        seen: &Seen,
        factors: &mut [f64],
        cut: impl Fn(Part, f64) -> bool,
        each: impl FnMut(Part, f64),
    ) {
        let before = Before {
            element: usize::MAX,
            normal,
            samples: &[(place, 1.0)],
            clear: false,
        };
        seen.note(seen.tree.whole(), &before, factors);
        self.seen_parts(seen, &before, factors, &mut 0, cut, each);
    }

    /// A form factor to a part as a vector in the frame of an element with relief.
    fn by_direction(&self, seen: &Seen, before: &Before, part: Part, factor: f64) -> Vec3 {
        let (e, n) = (before.element, before.normal);
        let Some(relief) = &self.elements.relief else {
            return Vec3::new(0.0, 0.0, factor as f32);
        };
        let sum = seen.vector(part, self.elements.centroid[e], n);
        let height = sum.dot(n);
        // Other places of the element see what its centroid does not.
        let vector = match height > LEAST_HEIGHT * sum.length() {
            true => sum * (factor / height),
            false => n * factor,
        };
        let along = |axis: Vec3| axis.as_dvec3().dot(vector);
        let (x, y) = (along(relief.tangent[e]), along(relief.bitangent[e]));
        DVec3::new(x, y, factor).as_vec3()
    }

    /// Form factor to a part with visibility, as a mean over the samples.
    fn seen_factor(
        &self,
        seen: &Seen,
        before: &Before,
        part: Part,
        factors: &mut [f64],
        rays: &mut u64,
    ) -> f64 {
        if before.clear {
            return factors[part.index];
        }
        // A ray to the member that half of the part's form factor lies before, or another share.
        let turn = seen.tree.members[part.first] as usize;
        let share = match self.scattered {
            true => (GOLDEN * (turn as f64 + 0.5)).fract(),
            false => 0.5,
        };
        let member = seen.member_at(share, part, before, factors);
        let (triangle, centroid) = (&seen.triangles[member], seen.centroid(member));
        let n = before.normal;
        let open = |&(p, weight): &(DVec3, f64)| {
            let factor = match before.samples.len() {
                1 => factors[part.index],
                _ => seen.factor(part, p, n),
            };
            if part.count == 1 {
                let place = match self.scattered {
                    true => spread_in_triangle(turn),
                    false => [1.0 / 3.0; 2],
                };
                return weight * self.open_share(p, n, triangle, place, factor, CUTS, rays);
            }
            if factor <= 0.0 {
                return 0.0;
            }
            *rays += 1;
            match blocked(self.occluders, p, centroid) {
                true => 0.0,
                false => weight * factor,
            }
        };
        before.samples.iter().map(open).sum()
    }

    /// What a place sees of a triangle whose whole form factor is this: that of the quarters of
    /// which it sees a place, the same in each.
    #[allow(clippy::too_many_arguments)] // all of a recursion
    fn open_share(
        &self,
        p: DVec3,
        n: DVec3,
        triangle: &[DVec3; 3],
        place: [f64; 2],
        factor: f64,
        cuts: u32,
        rays: &mut u64,
    ) -> f64 {
        if factor <= 0.0 {
            return 0.0;
        }
        let [a, b, c] = *triangle;
        if cuts == 0 || factor <= self.nearness.part {
            *rays += 1;
            let [u, v] = place;
            return match blocked(self.occluders, p, a + u * (b - a) + v * (c - a)) {
                true => 0.0,
                false => factor,
            };
        }
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            .iter()
            .map(|quarter| {
                let factor = to_triangle(p, n, quarter).max(0.0);
                self.open_share(p, n, quarter, place, factor, cuts - 1, rays)
            })
            .sum()
    }
}

/// Gives the parts of a part, some levels down, their shares of its form factor.
fn shares(
    seen: &Seen,
    before: &Before,
    part: Part,
    factor: f64,
    levels: u32,
    factors: &mut [f64],
    each: &mut impl FnMut(Part, f64),
) {
    if levels == 0 || part.count == 1 {
        each(part, factor);
        return;
    }
    let halves = part.halves();
    let of = halves.map(|half| {
        if factors[half.index].is_nan() {
            seen.note(half, before, factors);
        }
        factors[half.index]
    });
    let sum = of[0] + of[1];
    if sum <= 0.0 {
        each(part, factor);
        return;
    }
    for (half, of) in halves.into_iter().zip(of) {
        if of > 0.0 {
            shares(
                seen,
                before,
                half,
                factor * of / sum,
                levels - 1,
                factors,
                each,
            );
        }
    }
}

/// Levels down a part of which its form factor is shared out: near members count for more.
const LEVELS: u32 = 2;

/// Sine of the lowest light that a part's direction is taken from.
const LEAST_HEIGHT: f64 = 1e-3;
