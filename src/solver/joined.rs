//! Puts together what the members of a team have found, each of its share.

use std::sync::Arc;

use glam::Vec3;

use super::coupling::{CouplingRow, Targets};
use super::messages::MemberShare;
use super::rows::{Row, RowPart, scale_of};
use super::shares::{Parcels, Share};
use crate::mesh::sources::Source;
use crate::passes::types::{CouplingTarget, KeptRow};
use crate::passes::words::Words;

/// Who has what.
pub(super) struct Joined {
    /// `[member]`
    pub shares: Vec<Arc<Share>>,
    /// Where the words of each member's targets lie in a row of all: first word there, number of
    /// words, `[member][target]`.
    words: Vec<Vec<[usize; 2]>>,
    /// Of a row of all.
    word_count: usize,
    parcels: usize,
    /// Whether form factors are scaled so that all that is sent arrives.
    normalises: bool,
}

impl Joined {
    /// Shares of these weights, with the targets of each member.
    pub fn new(
        parcels: &Parcels,
        weights: &[f64],
        targets: &Targets,
        normalises: bool,
    ) -> (Self, Vec<MemberShare>) {
        let shares: Vec<Arc<Share>> = parcels.shares(weights).into_iter().map(Arc::new).collect();
        let of = |share: &Arc<Share>| targets_of(share, &targets.list);
        let (own, words): (Vec<_>, Vec<_>) = shares.iter().map(of).unzip();
        let member = |(share, targets): (&Arc<Share>, Vec<CouplingTarget>)| MemberShare {
            share: Share::clone(share),
            targets: Words::of(&targets),
            restored: None,
        };
        let members = shares.iter().zip(own).map(member).collect();
        let joined = Self {
            words,
            word_count: targets.words(),
            parcels: parcels.len(),
            normalises,
            shares,
        };
        (joined, members)
    }

    /// A row from the parts that all members have made of it, `[member]`; none if they are of
    /// several sources.
    pub fn row(&self, parts: &[RowPart], sources: &[Source]) -> Option<Row> {
        let source = parts[0].source;
        if parts.iter().any(|part| part.source != source) {
            return None;
        }
        let mut words = vec![0.0; self.word_count];
        let mut sums = vec![0.0; self.parcels];
        for ((part, places), share) in parts.iter().zip(&self.words).zip(&self.shares) {
            let counted: usize = places.iter().map(|[_, count]| count).sum();
            let of_part = part.coupling.words(counted);
            let mut of_part = &of_part[..];
            for &[first, count] in places {
                let (target, rest) = of_part.split_at(count);
                words[first..first + count].copy_from_slice(target);
                of_part = rest;
            }
            let numbers = share.numbers.iter().cloned().flatten();
            for (number, &sum) in numbers.zip(&part.sums) {
                sums[number] = f64::from(sum);
            }
        }
        let of = &sources[source as usize];
        let is_summed = of.is_surface() && parts.iter().any(|part| !part.sums.is_empty());
        let share = is_summed.then(|| sums.iter().sum::<f64>() / of.area);
        let scale = share.filter(|_| self.normalises).map_or(1.0, scale_of);
        let place = |part: &RowPart| {
            let [chunk, first] = part.place;
            KeptRow {
                chunk,
                first,
                scale,
            }
        };
        let has_room = parts.iter().all(|part| part.has_room);
        let mut counts = parts.iter().map(|part| &part.counts);
        Some(Row {
            source,
            scale,
            share: share.map(|share| share as f32),
            coupling: CouplingRow::new(&words, scale),
            places: has_room.then(|| parts.iter().map(place).collect()),
            // One member has drawn it.
            counts: counts
                .find(|of| !of.is_empty())
                .cloned()
                .unwrap_or_default(),
            facing_away: parts.iter().map(|part| part.facing_away).sum(),
            listed: std::array::from_fn(|list| parts.iter().map(|part| part.listed[list]).sum()),
        })
    }
}

/// Puts the light of a member's elements among that of all.
pub(super) fn put(all: &mut [Vec<Vec3>; 2], share: &Share, light: [Vec<Vec3>; 2]) {
    for (all, light) in all.iter_mut().zip(light) {
        let mut light = light.into_iter();
        for e in share.elements().into_iter().flatten() {
            all[e] = light.next().unwrap_or_default();
        }
    }
}

/// The targets of a member with words of their own, and where these lie in a row of all.
fn targets_of(share: &Share, all: &[CouplingTarget]) -> (Vec<CouplingTarget>, Vec<[usize; 2]>) {
    let mut own = Vec::new();
    let mut places = Vec::new();
    let mut first_word = 0;
    for target in all
        .iter()
        .filter(|target| share.shape.has(target.first_element))
    {
        places.push([target.first_word as usize, target.word_count as usize]);
        own.push(CouplingTarget {
            first_word,
            ..*target
        });
        first_word += target.word_count;
    }
    (own, places)
}
