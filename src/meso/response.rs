//! The response of a relief to light: from what arrives, by direction, to what is sent into each
//! slot.
//!
//! A facet q of the tile receives E_q = V_q(ω)(n_q·ω)⁺ / ω_z for light from ω that brings the tile
//! an irradiance of 1, with V the relief's visibility. Light bounces inside, B = ρ(E + G B) + e,
//! and towards ω' leaves the mean Σ_q W_q(ω') B_q of the facets seen from there. What is sent is
//! kept by slot, bilinear between the slots' centres and fitted so that the sum over all directions
//! stays (W_jq); what arrives, by the functions u_r of a [`Basis`]. The response is thus one small
//! matrix, R_jr, the coefficients of W (1 − ρG)⁻¹ ρ E(ω), and H = W (1 − ρG)⁻¹ 1 for light that the
//! relief emits.
//!
//! Energy is conserved up to rounding: for every direction the facets together receive exactly the
//! light that falls on the tile; the first of the functions is constant and the others have no part
//! of it; the rows of W, and those of G with the sky, sum to 1.

use glam::{DVec3, Vec3};

use super::basis::{Basis, RANK};
use crate::math::directions::{Directions, FineCell};

/// The response of one relief, sent light as radiosity πL.
#[derive(Debug, Clone)]
pub struct Response {
    /// u_r.
    pub basis: Basis,
    /// R, `[rank][out]`, RGB.
    pub matrix: Vec<Vec3>,
    /// Radiosity of the tile for each coefficient, `[rank]`, RGB: Σ_j c_j R_j.
    pub albedo: [Vec3; RANK],
    /// H, light sent for an emitted radiosity of 1, `[out]`, RGB.
    pub emission: Vec<Vec3>,
    /// Σ_j c_j H_j: emitted radiosity of the tile for one of 1 on its facets.
    pub mean_emission: Vec3,
}

/// c_j: share of each slot in the power of a uniform sender when light is looked up bilinearly;
/// they sum to 1.
pub fn slot_shares(directions: &Directions) -> Vec<f64> {
    let mut shares = vec![0.0; directions.count()];
    for (cell, _) in directions.fine() {
        for (slot, weight) in directions.bilinear(cell.direction) {
            shares[slot] += weight * cell.direction.z;
        }
    }
    let sum: f64 = shares.iter().sum();
    shares.iter().map(|s| s / sum).collect()
}

impl Response {
    /// `paper` transport, equations (3) and (4): a pixel's irradiance from any direction leaves,
    /// times its albedo, in every direction less than 90° from its normal. The facets are weighted
    /// as on the flat element. `shares` are the facets' weights and sum to 1; None weights all
    /// facets equally.
    pub fn paper(
        directions: &Directions,
        normals: &[DVec3],
        reflectance: &[Vec3],
        shares: Option<&[f32]>,
    ) -> Self {
        let k = directions.count();
        let alike = 1.0 / normals.len() as f32;
        let share = |q: usize| shares.map_or(alike, |shares| shares[q]);
        let (mut matrix, emission): (Vec<Vec3>, Vec<Vec3>) = (0..k)
            .map(|out| {
                let direction = directions.centre(out);
                let above = || (0..normals.len()).filter(|&q| normals[q].dot(direction) > 0.0);
                let sent: Vec3 = above().map(|q| reflectance[q] * share(q)).sum();
                (sent, Vec3::splat(above().map(share).sum()))
            })
            .unzip();
        matrix.resize(RANK * k, Vec3::ZERO);
        Self::new(directions, Basis::even(), matrix, emission)
    }

    /// From R, `[rank][out]`, and the emission, `[out]`.
    pub(super) fn new(
        directions: &Directions,
        basis: Basis,
        matrix: Vec<Vec3>,
        emission: Vec<Vec3>,
    ) -> Self {
        let shares = slot_shares(directions);
        let mean = |sent: &[Vec3]| -> Vec3 {
            let shared = sent.iter().zip(&shares);
            shared.map(|(sent, &share)| *sent * share as f32).sum()
        };
        let mut albedo = [Vec3::ZERO; RANK];
        for (albedo, sent) in albedo
            .iter_mut()
            .zip(matrix.chunks_exact(directions.count()))
        {
            *albedo = mean(sent);
        }
        Self {
            basis,
            matrix,
            albedo,
            mean_emission: mean(&emission),
            emission,
        }
    }

    /// Sent light, `[out]`, for the coefficients of one element, `[rank]`, RGB.
    pub fn send(&self, coefficients: &[Vec3]) -> Vec<Vec3> {
        let k = self.emission.len();
        let mut sent = vec![Vec3::ZERO; k];
        for (row, coefficient) in self.matrix.chunks_exact(k).zip(coefficients) {
            for (sum, of) in sent.iter_mut().zip(row) {
                *sum += *of * *coefficient;
            }
        }
        sent
    }

    /// Sent light, `[out]`, under parallel light from a direction (z up), for an irradiance of 1 on
    /// the element.
    pub fn sent_from(&self, from: DVec3) -> Vec<Vec3> {
        let coefficients = self.basis.at(from).map(|u| Vec3::splat(u as f32));
        self.send(&coefficients)
    }

    /// Radiosity under parallel light from a direction (z up), for an irradiance of 1 on the
    /// element.
    pub fn directional_albedo(&self, from: DVec3) -> Vec3 {
        let terms = self.basis.at(from).into_iter().zip(&self.albedo);
        terms.map(|(u, albedo)| *albedo * u as f32).sum()
    }

    /// Share of a uniform sky's light that leaves the relief again.
    pub fn mean_albedo(&self) -> Vec3 {
        self.albedo[0]
    }

    /// The largest albedo for light from any direction.
    pub fn highest_albedo(&self) -> f32 {
        FineCell::all()
            .map(|cell| self.directional_albedo(cell.direction).max_element())
            .fold(0.0, f32::max)
    }
}
