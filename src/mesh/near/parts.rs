//! The members of a source as a tree of parts.

use crate::math::form_factor::spread_in_triangle;
use crate::mesh::elements::Elements;
use crate::mesh::sources::{Source, SourcePlace};

/// A binary tree over the members of a source, in depth-first order: part 0 is the whole source. A
/// part of `count` members from `first` on has the first half of them as its next part, and the
/// others as part 2·⌊count/2⌋ after it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PartTree {
    /// Elements, so that those of each part are consecutive.
    pub members: Vec<u32>,
}

/// Golden ratio's fraction, whose multiples spread evenly.
pub(super) const GOLDEN: f64 = 0.618_033_988_749_895;

/// A part while the tree is walked.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    pub index: usize,
    pub first: usize,
    pub count: usize,
}

impl Part {
    /// The two halves of a part of several members.
    pub fn halves(self) -> [Self; 2] {
        let half = self.count / 2;
        let [one, other] = [
            (1, self.first, half),
            (2 * half, self.first + half, self.count - half),
        ];
        [one, other].map(|(after, first, count)| Self {
            index: self.index + after,
            first,
            count,
        })
    }
}

impl PartTree {
    pub fn of(elements: &Elements, source: &Source) -> Self {
        let mut members: Vec<u32> = source.members().map(|e| e as u32).collect();
        halve(elements, &mut members);
        Self { members }
    }

    pub fn whole(&self) -> Part {
        Part {
            index: 0,
            first: 0,
            count: self.members.len(),
        }
    }

    /// Places on a source, evenly by area; its eye if it has no members. `turn` is another for each
    /// source: an edge that lies alike across several would else be off alike in all.
    pub fn places(
        &self,
        elements: &Elements,
        source: &Source,
        count: usize,
        turn: usize,
    ) -> Vec<SourcePlace> {
        if self.members.is_empty() {
            let (at, normal) = (source.eye, source.normal);
            return vec![SourcePlace { at, normal }; count];
        }
        let triangle = |m: u32| match source.contour.first().map(Vec::as_slice) {
            // An element that is cut into several sources.
            Some(&[a, b, c]) if self.members.len() == 1 => [a, b, c],
            _ => elements.triangle(m as usize),
        };
        let area = |m: u32| elements.area[m as usize];
        let all: f64 = self.members.iter().map(|&m| area(m)).sum();
        let mut places = Vec::with_capacity(count);
        let mut before = 0.0;
        let mut m = 0;
        let shift = (GOLDEN * turn as f64 + 0.5).fract();
        // So that a few of the places, evenly chosen, lie evenly too.
        let turned = |k: usize| match count.is_power_of_two() {
            true => k.reverse_bits() >> (usize::BITS - count.ilog2()).min(usize::BITS - 1),
            false => k,
        };
        for k in 0..count {
            // Members follow one another along the tree, so that equal steps of area spread out.
            let at = all * (k as f64 + shift) / count as f64;
            while m + 1 < self.members.len() && before + area(self.members[m]) < at {
                before += area(self.members[m]);
                m += 1;
            }
            let [a, b, c] = triangle(self.members[m]);
            let [u, v] = spread_in_triangle(turn * count + turned(k));
            places.push(SourcePlace {
                at: a + u * (b - a) + v * (c - a),
                normal: elements.normal[self.members[m] as usize],
            });
        }
        places
    }

    /// Parts of all sizes.
    pub fn part_count(&self) -> usize {
        (2 * self.members.len()).saturating_sub(1)
    }

    /// Sums of a value of the members over each part, `[part]`.
    pub fn sums<T>(&self, of: impl Fn(u32) -> T) -> Vec<T>
    where
        T: Copy + Default + std::ops::Add<Output = T>,
    {
        let mut sums = vec![T::default(); self.part_count()];
        if !self.members.is_empty() {
            self.sum(self.whole(), &of, &mut sums);
        }
        sums
    }

    /// Gives each member the sum over the parts that hold it of `values` over `areas`, `[part]`.
    pub fn share_out(&self, values: &[f64], areas: &[f64], mut to: impl FnMut(u32, f64)) {
        let mut stack = vec![(self.whole(), 0.0)];
        while let Some((part, above)) = stack.pop() {
            let share = above + values[part.index] / areas[part.index];
            match part.count {
                0 => {}
                1 => to(self.members[part.first], share),
                _ => stack.extend(part.halves().map(|half| (half, share))),
            }
        }
    }

    fn sum<T>(&self, part: Part, of: &impl Fn(u32) -> T, sums: &mut [T]) -> T
    where
        T: Copy + std::ops::Add<Output = T>,
    {
        let sum = match part.count {
            1 => of(self.members[part.first]),
            _ => {
                let [one, other] = part.halves();
                self.sum(one, of, sums) + self.sum(other, of, sums)
            }
        };
        sums[part.index] = sum;
        sum
    }
}

/// Orders members so that the halves of each part lie on two sides of its longest extent.
fn halve(elements: &Elements, members: &mut [u32]) {
    if members.len() < 2 {
        return;
    }
    let centroid = |e: u32| elements.centroid[e as usize];
    let axis = elements.longest_axis(members);
    let half = members.len() / 2;
    members.select_nth_unstable_by(half, |&a, &b| {
        (centroid(a)[axis].total_cmp(&centroid(b)[axis])).then(a.cmp(&b))
    });
    let (one, other) = members.split_at_mut(half);
    halve(elements, one);
    halve(elements, other);
}
