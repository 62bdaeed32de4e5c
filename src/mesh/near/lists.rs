//! Near pairs as lists of words, to be kept in files.

use bytemuck::{Pod, cast_slice, pod_collect_to_vec};

use super::{Entries, NearPairs, PartTree, Rows};
use crate::constants::NONE;
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// Lists of a [`NearPairs`].
pub const LISTS: usize = 10;

impl NearPairs {
    /// Of the first sources, the `surfaces`; all but the trees, which follow from these.
    pub fn lists(&self, surfaces: usize) -> [Vec<u32>; LISTS] {
        let words = |list: &[u32]| list.to_vec();
        [
            words(&self.first_part[..surfaces]),
            words(cast_slice(&self.weights)),
            words(cast_slice(&self.rows.factors)),
            words(&self.rows.starts[..=surfaces]),
            words(cast_slice(&self.entries.list)),
            words(&self.entries.starts),
            words(cast_slice(&self.relief_rows.factors)),
            words(&self.relief_rows.starts[..=surfaces]),
            words(cast_slice(&self.relief_entries.list)),
            words(&self.relief_entries.starts),
        ]
    }

    /// Those of [`Self::lists`], with the point lights after the surfaces; none if they cannot be
    /// of these elements and sources.
    pub fn from_lists(elements: &Elements, sources: &[Source], lists: &[Vec<u32>]) -> Option<Self> {
        let [
            first_part,
            weights,
            factors,
            starts,
            entries,
            entry_starts,
            relief_factors,
            relief_starts,
            relief_entries,
            relief_entry_starts,
        ] = lists
        else {
            return None;
        };
        let tree = |source: &Source| PartTree::of(elements, source);
        let trees: Vec<PartTree> = sources.iter().map(tree).collect();
        let mut parts = 0;
        for (tree, &first) in trees.iter().zip(first_part) {
            if first != NONE {
                if first != parts {
                    return None;
                }
                parts += tree.part_count() as u32 + 1;
            }
        }
        // Point lights are near no element.
        let all = |list: &[u32], none: u32, length: usize| -> Vec<u32> {
            let more = length.saturating_sub(list.len());
            list.iter().copied().chain(vec![none; more]).collect()
        };
        let starts_of_all = |starts: &[u32]| {
            let last = starts.last().copied().unwrap_or(0);
            all(starts, last, sources.len() + 1)
        };
        let near = Self {
            trees,
            first_part: all(first_part, NONE, sources.len()),
            parts,
            rows: Rows {
                factors: list(factors)?,
                starts: starts_of_all(starts),
            },
            entries: Entries {
                list: list(entries)?,
                starts: entry_starts.clone(),
            },
            relief_rows: Rows {
                factors: list(relief_factors)?,
                starts: starts_of_all(relief_starts),
            },
            relief_entries: Entries {
                list: list(relief_entries)?,
                starts: relief_entry_starts.clone(),
            },
            weights: list(weights)?,
            rays: 0,
        };
        near.fits(elements, sources.len()).then_some(near)
    }

    /// Whether every number is of an element, a part or a place that there is.
    fn fits(&self, elements: &Elements, sources: usize) -> bool {
        let plain = elements.plain_count();
        let relief = elements.len() - plain;
        let Self {
            rows,
            relief_rows,
            entries,
            relief_entries,
            ..
        } = self;
        self.first_part.len() == sources
            && self.weights.len() == elements.len()
            && are_starts(&rows.starts, sources, rows.factors.len())
            && are_starts(&relief_rows.starts, sources, relief_rows.factors.len())
            && are_starts(&entries.starts, plain, entries.list.len())
            && are_starts(&relief_entries.starts, relief, relief_entries.list.len())
            && (rows.factors.iter()).all(|of| (of.element as usize) < plain)
            && (relief_rows.factors.iter()).all(|of| (of.element as usize) < relief)
            && entries.list.iter().all(|of| of.part < self.parts)
            && relief_entries.list.iter().all(|of| of.part < self.parts)
    }
}

/// Words as what they are; none if they are no whole number of these.
fn list<T: Pod>(words: &[u32]) -> Option<Vec<T>> {
    let whole = size_of_val(words).is_multiple_of(size_of::<T>());
    whole.then(|| pod_collect_to_vec(words))
}

/// Whether these are where the lists of so many items begin, `length` long together.
fn are_starts(starts: &[u32], items: usize, length: usize) -> bool {
    starts.len() == items + 1
        && starts[0] == 0
        && starts.is_sorted()
        && starts[items] as usize == length
}
