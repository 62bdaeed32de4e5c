//! The order of groups: neighbours a few hundred at a time, and these far apart.
//!
//! Elements lie in the order of their groups, and members of a team find those that follow one
//! another (`solver/shares.rs`). What a source sees lies together. So that each member has a part
//! of whatever that is, the scene is cut into chunks of neighbours, and the chunks are ordered by
//! their numbers with the bits reversed: any half of all has every other one, any quarter every
//! fourth.

use std::ops::Range;

use super::cut::Groups;
use crate::constants::GROUP;

/// Elements of a chunk, at least: few blocks of GROUP elements lie in two.
const CHUNK: usize = 25 * GROUP as usize;

/// Reorders the groups, those of each kind by themselves; `is_last`: whether the element that
/// stands at a place of the order is of the last kind.
pub(super) fn scatter(groups: &mut Groups, is_last: impl Fn(usize) -> bool) {
    let of_last = groups.ranges.partition_point(|range| !is_last(range.start));
    let (plain, last) = groups.ranges.split_at(of_last);
    let mut ranges = Vec::with_capacity(groups.ranges.len());
    let mut order = Vec::with_capacity(groups.order.len());
    let mut chart = Vec::with_capacity(groups.chart.len());
    for kind in [plain, last] {
        for range in chunks(kind).into_iter().flatten() {
            let first = order.len();
            order.extend_from_slice(&groups.order[range.clone()]);
            chart.extend_from_slice(&groups.chart[range.clone()]);
            ranges.push(first..order.len());
        }
    }
    assert_eq!(
        order.len(),
        groups.order.len(),
        "every element is in a group"
    );
    (groups.ranges, groups.order, groups.chart) = (ranges, order, chart);
}

/// The ranges in chunks, in their order.
fn chunks(ranges: &[Range<usize>]) -> Vec<Vec<Range<usize>>> {
    let mut chunks: Vec<Vec<Range<usize>>> = Vec::new();
    let mut elements = CHUNK;
    for range in ranges {
        if elements >= CHUNK {
            chunks.push(Vec::new());
            elements = 0;
        }
        elements += range.len();
        chunks
            .last_mut()
            .expect("one was begun")
            .push(range.clone());
    }
    let bits = chunks.len().next_power_of_two().trailing_zeros();
    let reversed = |i: usize| {
        i.reverse_bits()
            .checked_shr(usize::BITS - bits)
            .unwrap_or(0)
    };
    let mut numbered: Vec<_> = chunks.into_iter().enumerate().collect();
    numbered.sort_by_key(|(i, _)| reversed(*i));
    numbered.into_iter().map(|(_, chunk)| chunk).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_have_every_other_chunk() {
        let ranges: Vec<_> = (0..800).map(|i| 20 * i..20 * (i + 1)).collect();
        let chunks = chunks(&ranges);
        assert_eq!(chunks.len(), 10);
        let number = |chunk: &Vec<Range<usize>>| chunk[0].start / CHUNK;
        let order: Vec<usize> = chunks.iter().map(number).collect();
        assert_eq!(order, [0, 8, 4, 2, 6, 1, 9, 5, 3, 7]);
        let mut all: Vec<_> = chunks
            .into_iter()
            .flatten()
            .map(|range| range.start)
            .collect();
        all.sort_unstable();
        assert!(
            all.into_iter()
                .eq(ranges.into_iter().map(|range| range.start))
        );
    }
}
