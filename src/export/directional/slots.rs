//! Light from the slots of the hemisphere about a surface.

use glam::{DVec3, Vec3};
use nalgebra::DMatrix;

use super::Frame;
use super::facets::{self, FACETS, facets, turned};
use crate::error::Result;
use crate::math::directions::Directions;
use crate::solver::{Arriving, Lit, Place};

/// Light by slots: irradiance of a facet that faces the slot's middle.
///
/// Light between the middles of four slots is shared by them. That alone bends light towards the
/// middles; what it makes of facets tilted by up to 60° is then put right by the smallest change of
/// the slots, which may leave some a little below zero.
pub(super) struct Fit {
    directions: Directions,
    centres: Vec<DVec3>,
    /// Irradiance of each facet by each slot: `[facet][slot]`.
    cosines: DMatrix<f64>,
    /// What facets lack to what slots lack: `[slot][facet]`.
    back: DMatrix<f64>,
}

/// Damping of the fit, over the largest square sum of a facet's cosines: without it, slots change
/// much for little.
const DAMPING: f64 = 1e-3;

impl Fit {
    pub fn new(directions: Directions) -> Self {
        let centres: Vec<DVec3> = (0..directions.count())
            .map(|slot| directions.centre(slot))
            .collect();
        let facets = facets();
        let cosines = DMatrix::from_fn(FACETS, centres.len(), |facet, slot| {
            facets[facet].0.dot(centres[slot]).max(0.0)
        });
        let mut square = &cosines * cosines.transpose();
        let most = square.diagonal().max();
        for facet in 0..FACETS {
            square[(facet, facet)] += DAMPING * most;
        }
        // Positive definite by what was added.
        let inverse = square.try_inverse();
        let inverse = inverse.unwrap_or_else(|| DMatrix::zeros(FACETS, FACETS));
        Self {
            directions,
            back: cosines.transpose() * inverse,
            cosines,
            centres,
        }
    }

    /// Light from each slot at places, `[place][slot]`.
    pub fn look(
        &self,
        lit: &Lit<'_>,
        frames: &[Frame],
        places: &[Place],
        direct: bool,
    ) -> Result<Vec<Vec<Vec3>>> {
        let start = |i: usize| {
            let axes = frames[i].axes();
            let slots = vec![DVec3::ZERO; self.centres.len()];
            (axes, turned(axes), slots, [DVec3::ZERO; FACETS])
        };
        let add = |(axes, turned, slots, sums): &mut (_, [DVec3; FACETS], Vec<_>, [_; FACETS]),
                   from: Arriving| {
            let axes: &[DVec3; 3] = axes;
            let way = DVec3::from_array(axes.map(|axis| axis.dot(from.way)));
            for (slot, weight) in self.directions.bilinear(way) {
                slots[slot] += from.light * weight;
            }
            facets::add(sums, turned, from);
        };
        let found = lit.arriving(places, direct, start, add)?;
        let each = found
            .into_iter()
            .map(|(_, _, slots, sums)| self.fitted(slots, &sums));
        Ok(each.collect())
    }

    fn fitted(&self, slots: Vec<DVec3>, wanted: &[DVec3; FACETS]) -> Vec<Vec3> {
        let lacking = DMatrix::from_fn(FACETS, 3, |facet, c| {
            let has = (slots.iter().enumerate()).map(|(k, s)| self.cosines[(facet, k)] * s[c]);
            wanted[facet][c] - has.sum::<f64>()
        });
        let change = &self.back * lacking;
        (slots.iter().enumerate())
            .map(|(k, s)| {
                let by = DVec3::new(change[(k, 0)], change[(k, 1)], change[(k, 2)]);
                (*s + by).as_vec3()
            })
            .collect()
    }
}

/// Irradiance of a facet from the light of the slots: E(n) = Σ s_k max(0, n · ω_k), ω_k the middle
/// of slot k, and the normal in the frame of the surface.
pub fn irradiance(directions: Directions, slots: &[Vec3], normal: DVec3) -> Vec3 {
    (slots.iter().enumerate())
        .map(|(k, slot)| *slot * directions.centre(k).dot(normal).max(0.0) as f32)
        .sum()
}

pub(super) fn straight(directions: Directions, light: Vec3) -> Vec<Vec3> {
    let mut slots = vec![Vec3::ZERO; directions.count()];
    let four = directions.bilinear(DVec3::Z);
    let height: f64 = (four.iter())
        .map(|&(slot, weight)| weight * directions.centre(slot).z)
        .sum();
    for (slot, weight) in four {
        slots[slot] += light * (weight / height) as f32;
    }
    slots
}
