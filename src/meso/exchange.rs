//! Light between the facets of a tile: the matrix G of the response.

use super::Visibility;
use super::visibility::RAYS;
use crate::constants::NONE;

/// Rays by the facet that they hit, each with the facet it comes from and its weight.
pub(super) struct Exchange {
    first: Vec<u32>,
    from: Vec<(u32, f32)>,
}

impl Exchange {
    /// The blocked part of each facet's view, 1 − sky, is shared among its rays that hit a facet.
    pub(super) fn new(visibility: &Visibility, sky: &[f64]) -> Self {
        let landed = |hits: &[u32]| hits.iter().filter(|&&h| h != NONE).count();
        let rows = || visibility.hits.chunks_exact(RAYS).enumerate();
        let mut first = vec![0_u32; sky.len() + 1];
        for (q, hits) in rows() {
            for &h in hits.iter().filter(|&&h| h != NONE) {
                first[h as usize + 1] += 1;
            }
            // If no ray hits a facet, the blocked part is assigned to the facet itself.
            if landed(hits) == 0 {
                first[q + 1] += 1;
            }
        }
        for q in 0..sky.len() {
            first[q + 1] += first[q];
        }
        let mut place = first.clone();
        let mut from = vec![(0, 0.0); first[sky.len()] as usize];
        let mut put = |to: usize, q: usize, weight: f64| {
            from[place[to] as usize] = (q as u32, weight as f32);
            place[to] += 1;
        };
        for (q, hits) in rows() {
            let blocked = 1.0 - sky[q];
            match landed(hits) {
                0 => put(q, q, blocked),
                count => {
                    for &h in hits.iter().filter(|&&h| h != NONE) {
                        put(h as usize, q, blocked / count as f64);
                    }
                }
            }
        }
        Self { first, from }
    }

    pub(super) fn to(&self, facet: usize) -> &[(u32, f32)] {
        &self.from[self.first[facet] as usize..self.first[facet + 1] as usize]
    }
}
