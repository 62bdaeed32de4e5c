//! The response of a relief to light: from the vector moments of the slots to the light sent into
//! each slot.
//!
//! A facet q of the tile receives E_q = Σ_k a_qk · m_k, where a_qk is the linear fit, over slot k,
//! of V_q(ω)(n_q·ω)⁺: the facet's response to light from ω, with V the relief's visibility. Light
//! bounces inside, B = ρ(E + G B) + e, and slot j receives the mean Σ_q W_jq B_q of the facets seen
//! from its directions. The response is thus one matrix, R_jk = W (1 − ρG)⁻¹ ρ a, and H = W (1 −
//! ρG)⁻¹ 1 for light that the relief emits.
//!
//! Energy is conserved up to rounding: for every direction the facets together receive exactly the
//! light that falls on the tile; the fit is exact for linear functions and for the sum over a slot;
//! the rows of W, and those of G with the sky, sum to 1.

use glam::{DVec3, Vec3};

use crate::math::directions::Directions;

/// A slot's block: `[colour]` rows, each of which multiplies the moment of that colour.
pub type Block = [Vec3; 3];

/// The response of one relief, sent light as radiosity πL.
#[derive(Debug, Clone)]
pub struct Response {
    /// R, `[in][out]`.
    pub matrix: Vec<Block>,
    /// Radiosity of the tile for the moment of each slot, `[in]`: Σ_j c_j R_j.
    pub albedo: Vec<Block>,
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
        let (columns, emission): (Vec<Vec<Block>>, Vec<Vec3>) = (0..k)
            .map(|out| {
                let direction = directions.centre(out);
                let above = || (0..normals.len()).filter(|&q| normals[q].dot(direction) > 0.0);
                let sent: Vec3 = above().map(|q| reflectance[q] * share(q)).sum();
                let emission = Vec3::splat(above().map(share).sum());
                let block = [sent.x, sent.y, sent.z].map(|s| Vec3::new(0.0, 0.0, s));
                (vec![block; k], emission)
            })
            .unzip();
        Self::new(directions, &columns, emission)
    }

    /// From columns `[in][out]` and the emission, `[out]`.
    pub(super) fn new(
        directions: &Directions,
        columns: &[Vec<Block>],
        emission: Vec<Vec3>,
    ) -> Self {
        let k = directions.count();
        let shares = slot_shares(directions);
        let mut matrix = Vec::with_capacity(k * k);
        let mut albedo = vec![[Vec3::ZERO; 3]; k];
        for (slot, total) in albedo.iter_mut().enumerate() {
            for (out, column) in columns.iter().enumerate() {
                matrix.push(column[slot]);
                for c in 0..3 {
                    total[c] += shares[out] as f32 * column[slot][c];
                }
            }
        }
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

    /// Radiosity under parallel light from a direction (z up), for an irradiance of 1 on the
    /// element.
    pub fn directional_albedo(&self, directions: &Directions, from: DVec3) -> Vec3 {
        let moment = (from / from.z).as_vec3();
        let block = self.albedo[directions.slot_of(from)];
        Vec3::new(
            block[0].dot(moment),
            block[1].dot(moment),
            block[2].dot(moment),
        )
    }

    /// Share of a uniform sky's light that leaves the relief again.
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
