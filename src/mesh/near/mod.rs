//! Light from near sources, member by member.
//!
//! A source sends the mean radiosity of its members. A receiver beside it sees some of them larger
//! than others, and some not at all:
//! E_j = Σ_s F_js B_s + Σ_near F_jm (B_m − B_s(m)),
//! where the second sum is over the parts m of the sources that fill much of the view of element j.
//! The form factors here have their own visibility, by rays to each part.

mod pair;
mod parts;
mod rays;

use rayon::prelude::*;

use crate::constants::KIND_POINT;
use crate::mesh::elements::Elements;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::Source;
use crate::structs::{NearFactor, ShadowOccluder};
use pair::{Receiver, Sight};
pub use parts::PartTree;

/// What counts as near.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearness {
    /// A source is near an element whose view it fills by more than this share.
    pub source: f64,
    /// A part of a source fills no more than this share of a view, unless it is one member.
    pub part: f64,
}

impl Default for Nearness {
    fn default() -> Self {
        Self {
            source: 1.0 / 20.0,
            part: 1.0 / 48.0,
        }
    }
}

/// What an element receives of a part of a source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// See [`PartTree`].
    pub part: u32,
    /// Form factor from the element to the part, with visibility.
    pub factor: f32,
}

/// The near sources of all elements.
#[derive(Debug, Clone, Default)]
pub struct NearPairs {
    pub trees: Vec<PartTree>,
    /// Whole form factors from elements to near sources, one source after another.
    pub rows: Vec<NearFactor>,
    /// Where each source's factors begin; one more than the sources.
    pub row_starts: Vec<u32>,
    /// Pairs in the order of their elements: the source of each and where its entries begin.
    pub pairs: Vec<Pair>,
    pub entries: Vec<Entry>,
    /// Area of each element as it counts in the mean that its source sends, `[element]`: less what
    /// near elements see of it, which they receive part by part; together that of the source.
    pub weights: Vec<f64>,
    /// Rays that were followed.
    pub rays: u64,
}

/// An element and a near source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    pub element: u32,
    pub source: u32,
    pub first_entry: u32,
    pub entry_count: u32,
}

/// The pairs of one source.
#[derive(Default)]
struct OfSource {
    tree: PartTree,
    factors: Vec<NearFactor>,
    counts: Vec<u32>,
    entries: Vec<Entry>,
    rays: u64,
}

impl NearPairs {
    /// By rays among `occluders`. Elements with relief receive no source part by part.
    pub fn new(
        elements: &Elements,
        sources: &[Source],
        occluders: &ShadowTree<ShadowOccluder>,
        nearness: &Nearness,
    ) -> Self {
        let receivers = Receiver::all(elements);
        let sight = Sight {
            elements,
            occluders,
            nearness: *nearness,
        };
        let found: Vec<OfSource> = (sources.par_iter())
            .map(|source| match source.kind {
                KIND_POINT => OfSource::default(),
                _ => sight.source(source, &receivers),
            })
            .collect();
        let weights = weights(elements, sources, &found);
        let near = Self::assembled(found, elements.len());
        Self { weights, ..near }
    }

    /// Of sources that are near no element.
    pub fn none(elements: &Elements, sources: usize) -> Self {
        Self {
            trees: vec![PartTree::default(); sources],
            row_starts: vec![0; sources + 1],
            weights: elements.area.clone(),
            ..Self::default()
        }
    }

    /// Factors of one source, at most.
    pub fn longest_row(&self) -> u32 {
        let rows = self.row_starts.windows(2).map(|of| of[1] - of[0]);
        rows.max().unwrap_or(0)
    }

    fn assembled(found: Vec<OfSource>, elements: usize) -> Self {
        let mut near = Self::default();
        // Pairs by element: how many each has, and then where they begin.
        let mut counts = vec![0_u32; elements + 1];
        for of in &found {
            near.row_starts.push(near.rows.len() as u32);
            near.rows.extend(&of.factors);
            near.rays += of.rays;
            of.factors
                .iter()
                .for_each(|f| counts[f.element as usize + 1] += 1);
        }
        near.row_starts.push(near.rows.len() as u32);
        for e in 0..elements {
            counts[e + 1] += counts[e];
        }
        let mut order = vec![[0_u32; 2]; near.rows.len()];
        let mut firsts = Vec::with_capacity(found.len());
        for (s, of) in (0..).zip(&found) {
            let mut first = 0;
            let mut starts = Vec::with_capacity(of.factors.len());
            for (i, factor) in (0..).zip(&of.factors) {
                let at = &mut counts[factor.element as usize];
                order[*at as usize] = [s, i];
                *at += 1;
                starts.push(first);
                first += of.counts[i as usize];
            }
            firsts.push(starts);
        }
        for [s, i] in order {
            let of = &found[s as usize];
            let count = of.counts[i as usize];
            if count == 0 {
                continue;
            }
            let first = firsts[s as usize][i as usize] as usize;
            near.pairs.push(Pair {
                element: of.factors[i as usize].element,
                source: s,
                first_entry: near.entries.len() as u32,
                entry_count: count,
            });
            near.entries
                .extend(&of.entries[first..first + count as usize]);
        }
        near.trees = found.into_iter().map(|of| of.tree).collect();
        near
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
        let mut entries = of.entries.iter();
        for (factor, &count) in of.factors.iter().zip(&of.counts) {
            let area = elements.area[factor.element as usize];
            for entry in entries.by_ref().take(count as usize) {
                near[entry.part as usize] += area * f64::from(entry.factor);
            }
        }
        let areas = of.tree.sums(|e| elements.area[e as usize]);
        of.tree.share_out(&near, &areas, |e, share| {
            weights[e as usize] *= (1.0 - share).max(LEAST_FAR);
        });
        let members = || of.tree.members.iter().map(|&e| e as usize);
        let all: f64 = members().map(|e| weights[e]).sum();
        members().for_each(|e| weights[e] *= areas[0] / all);
    }
    weights
}
