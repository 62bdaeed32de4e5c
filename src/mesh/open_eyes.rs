//! Eyes of sources that are partly covered: what lies under another surface is dark, and the light
//! of a source comes from the rest of it.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::elements::Elements;
use super::near::{PartTree, first_met};
use super::shadow_tree::ShadowTree;
use super::sources::{Source, SourcePlace};
use crate::constants::SOURCE_EYES;
use crate::structs::ShadowOccluder;

/// Directions that a place looks in, evenly by what a surface receives from them.
const LOOKS: usize = 8;

/// How far off what it meets hides the rest, in radii of its source.
const REACH: f64 = 1.0;

/// Of the places of a source, one in this many is looked at for cover.
const EVERY: usize = 4;

/// Golden angle.
const TURN: f64 = 2.399_963_23;

/// What a source is to be looked at from.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Wanted {
    /// Its index among all sources: each has its own pattern of places.
    pub turn: u32,
    /// How many places; 0, or a divisor of [`SOURCE_EYES`].
    pub places: u32,
}

/// Gives each surface source its [`Source::places`], as many as are `wanted`, `[source]`, and moves
/// an eye that is covered, both to places that are as open as others of the source. Sources that
/// have as many are left as they are. How many eyes were moved.
pub fn open_eyes<'a>(
    elements: &Elements,
    sources: impl IntoParallelIterator<Item = &'a mut Source, Iter: IndexedParallelIterator>,
    occluders: &ShadowTree<ShadowOccluder>,
    wanted: &[Wanted],
) -> usize {
    let each = sources.into_par_iter().zip(wanted);
    let moved = each.map(|(source, wanted)| {
        let places = wanted.places as usize;
        if !source.is_surface() || source.places.len() >= places.max(1) {
            return 0;
        }
        let moved = open_eye(elements, source, occluders, wanted);
        source.places = spread(&source.places, places);
        usize::from(moved)
    });
    moved.sum()
}

/// So many of places, evenly.
fn spread(places: &[SourcePlace], count: usize) -> Vec<SourcePlace> {
    let at = |k: usize| places[(2 * k + 1) * places.len() / (2 * count)];
    (0..count).map(at).collect()
}

/// Gives a source all [`SOURCE_EYES`] places, unless no places are `wanted` and its eye stays.
/// Whether its eye was moved.
fn open_eye(
    elements: &Elements,
    source: &mut Source,
    occluders: &ShadowTree<ShadowOccluder>,
    wanted: &Wanted,
) -> bool {
    let most = LOOKS / 2;
    let is_covered = |source: &Source, place: DVec3| {
        let open = open_looks(source, place, occluders);
        open.take(most).count() < most
    };
    let is_one = source.element_count == 1;
    let eye = !is_one && is_covered(source, source.eye);
    if wanted.places == 0 && !eye {
        return false;
    }
    let tree = PartTree::of(elements, source);
    let count = SOURCE_EYES as usize;
    source.places = tree.places(elements, source, count, wanted.turn as usize);
    ends_first(source);
    let mut looked_at = source.places.iter().step_by(EVERY);
    if is_one || !eye && !looked_at.any(|place| is_covered(source, place.at)) {
        return false;
    }
    let places = &source.places;
    let open = |place: &SourcePlace| open_looks(source, place.at, occluders).count();
    let openness: Vec<usize> = places.iter().map(open).collect();
    let best = openness.iter().copied().max().unwrap_or(0);
    let open: Vec<SourcePlace> = (places.iter().zip(&openness))
        .filter(|(_, open)| 2 * **open >= best)
        .map(|(place, _)| *place)
        .collect();
    let nearest = |to: DVec3| {
        let distance = |place: &&SourcePlace| place.at.distance_squared(to);
        open.iter()
            .min_by(|a, b| distance(a).total_cmp(&distance(b)))
            .map(|place| place.at)
    };
    let middle = open.iter().map(|place| place.at).sum::<DVec3>() / open.len() as f64;
    let moved = eye && best >= most;
    if let Some(place) = nearest(middle).filter(|_| moved) {
        source.eye = place;
    }
    source.places = spread(&open, count);
    ends_first(source);
    moved
}

/// Moves the places furthest out to four sides to the front, see `SOURCE_ENDS`.
fn ends_first(source: &mut Source) {
    let (t, b) = (source.tangent, source.bitangent);
    let places = &mut source.places;
    for (k, way) in [t + b, -t - b, t - b, b - t].into_iter().enumerate() {
        let along = |i: &usize| places[*i].at.dot(way);
        let furthest = (k..places.len()).max_by(|i, j| along(i).total_cmp(&along(j)));
        places.swap(k, furthest.unwrap_or(k));
    }
}

/// Directions, of [`LOOKS`], in which a place on a source sees as far as the source is wide, and
/// beyond that no back of a surface, which sends nothing: whatever shows its back on most sides
/// encloses the place.
fn open_looks(
    source: &Source,
    place: DVec3,
    occluders: &ShadowTree<ShadowOccluder>,
) -> impl Iterator<Item = usize> {
    let all = &occluders.nodes()[0];
    let reach = f64::from(all.high.distance(all.low));
    let is_open = move |k: &usize| {
        let r = ((*k as f64 + 0.5) / LOOKS as f64).sqrt();
        let (sin, cos) = (TURN * *k as f64 % TAU).sin_cos();
        let up = (1.0 - r * r).sqrt();
        let way = r * cos * source.tangent + r * sin * source.bitangent + up * source.normal;
        match first_met(occluders, place, reach * way) {
            Some((at, is_back)) => !is_back && at * reach > REACH * source.radius,
            None => true,
        }
    };
    (0..LOOKS).filter(is_open)
}
