//! Light from near sources, member by member.
//!
//! A source sends the mean radiosity of its members. A receiver beside it sees some of them larger
//! than others, and some not at all:
//! E_j = Σ_s F_js B_s + Σ_near F_jm (B_m − B_s(m)),
//! where the second sum is over the parts m of the sources that fill much of the view of element j.
//! The form factors here have their own visibility, by rays to each part.

mod emitters;
mod far;
mod lists;
mod pair;
mod parts;
mod places;
mod rays;
mod receivers;
mod seen;
mod sky_seen;
#[cfg(test)]
mod tests;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use crate::constants::NONE;
use crate::mesh::elements::Elements;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::structs::{NearFactor, NearPart, NearVector, ShadowOccluder};
use pair::Search;
pub use parts::{Part, PartTree};
pub use places::{Looking, Outlook, PART};
pub(super) use rays::{blocked, first_met};
use receivers::Receiver;

/// What counts as near.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Nearness {
    /// A source is near an element whose view it fills by more than this share.
    pub source: f64,
    /// A part of a source fills no more than this share of a view, unless it is one member.
    pub part: f64,
}

impl Nearness {
    /// No source is near any element.
    pub const NONE: Self = Self {
        source: 2.0,
        part: 2.0,
    };
}

impl Default for Nearness {
    fn default() -> Self {
        Self {
            source: 1.0 / 20.0,
            part: 1.0 / 48.0,
        }
    }
}

/// What an element without relief receives of a part of a source.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
pub struct Entry {
    /// Among the parts of all near sources.
    pub part: u32,
    /// Form factor from the element to the part, with visibility.
    pub factor: f32,
}

/// Form factors from elements to whole near sources, one source after another.
#[derive(Debug, Clone, Default)]
pub struct Rows<T> {
    pub factors: Vec<T>,
    /// Where each source's factors begin; one more than the sources.
    pub starts: Vec<u32>,
}

/// What elements receive of the parts of near sources, one element after another.
#[derive(Debug, Clone, Default)]
pub struct Entries<T> {
    pub list: Vec<T>,
    /// Where each element's begin; one more than the elements.
    pub starts: Vec<u32>,
}

/// The near sources of all elements.
#[derive(Debug, Clone, Default)]
pub struct NearPairs {
    pub trees: Vec<PartTree>,
    /// Number of the first part of each source among those of all near ones, the source itself as
    /// the last of its parts; NONE of a source that no element receives part by part.
    pub first_part: Vec<u32>,
    pub parts: u32,
    /// To elements without relief.
    pub rows: Rows<NearFactor>,
    pub entries: Entries<Entry>,
    /// To elements with a relief, numbered among themselves; form factors as vectors in the
    /// element's frame. What the source sends by its row is listed too, after its parts.
    pub relief_rows: Rows<NearVector>,
    pub relief_entries: Entries<NearPart>,
    /// Area of each element as it counts in the mean that its source sends, `[element]`: less what
    /// near elements see of it, which they receive part by part; together that of the source.
    pub weights: Vec<f64>,
    /// Rays that were followed.
    pub rays: u64,
}

/// An element and a near source.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Pair {
    pub element: u32,
    /// Form factor as a vector in the element's frame; without relief of its height alone.
    pub factor: Vec3,
    /// Parts that it receives.
    pub entries: u32,
}

/// The pairs of one source by element, and of each the parts, with numbers of the source's own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OfSource {
    pub tree: PartTree,
    pub pairs: Vec<Pair>,
    /// Of the pairs, one after another.
    pub entries: Vec<NearPart>,
    /// Rays that were followed.
    pub rays: u64,
}

impl OfSource {
    /// Each pair with its parts.
    fn each(&self) -> impl Iterator<Item = (&Pair, &[NearPart])> {
        let mut left = self.entries.as_slice();
        self.pairs.iter().map(move |pair| {
            let (parts, rest) = left.split_at(pair.entries as usize);
            left = rest;
            (pair, parts)
        })
    }
}

/// The pairs of each source, by rays among `occluders`.
pub fn pairs_of<'a>(
    elements: &Elements,
    sources: impl IntoParallelIterator<Item = &'a Source, Iter: IndexedParallelIterator>,
    occluders: &ShadowTree<ShadowOccluder>,
    nearness: &Nearness,
) -> Vec<OfSource> {
    let sources = sources.into_par_iter();
    if *nearness == Nearness::NONE {
        return sources.map(|_| OfSource::default()).collect();
    }
    let receivers = Receiver::all(elements);
    let search = Search {
        elements,
        occluders,
        nearness: *nearness,
        scattered: false,
    };
    sources
        .map(|source| match source.is_surface() {
            true => search.source(source, &receivers),
            false => OfSource::default(),
        })
        .collect()
}

impl NearPairs {
    /// Of the pairs that [`pairs_of`] all sources has found.
    pub fn new(elements: &Elements, sources: &[Source], found: Vec<OfSource>) -> Self {
        let weights = weights(elements, sources, &found);
        let near = Self::assembled(found, elements.plain_count(), elements.len());
        Self { weights, ..near }
    }

    /// Of sources that are near no element.
    pub fn none(elements: &Elements, sources: usize) -> Self {
        let none = (0..sources).map(|_| OfSource::default()).collect();
        let near = Self::assembled(none, elements.plain_count(), elements.len());
        Self {
            weights: elements.area.clone(),
            ..near
        }
    }

    /// Pairs of elements and near sources.
    pub fn pair_count(&self) -> usize {
        self.rows.factors.len() + self.relief_rows.factors.len()
    }

    /// Share of the power of each source that elements receive part by part, `[source]`.
    pub fn shares(&self, elements: &Elements, sources: &[Source]) -> Vec<f64> {
        let mut of_part = vec![0.0; self.parts as usize];
        let plain = elements.plain_count();
        for (e, area) in elements.area.iter().enumerate() {
            match e.checked_sub(plain) {
                None => (self.entries.of(e).iter())
                    .for_each(|of| of_part[of.part as usize] += area * f64::from(of.factor)),
                Some(meso) => (self.relief_entries.of(meso).iter())
                    .for_each(|of| of_part[of.part as usize] += area * f64::from(of.factor.z)),
            }
        }
        let share = |(s, &first): (usize, &u32)| {
            if first == NONE {
                return 0.0;
            }
            // The source itself is listed for relief after its parts.
            let first = first as usize;
            let parts = &of_part[first..first + self.trees[s].part_count()];
            (parts.iter().sum::<f64>() / sources[s].area).clamp(0.0, 1.0 - LEAST_FAR)
        };
        self.first_part.iter().enumerate().map(share).collect()
    }

    /// Parts that elements receive, over all elements.
    pub fn entry_count(&self) -> usize {
        self.entries.list.len() + self.relief_entries.list.len()
    }

    /// Of `elements`, the first `plain` of which have no relief.
    fn assembled(found: Vec<OfSource>, plain: usize, elements: usize) -> Self {
        let mut near = Self {
            rays: found.iter().map(|of| of.rays).sum(),
            ..Self::default()
        };
        for of in &found {
            let first = match of.entries.is_empty() {
                true => NONE,
                false => near.parts,
            };
            near.first_part.push(first);
            if first != NONE {
                near.parts += of.tree.part_count() as u32 + 1;
            }
            near.rows.begin();
            near.relief_rows.begin();
            for &Pair {
                element, factor, ..
            } in &of.pairs
            {
                match (element as usize).checked_sub(plain) {
                    None => near.rows.factors.push(NearFactor {
                        element,
                        factor: factor.z,
                    }),
                    Some(relief) => near.relief_rows.factors.push(NearVector {
                        element: relief as u32,
                        factor,
                    }),
                }
            }
        }
        near.rows.begin();
        near.relief_rows.begin();
        let first = &near.first_part;
        near.entries = Entries::new(&found, first, 0..plain, false, |of| Entry {
            part: of.part,
            factor: of.factor.z,
        });
        near.relief_entries = Entries::new(&found, first, plain..elements, true, |of| of);
        near.trees = found.into_iter().map(|of| of.tree).collect();
        near
    }
}

impl<T> Rows<T> {
    /// The factors of the next source begin here.
    fn begin(&mut self) {
        self.starts.push(self.factors.len() as u32);
    }

    /// Factors of one source.
    pub fn of(&self, source: usize) -> &[T] {
        &self.factors[self.starts[source] as usize..self.starts[source + 1] as usize]
    }

    /// Factors of one source, at most.
    pub fn longest(&self) -> u32 {
        let rows = self.starts.windows(2).map(|of| of[1] - of[0]);
        rows.max().unwrap_or(0)
    }
}

impl<T: Copy + Default> Entries<T> {
    /// Sorts the parts of `found` by element, source after source; after the parts of each pair
    /// what it receives of the whole source, where `whole` says so.
    fn new(
        found: &[OfSource],
        first_part: &[u32],
        elements: std::ops::Range<usize>,
        whole: bool,
        entry: impl Fn(NearPart) -> T,
    ) -> Self {
        let own = |pair: &Pair| (pair.element as usize).checked_sub(elements.start);
        let count = |pair: &Pair| match pair.entries {
            0 => 0,
            entries => entries + u32::from(whole),
        };
        // How many each element has, then where they begin.
        let mut starts = vec![0_u32; elements.len() + 1];
        for pair in found.iter().flat_map(|of| &of.pairs) {
            if let Some(at) = own(pair).and_then(|e| starts.get_mut(e + 1)) {
                *at += count(pair);
            }
        }
        for e in 0..elements.len() {
            starts[e + 1] += starts[e];
        }
        let mut next = starts[..elements.len()].to_vec();
        let mut list: Vec<T> = vec![T::default(); starts[elements.len()] as usize];
        for (of, first) in found.iter().zip(first_part) {
            for (pair, parts) in of.each() {
                let Some(at) = own(pair).and_then(|e| next.get_mut(e)) else {
                    continue;
                };
                let last = NearPart {
                    part: of.tree.part_count() as u32,
                    factor: pair.factor,
                };
                let entries = parts.iter().chain([&last]).take(count(pair) as usize);
                for of in entries {
                    list[*at as usize] = entry(NearPart {
                        part: first + of.part,
                        factor: of.factor,
                    });
                    *at += 1;
                }
            }
        }
        Self { list, starts }
    }

    /// Of an element.
    pub fn of(&self, element: usize) -> &[T] {
        &self.list[self.starts[element] as usize..self.starts[element + 1] as usize]
    }
}

/// Least share of an element's area that counts in the mean of its source.
const LEAST_FAR: f64 = 0.05;

/// See [`NearPairs::weights`].
fn weights(elements: &Elements, sources: &[Source], found: &[OfSource]) -> Vec<f64> {
    let mut weights = elements.area.clone();
    for (source, of) in sources.iter().zip(found) {
        if of.entries.is_empty() || elements.is_meso(source.first_element as usize) {
            continue;
        }
        // Area of each part that near elements see, by reciprocity.
        let mut near = vec![0.0; of.tree.part_count()];
        for (pair, parts) in of.each() {
            let area = elements.area[pair.element as usize];
            for of in parts {
                near[of.part as usize] += area * f64::from(of.factor.z);
            }
        }
        let areas = of.tree.sums(|e| elements.area[e as usize]);
        of.tree.share_out(&near, &areas, |e, share| {
            weights[e as usize] *= (1.0 - share).max(LEAST_FAR);
        });
        let members = || source.members();
        let all: f64 = members().map(|e| weights[e]).sum();
        members().for_each(|e| weights[e] *= areas[0] / all);
    }
    weights
}
