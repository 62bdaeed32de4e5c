//! What one element receives of a near source, part by part.

use glam::DVec3;

use super::parts::{Part, PartTree};
use super::rays::blocked;
use super::{Entry, Nearness, OfSource};
use crate::math::form_factor::to_triangle;
use crate::math::kept::as_kept;
use crate::mesh::elements::Elements;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::structs::{NearFactor, ShadowOccluder};

/// Elements of a block, which is passed over as a whole where it lies far off.
const BLOCK: usize = 64;

/// An element this many of its radii from a member, or less, has several samples; at most one
/// radius off, more.
const CLOSE: f64 = 4.0;

/// Of the share of a view from which on a source is near: from which on a source is that the ball
/// about an element nearly touches, since a part of it may see what the source's eye does not.
const BESIDE: f64 = 0.1;

/// A member further off than this many of its radii, and as high above the receiver's horizon,
/// counts as a disc seen along its axis: off by less than 1 %.
const AS_DISC: f64 = 5.0;

/// Height above a member's plane from which on a place sees its front, internal units.
const ABOVE: f64 = 1e-7;

/// Times that a single member is cut in four for its visibility.
const CUTS: u32 = 3;

/// Elements as receivers: a ball about the centroids of consecutive ones.
pub(super) struct Receiver {
    elements: std::ops::Range<usize>,
    centre: DVec3,
    radius: f64,
    /// Radius of an element.
    largest: f64,
}

impl Receiver {
    /// Blocks of all elements without relief.
    pub fn all(elements: &Elements) -> Vec<Self> {
        let plain = (0..elements.len()).position(|e| elements.is_meso(e));
        let end = plain.unwrap_or(elements.len());
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
                let radii = of.clone().map(|e| elements.radius(e));
                Self {
                    largest: radii.fold(0.0, f64::max),
                    elements: of,
                    centre,
                    radius: distances.map(|c| c.distance(centre)).fold(0.0, f64::max),
                }
            })
            .collect()
    }
}

/// A scene in which elements look at sources.
pub(super) struct Sight<'a> {
    pub elements: &'a Elements,
    pub occluders: &'a ShadowTree<ShadowOccluder>,
    pub nearness: Nearness,
}

/// A source as its near receivers see it.
struct Seen {
    /// Of the ball that holds the source.
    middle: DVec3,
    radius: f64,
    tree: PartTree,
    members: Vec<Member>,
}

struct Member {
    triangle: [DVec3; 3],
    centroid: DVec3,
    normal: DVec3,
    area: f64,
    radius: f64,
}

impl Member {
    fn new(triangle: [DVec3; 3], normal: DVec3) -> Self {
        let [a, b, c] = triangle;
        let centroid = (a + b + c) / 3.0;
        Self {
            triangle,
            centroid,
            normal,
            area: 0.5 * (b - a).cross(c - a).length(),
            radius: triangle
                .map(|v| v.distance(centroid))
                .into_iter()
                .fold(0.0, f64::max),
        }
    }

    /// Form factor from a place, as if nothing stood between.
    fn form_factor(&self, p: DVec3, n: DVec3) -> f64 {
        let way = self.centroid - p;
        let facing = -way.dot(self.normal);
        let height = way.dot(n);
        if facing <= ABOVE || height <= -self.radius {
            return 0.0;
        }
        let square = way.length_squared();
        if height >= self.radius && square > AS_DISC * AS_DISC * self.radius * self.radius {
            let disc = std::f64::consts::PI * square + self.area;
            return facing * height * self.area / (square * disc);
        }
        to_triangle(p, n, &self.triangle).max(0.0)
    }
}

/// A sample of a receiver: place and weight.
type Sample = (DVec3, f64);

impl Sight<'_> {
    pub fn source(&self, source: &Source, receivers: &[Receiver]) -> OfSource {
        let first = source.first_element;
        let tree = PartTree::new(self.elements, first..first + source.element_count);
        // An element that is cut into several sources.
        let cut = source.element_count == 1;
        let member = |&e: &u32| {
            let own = self.elements.triangle(e as usize);
            let triangle = match source.contour.first().map(Vec::as_slice) {
                Some(&[a, b, c]) if cut => [a, b, c],
                _ => own,
            };
            Member::new(triangle, self.elements.normal[e as usize])
        };
        let seen = Seen {
            middle: source.centroid,
            radius: source.radius,
            members: tree.members.iter().map(member).collect(),
            tree,
        };
        let mut found = OfSource::default();
        let mut factors = vec![0.0; seen.members.len()];
        let mut sums = vec![0.0; seen.tree.part_count()];
        // Where it is seen under that share of a view at most, however it is turned.
        let reach =
            (source.area / (std::f64::consts::PI * self.nearness.source)).sqrt() + source.radius;
        for block in receivers {
            let beside = source.radius + CLOSE * block.largest;
            if block.centre.distance(source.centroid) > reach.max(beside) + block.radius {
                continue;
            }
            for e in block.elements.clone() {
                if self.may_be_near(e, source) {
                    self.pair(e, &seen, &mut factors, &mut sums, &mut found);
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
            false => 1.0,
        };
        let most = cosine.min(1.0) * facing.min(1.0) * source.area;
        most > self.nearness.source * std::f64::consts::PI * gap * gap
    }

    fn pair(
        &self,
        e: usize,
        seen: &Seen,
        factors: &mut [f64],
        sums: &mut [f64],
        found: &mut OfSource,
    ) {
        let (elements, n) = (self.elements, self.elements.normal[e]);
        let centroid = elements.centroid[e];
        let own = |m: usize| seen.tree.members[m] as usize == e;
        let mut all = 0.0;
        let mut nearest = f64::INFINITY;
        for (m, (member, factor)) in seen.members.iter().zip(factors.iter_mut()).enumerate() {
            *factor = match own(m) {
                true => 0.0,
                false => member.form_factor(centroid, n),
            };
            all += *factor;
            if !own(m) {
                nearest = nearest.min(member.centroid.distance(centroid) - member.radius);
            }
        }
        let size = elements.radius(e);
        let close = nearest <= CLOSE * size;
        let gap = centroid.distance(seen.middle) - seen.radius;
        let least = match gap <= CLOSE * size {
            true => BESIDE * self.nearness.source,
            false => self.nearness.source,
        };
        // The centroid of a close element may see less than its other parts.
        if all <= least * if close { 0.5 } else { 1.0 } {
            return;
        }
        let [a, b, c] = elements.triangle(e);
        let points: &[[f64; 3]] = match close {
            false => &POINTS[..1],
            true if nearest > size => &POINTS[1..4],
            true => &POINTS[4..],
        };
        let place = |&[u, v, weight]: &[f64; 3]| (a + u * (b - a) + v * (c - a), weight);
        let mut samples = [(DVec3::ZERO, 0.0); 7];
        for (sample, point) in samples.iter_mut().zip(points) {
            *sample = place(point);
        }
        let samples = &samples[..points.len()];
        if close {
            for (m, (member, factor)) in seen.members.iter().zip(factors.iter_mut()).enumerate() {
                let of = |&(p, weight): &Sample| weight * member.form_factor(p, n);
                *factor = match own(m) {
                    true => 0.0,
                    false => samples.iter().map(of).sum(),
                };
            }
        }
        let whole = seen.tree.whole();
        sum_parts(whole, factors, sums);
        if sums[0] <= least {
            return;
        }
        let first = found.entries.len();
        let mut stack = vec![whole];
        while let Some(part) = stack.pop() {
            let all = sums[part.index];
            if all <= 0.0 {
                continue;
            }
            if all > self.nearness.part && part.count > 1 {
                stack.extend(part.halves());
                continue;
            }
            let factor = self.seen_factor(n, samples, seen, factors, part, &mut found.rays);
            if factor > 0.0 {
                found.entries.push(Entry {
                    part: part.index as u32,
                    factor: factor as f32,
                });
            }
        }
        let entries = &mut found.entries[first..];
        let whole: f64 = entries.iter().map(|entry| f64::from(entry.factor)).sum();
        let kept = as_kept(whole as f32);
        // The parts sum to what is kept of the whole, so that no light is made of the difference.
        let scale = if whole > 0.0 {
            f64::from(kept) / whole
        } else {
            0.0
        };
        for entry in entries.iter_mut() {
            entry.factor = (f64::from(entry.factor) * scale) as f32;
        }
        found.factors.push(NearFactor {
            element: e as u32,
            factor: kept,
        });
        // A source of one member sends what that sends, and relief sends by direction.
        let mut count = found.entries.len() - first;
        if seen.members.len() == 1 || elements.is_meso(seen.tree.members[0] as usize) {
            found.entries.truncate(first);
            count = 0;
        }
        found.counts.push(count as u32);
    }

    /// Form factor to a part with visibility, as a mean over the samples.
    fn seen_factor(
        &self,
        n: DVec3,
        samples: &[Sample],
        seen: &Seen,
        factors: &[f64],
        part: Part,
        rays: &mut u64,
    ) -> f64 {
        let range = part.first..part.first + part.count;
        if part.count == 1 {
            let member = &seen.members[part.first];
            let open = |&(p, weight): &Sample| {
                let factor = match samples.len() {
                    1 => factors[part.first],
                    _ => member.form_factor(p, n),
                };
                weight * self.open_share(p, n, &member.triangle, factor, CUTS, rays)
            };
            return samples.iter().map(open).sum();
        }
        // A ray to the member that half of the part's form factor lies before.
        let all: f64 = factors[range.clone()].iter().sum();
        let mut before = 0.0;
        let middle = range.clone().find(|&m| {
            before += factors[m];
            before >= 0.5 * all
        });
        let member = &seen.members[middle.unwrap_or(range.start)];
        if let [(p, _)] = samples {
            *rays += 1;
            return if blocked(self.occluders, *p, member.centroid) {
                0.0
            } else {
                all
            };
        }
        let open = |&(p, weight): &Sample| {
            let of_members = seen.members[range.clone()].iter();
            let factor: f64 = of_members.map(|m| m.form_factor(p, n)).sum();
            if factor <= 0.0 {
                return 0.0;
            }
            *rays += 1;
            if blocked(self.occluders, p, member.centroid) {
                0.0
            } else {
                weight * factor
            }
        };
        samples.iter().map(open).sum()
    }

    /// What a place sees of a triangle whose whole form factor is this: that of the quarters whose
    /// middles it sees.
    fn open_share(
        &self,
        p: DVec3,
        n: DVec3,
        triangle: &[DVec3; 3],
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
            let middle = (a + b + c) / 3.0;
            return if blocked(self.occluders, p, middle) {
                0.0
            } else {
                factor
            };
        }
        let [ab, bc, ca] = [0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a)];
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            .iter()
            .map(|quarter| {
                let factor = to_triangle(p, n, quarter).max(0.0);
                self.open_share(p, n, quarter, factor, cuts - 1, rays)
            })
            .sum()
    }
}

fn sum_parts(part: Part, factors: &[f64], sums: &mut [f64]) -> f64 {
    let sum = match part.count {
        1 => factors[part.first],
        _ => {
            let [one, other] = part.halves();
            sum_parts(one, factors, sums) + sum_parts(other, factors, sums)
        }
    };
    sums[part.index] = sum;
    sum
}

/// Sample points of a triangle (two barycentric coordinates, weight): the centroid; degree 2;
/// Radon's degree 5.
const POINTS: [[f64; 3]; 11] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0],
    [1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 3.0],
    [1.0 / 3.0, 1.0 / 3.0, 0.225],
    [0.470142064, 0.470142064, 0.132394153],
    [0.059715872, 0.470142064, 0.132394153],
    [0.470142064, 0.059715872, 0.132394153],
    [0.101286507, 0.101286507, 0.125939181],
    [0.797426985, 0.101286507, 0.125939181],
    [0.101286507, 0.797426985, 0.125939181],
];
