//! What a relief does to light: from the vector moments of the slots to the light sent into each slot.
//!
//! A facet q of the tile receives E_q = Σ_k a_qk · m_k, where a_qk is the linear fit, over slot k, of V_q(ω)(n_q·ω)⁺: what
//! the facet takes of light from ω, V being the relief's visibility. Light bounces inside, B = ρ(E + G B) + e, and slot j is
//! sent the mean Σ_q W_jq B_q of what is seen from its directions. So the response is one matrix,
//! R_jk = W (1 − ρG)⁻¹ ρ a, and H = W (1 − ρG)⁻¹ 1 for light that the relief emits.
//!
//! Energy is kept to rounding: for every direction the facets together receive exactly what falls on the tile, the fit
//! gives back linear functions and the sum over a slot exactly, the rows of W and those of G with the sky sum to 1.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::exchange::Exchange;
use super::transfer::{CELLS, Facets, Fit};
use super::{HeightField, Visibility};
use crate::directions::{Directions, FineCell};

/// A slot's colour-by-vector block: `[colour]` rows that multiply a moment's vector of that colour.
pub type Block = [Vec3; 3];

/// The response of one relief, sent light as radiosity πL.
#[derive(Debug, Clone)]
pub struct Response {
    /// R, `[in][out]`.
    pub matrix: Vec<Block>,
    /// Radiosity of the tile for the moment of each slot, `[in]`: Σ_j c_j R_j.
    pub albedo: Vec<Block>,
    /// H, sent light for an emitted radiosity of 1, `[out]`, RGB.
    pub emission: Vec<Vec3>,
    /// Σ_j c_j H_j: emitted radiosity of the tile for one of 1 on its facets.
    pub mean_emission: Vec3,
}

/// Share of a uniform sender's power that each slot carries when light is looked up bilinearly: c_j, which sum to 1.
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

/// Bounces stop when the largest change is this share of the largest value.
const CONVERGED: f32 = 1e-6;
const MOST_BOUNCES: usize = 2_000;

impl Response {
    /// `physical` transport. `reflectance` and the normals that shade are given `[facet]`.
    pub fn physical(
        directions: &Directions,
        field: &HeightField,
        visibility: &Visibility,
        normals: &[DVec3],
        reflectance: &[Vec3],
    ) -> Self {
        let facets = Facets::new(field, normals, visibility);
        let fit = Fit::new(directions);
        let count = field.facet_count();
        let k = directions.count();
        // Vectors of each facet, `[facet][in]`.
        let vectors: Vec<Vec3> = facets
            .transfer
            .par_chunks(CELLS)
            .flat_map_iter(|row| fit.apply(row))
            .collect();
        let exchange = Exchange::new(visibility, &facets.sky);
        let looks: Vec<Vec<(usize, f32)>> = slots_of_cells(directions);
        let columns: Vec<(Vec<Block>, Vec3)> = (0..k)
            .into_par_iter()
            .map(|out| {
                let seen = seen_from(&facets, &looks[out]);
                let weights = gathered(&exchange, &seen, reflectance);
                let mut column = vec![[Vec3::ZERO; 3]; k];
                let mut emission = Vec3::ZERO;
                for q in 0..count {
                    emission += weights[q];
                    let sent = weights[q] * reflectance[q];
                    for (block, v) in column.iter_mut().zip(&vectors[q * k..]) {
                        for c in 0..3 {
                            block[c] += sent[c] * *v;
                        }
                    }
                }
                (column, emission)
            })
            .collect();
        Self::new(directions, &columns)
    }

    /// `paper` transport, equations (3) and (4): a pixel's irradiance, whatever its direction, leaves with its albedo in
    /// every direction less than 90° from its normal. The facets are seen as the flat element shows them, each alike.
    pub fn paper(directions: &Directions, normals: &[DVec3], reflectance: &[Vec3]) -> Self {
        let k = directions.count();
        let share = 1.0 / normals.len() as f32;
        let columns: Vec<(Vec<Block>, Vec3)> = (0..k)
            .map(|out| {
                let direction = directions.centre(out);
                let above = || (0..normals.len()).filter(|&q| normals[q].dot(direction) > 0.0);
                let sent: Vec3 = above().map(|q| reflectance[q] * share).sum();
                let emission = Vec3::splat(above().count() as f32 * share);
                let block = [sent.x, sent.y, sent.z].map(|s| Vec3::new(0.0, 0.0, s));
                (vec![block; k], emission)
            })
            .collect();
        Self::new(directions, &columns)
    }

    /// From the columns, `[out]` of `[in]`, and the emission.
    fn new(directions: &Directions, columns: &[(Vec<Block>, Vec3)]) -> Self {
        let k = directions.count();
        let shares = slot_shares(directions);
        let mut matrix = Vec::with_capacity(k * k);
        let mut albedo = vec![[Vec3::ZERO; 3]; k];
        for (slot, total) in albedo.iter_mut().enumerate() {
            for (out, (column, _)) in columns.iter().enumerate() {
                matrix.push(column[slot]);
                for c in 0..3 {
                    total[c] += shares[out] as f32 * column[slot][c];
                }
            }
        }
        let emission: Vec<Vec3> = columns.iter().map(|c| c.1).collect();
        let mean_emission = emission
            .iter()
            .zip(&shares)
            .map(|(e, &s)| *e * s as f32)
            .sum();
        Self {
            matrix,
            albedo,
            emission,
            mean_emission,
        }
    }

    /// Sent light, `[out]`, for the moments of one element, `[in][colour]`.
    pub fn send(&self, moments: &[[Vec3; 3]]) -> Vec<Vec3> {
        let k = moments.len();
        let mut sent = vec![Vec3::ZERO; k];
        for (row, m) in self.matrix.chunks_exact(k).zip(moments) {
            if m.iter().all(|v| *v == Vec3::ZERO) {
                continue;
            }
            for (sum, block) in sent.iter_mut().zip(row) {
                *sum += Vec3::new(block[0].dot(m[0]), block[1].dot(m[1]), block[2].dot(m[2]));
            }
        }
        sent
    }

    /// Radiosity that parallel light from a direction (z up) leaves with, for an irradiance of 1 on the element.
    pub fn directional_albedo(&self, directions: &Directions, from: DVec3) -> Vec3 {
        let moment = (from / from.z).as_vec3();
        let block = self.albedo[directions.slot_of(from)];
        Vec3::new(
            block[0].dot(moment),
            block[1].dot(moment),
            block[2].dot(moment),
        )
    }

    /// Share of a uniform sky's light that leaves again.
    pub fn mean_albedo(&self, directions: &Directions) -> Vec3 {
        let cells: Vec<_> = directions.fine().collect();
        let total: f64 = cells.iter().map(|(cell, _)| cell.direction.z).sum();
        cells
            .iter()
            .map(|(cell, slot)| {
                let (block, w) = (self.albedo[*slot], (cell.direction / total).as_vec3());
                Vec3::new(block[0].dot(w), block[1].dot(w), block[2].dot(w))
            })
            .sum()
    }

    /// The largest albedo in the middle of any slot.
    pub fn highest_albedo(&self, directions: &Directions) -> f32 {
        (0..directions.count())
            .map(|slot| {
                self.directional_albedo(directions, directions.centre(slot))
                    .max_element()
            })
            .fold(0.0, f32::max)
    }
}

/// For each slot, the fine cells that a bilinear look-up takes from it, with their weights.
fn slots_of_cells(directions: &Directions) -> Vec<Vec<(usize, f32)>> {
    let mut looks = vec![Vec::new(); directions.count()];
    for (i, cell) in FineCell::all().enumerate() {
        for (slot, weight) in directions.bilinear(cell.direction) {
            if weight > 0.0 {
                looks[slot].push((i, weight as f32));
            }
        }
    }
    looks
}

/// W of one slot: the share of each facet in what is seen from its directions.
fn seen_from(facets: &Facets, looks: &[(usize, f32)]) -> Vec<f32> {
    let mut seen: Vec<f64> = facets
        .transfer
        .chunks_exact(CELLS)
        .zip(&facets.area)
        .map(|(row, area)| {
            let sum: f32 = looks.iter().map(|&(i, weight)| weight * row[i]).sum();
            area * f64::from(sum)
        })
        .collect();
    let sum: f64 = seen.iter().sum();
    seen.iter_mut().for_each(|s| *s /= sum);
    seen.into_iter().map(|s| s as f32).collect()
}

/// What each facet's own light adds to what is seen, all bounces inside the relief included: y = w + Gᵀ ρ y.
fn gathered(exchange: &Exchange, seen: &[f32], reflectance: &[Vec3]) -> Vec<Vec3> {
    let mut total: Vec<Vec3> = seen.iter().map(|&w| Vec3::splat(w)).collect();
    let mut bounce = total.clone();
    let mut highest = total.iter().map(|v| v.max_element()).fold(0.0, f32::max);
    for _ in 0..MOST_BOUNCES {
        let sent: Vec<Vec3> = bounce
            .iter()
            .zip(reflectance)
            .map(|(y, r)| *y * *r)
            .collect();
        let mut change = 0.0_f32;
        for (q, y) in bounce.iter_mut().enumerate() {
            *y = exchange
                .to(q)
                .iter()
                .map(|&(from, weight)| sent[from as usize] * weight)
                .sum();
            total[q] += *y;
            change = change.max(y.max_element());
            highest = highest.max(total[q].max_element());
        }
        if change <= CONVERGED * highest {
            break;
        }
    }
    total
}
