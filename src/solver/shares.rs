//! Who finds what: the elements of a scene in parcels, and the members' shares of these.
//!
//! A parcel ends where a source does, so that what the members of a source receive is summed by one
//! member of a team. Sums over all elements are taken parcel by parcel, and these added up in
//! order: they do not depend on who has which.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use crate::passes::fresh_rows::{RowShape, Span};

/// Parcels of the elements of one kind, about.
const PARCELS: u32 = 256;

/// The elements of a scene, `[parcel]`; those with a relief last.
pub(super) struct Parcels {
    list: Vec<Range<u32>>,
    /// Elements of each source; none of a light.
    sources: Vec<Range<u32>>,
    /// How many are without a relief.
    plain: usize,
    whole: RowShape,
}

/// What one member of a team finds.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Share {
    pub shape: RowShape,
    /// Its parcels, as first element and number of elements, without and then with a relief.
    pub parcels: Vec<[u32; 2]>,
    /// Which they are of all.
    pub numbers: [Range<usize>; 2],
    /// Sources whose elements are its own.
    pub sources: Vec<u32>,
}

impl Parcels {
    /// Of the elements of a row, and those of each source.
    pub fn new(sources: impl Iterator<Item = Range<usize>>, whole: RowShape) -> Self {
        let narrow = |range: Range<usize>| range.start as u32..range.end as u32;
        let sources: Vec<Range<u32>> = sources.map(narrow).collect();
        let mut ranges = sources.clone();
        ranges.retain(|range| !range.is_empty());
        ranges.sort_unstable_by_key(|range| range.start);
        let end_from = |at: u32| {
            let before = ranges.partition_point(|range| range.start < at);
            let last = before.checked_sub(1).map(|i| ranges[i].end);
            last.map_or(at, |end| end.max(at))
        };
        let mut list = Vec::new();
        let mut plain = 0;
        for span in [whole.plain, whole.meso] {
            let (mut at, end) = (span.first, span.first + span.count);
            let step = span.count.div_ceil(PARCELS).max(1);
            while at < end {
                let next = end_from((at + step).min(end)).min(end);
                list.push(at..next);
                at = next;
            }
            if span == whole.plain {
                plain = list.len();
            }
        }
        Self {
            list,
            sources,
            plain,
            whole,
        }
    }

    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// A share for each of these weights: so much of the elements of each kind, but for whole
    /// parcels.
    pub fn shares(&self, weights: &[f64]) -> Vec<Share> {
        let all: f64 = weights.iter().sum();
        let members = weights.len();
        let kinds = [
            (self.whole.plain, 0..self.plain),
            (self.whole.meso, self.plain..self.list.len()),
        ];
        let share = |m: usize| {
            let cut = |(span, numbers): &(Span, Range<usize>)| {
                let border = |m: usize| {
                    let before: f64 = weights[..m].iter().sum();
                    let at = span.first + (f64::from(span.count) * before / all) as u32;
                    let of_kind = &self.list[numbers.clone()];
                    numbers.start + of_kind.partition_point(|parcel| parcel.end <= at)
                };
                let border = |m| if m == members { numbers.end } else { border(m) };
                border(m)..border(m + 1)
            };
            let numbers = kinds.each_ref().map(cut);
            let span = |kind: usize| {
                let whole = kinds[kind].0;
                let of_kind = &self.list[numbers[kind].clone()];
                let own = match of_kind {
                    [] => whole.first..whole.first,
                    [first, ..] => first.start..of_kind[of_kind.len() - 1].end,
                };
                Span::about(whole.first..whole.first + whole.count, own)
            };
            let all = numbers
                .iter()
                .flat_map(|numbers| &self.list[numbers.clone()]);
            let shape = RowShape {
                plain: span(0),
                meso: span(1),
            };
            let is_own = |of: &Range<u32>| !of.is_empty() && shape.has(of.start);
            let sources = (0..).zip(&self.sources).filter(|(_, of)| is_own(of));
            Share {
                shape,
                sources: sources.map(|(s, _)| s).collect(),
                parcels: all.map(|of| [of.start, of.end - of.start]).collect(),
                numbers,
            }
        };
        (0..members).map(share).collect()
    }
}

impl Share {
    /// Its elements, without and with a relief.
    pub fn elements(&self) -> [Range<usize>; 2] {
        let RowShape { plain, meso } = self.shape;
        [plain, meso].map(|span| {
            let own = span.own_range();
            own.start as usize..own.end as usize
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::GROUP;

    /// Sources of 1 to 40 elements, with a gap of elements without one between some.
    fn sources(elements: usize) -> Vec<Range<usize>> {
        let mut list = Vec::new();
        let (mut at, mut count) = (0, 7);
        while at + count < elements {
            list.push(at..at + count);
            at += count + usize::from(count % 3 == 0);
            count = count * 17 % 41;
        }
        list
    }

    #[test]
    fn every_element_is_of_one_share_and_no_source_of_two() {
        for (elements, meso) in [(5000, 0), (5000, 1800), (300, 300), (90, 5)] {
            let plain = elements - meso;
            let mut list = sources(plain as usize);
            let of_relief = sources(meso as usize).into_iter();
            let shift = plain as usize;
            list.extend(of_relief.map(|range| range.start + shift..range.end + shift));
            let whole = RowShape::whole(elements, meso);
            let parcels = Parcels::new(list.iter().cloned(), whole);
            assert!(parcels.list.iter().map(|p| p.len()).sum::<usize>() == elements as usize);
            for members in 1..6 {
                let weights: Vec<f64> = (0..members).map(|m| 1.0 + 0.3 * m as f64).collect();
                let shares = parcels.shares(&weights);
                for e in 0..elements {
                    let of = shares.iter().filter(|share| share.shape.has(e)).count();
                    assert_eq!(of, 1, "element {e} of {elements}, {members} members");
                }
                for source in &list {
                    let owner =
                        |e: usize| shares.iter().position(|share| share.shape.has(e as u32));
                    let of_first = owner(source.start);
                    let is_whole = source.clone().all(|e| owner(e) == of_first);
                    assert!(is_whole, "source {source:?}, {members} members");
                }
                for share in &shares {
                    let [without, with] = [share.shape.plain, share.shape.meso];
                    assert_eq!(without.first % GROUP, 0);
                    assert_eq!((with.first - plain) % GROUP, 0);
                    let end = without.first + without.count;
                    assert!(without.count % GROUP == 0 || end == plain);
                    let counted: u32 = share.parcels.iter().map(|p| p[1]).sum();
                    let owned: usize = share.elements().iter().map(|range| range.len()).sum();
                    assert_eq!(counted as usize, owned);
                }
            }
        }
    }
}
