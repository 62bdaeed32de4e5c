//! Light on the texels of a relief as a short sum of products: E_q = Σ_r a_qr β_r, where the
//! factors a depend only on the relief and the coefficients β only on the incident light. The cost
//! of a frame then does not depend on the number of slots.
//!
//! The rows of the transfer, a facet's response to the light in each slot, are approximately
//! combinations of a few rows: those with the greatest singular values. Rows are compared by their
//! values over the directions, not by their coefficients.

use std::ops::Range;

use glam::{DMat3, DVec2, DVec3, Vec3, Vec4};
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::transfer::{CELLS, Facets, Fit, Sight};
use super::visibility::RAYS;
use super::{HeightField, Shading, Visibility};
use crate::constants::{MOST_RANK, NONE};
use crate::math::directions::Directions;

/// Factors of one tile.
#[derive(Debug, Clone)]
pub struct Factors {
    pub rank: usize,
    /// β_r = Σ_k basis_rk · m_k for the vector moments of each colour, `[rank][slot]`.
    pub basis: Vec<Vec3>,
    /// Irradiance of each corner of each cell for a unit of β, `[cell][corner][rank]`, corners (0,
    /// 0), (1, 0), (0, 1), (1, 1) in u and v: RGB by light from elsewhere in the relief, and w by
    /// light from outside.
    pub corners: Vec<Vec4>,
    /// Rms error of the light that arrives directly, over facets and directions, relative to the
    /// rms of the light.
    pub error: f64,
}

/// Corners of a cell.
pub const CORNERS: usize = 4;
/// Ranks are multiples of this.
pub const RANK_STEP: usize = 4;

const CONVERGED: f32 = 1e-5;
const MOST_BOUNCES: usize = 500;

impl Factors {
    /// The least rank whose error is at most `error`, or [`MOST_RANK`].
    pub fn new(
        directions: &Directions,
        field: &HeightField,
        visibility: &Visibility,
        shading: &Shading,
        error: f64,
    ) -> Self {
        let facets = Facets::new(field, &shading.normals, visibility);
        let fit = Fit::new(directions);
        let whitening = Whitening::new(directions);
        let width = 3 * directions.count();
        let rows: Vec<f64> = facets
            .transfer
            .par_chunks(CELLS)
            .flat_map_iter(|row| whitening.apply(&fit.apply(row)))
            .collect();
        let rows = DMatrix::from_row_slice(facets.area.len(), width, &rows);
        let eigen = SymmetricEigen::new(rows.transpose() * &rows);
        let mut order: Vec<usize> = (0..width).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let power =
            |of: &[usize]| -> f64 { of.iter().map(|&i| eigen.eigenvalues[i].max(0.0)).sum() };
        let whole = power(&order);
        let left_out = |rank: usize| (power(&order[rank..]) / whole).sqrt();
        let most = (MOST_RANK as usize).min(width);
        let rank = (RANK_STEP..most)
            .step_by(RANK_STEP)
            .find(|&rank| left_out(rank) <= error)
            .unwrap_or(most);
        let axes = DMatrix::from_fn(width, rank, |i, r| eigen.eigenvectors[(i, order[r])]);
        let basis = (0..rank)
            .flat_map(|r| whitening.undo(axes.column(r).as_slice()))
            .collect();
        let direct = &rows * &axes;
        let inside = inside(visibility, &facets.sky, &shading.reflectance, &direct);
        let sight = Sight::new(visibility);
        let (axes, inside, facets) = (&axes, &inside, &facets);
        let (sight, whitening, fit) = (&sight, &whitening, &fit);
        let of_cell = move |cell: usize| {
            let seen = [2 * cell, 2 * cell + 1].map(|q| {
                let mut seen = [0.0; CELLS];
                sight.seen(q, &mut seen);
                seen
            });
            (0..CORNERS).flat_map(move |at| {
                let corner = Corner::new(field, cell, at);
                let row = corner.transfer(sight, &seen, &facets.scale);
                let row = whitening.apply(&fit.apply(&row));
                let share = 1.0 / corner.facets.len() as f32;
                (0..rank).map(move |r| {
                    let own: f64 = row
                        .iter()
                        .zip(axes.column(r).iter())
                        .map(|(a, b)| a * b)
                        .sum();
                    let bounced: Vec3 = corner.facets.clone().map(|q| inside[q * rank + r]).sum();
                    (bounced * share).extend(own as f32)
                })
            })
        };
        let cells = (0..field.facet_count() / 2).into_par_iter();
        let corners = cells.flat_map_iter(of_cell).collect();
        Self {
            rank,
            basis,
            corners,
            error: left_out(rank),
        }
    }

    /// β of one place's moments, `[slot][colour]`: `[rank]`, RGB.
    pub fn coefficients<'a>(&'a self, moments: &'a [[Vec3; 3]]) -> impl Iterator<Item = Vec3> + 'a {
        self.basis.chunks_exact(moments.len()).map(move |basis| {
            basis
                .iter()
                .zip(moments)
                .map(|(b, m)| Vec3::new(b.dot(m[0]), b.dot(m[1]), b.dot(m[2])))
                .sum()
        })
    }

    /// Irradiance at a place in cells, bilinear between the corners of its cell, for coefficients
    /// `[rank]`.
    pub fn irradiance(&self, field: &HeightField, at: DVec2, coefficients: &[Vec3]) -> Vec3 {
        let low = at.floor();
        let f = (at - low).as_vec2();
        let wrap = |i: f64, size: u32| (i as i64).rem_euclid(i64::from(size)) as usize;
        let cell = wrap(low.y, field.rows) * field.columns as usize + wrap(low.x, field.columns);
        let weights = [
            (1.0 - f.x) * (1.0 - f.y),
            f.x * (1.0 - f.y),
            (1.0 - f.x) * f.y,
            f.x * f.y,
        ];
        (0..CORNERS)
            .map(|corner| {
                let row = &self.corners[(cell * CORNERS + corner) * self.rank..][..self.rank];
                let sum: Vec3 = row
                    .iter()
                    .zip(coefficients)
                    .map(|(a, b)| (a.truncate() + a.w) * *b)
                    .sum();
                sum * weights[corner]
            })
            .sum()
    }
}

/// A corner of a cell, seen from inside the cell.
struct Corner {
    /// Facets of the cell at this corner.
    facets: Range<usize>,
    /// Normal of the bilinear surface over the cell.
    normal: DVec3,
}

impl Corner {
    fn new(field: &HeightField, cell: usize, corner: usize) -> Self {
        let columns = field.columns as usize;
        let (i, j) = ((cell % columns) as i64, (cell / columns) as i64);
        let (right, up) = ((corner % 2) as i64, (corner / 2) as i64);
        let along = field.point(i + 1, j + up) - field.point(i, j + up);
        let across = field.point(i + right, j + 1) - field.point(i + right, j);
        Self {
            facets: match corner {
                0 => 2 * cell..2 * cell + 1,
                3 => 2 * cell + 1..2 * cell + 2,
                _ => 2 * cell..2 * cell + 2,
            },
            normal: DVec3::new(-along, -across / field.aspect, 1.0).normalize(),
        }
    }

    /// Its response to the light from each fine cell: what its facets see, of those `seen` by both
    /// of the cell, with its own normal.
    fn transfer(&self, sight: &Sight<'_>, seen: &[[f32; CELLS]; 2], scale: &[f32]) -> Vec<f32> {
        let [first, second] = seen;
        let scaled = |seen: &[f32; CELLS]| seen.iter().zip(scale).map(|(s, by)| s * by).collect();
        let mut row: Vec<f32> = match (self.facets.len(), self.facets.start % 2) {
            (1, 0) => scaled(first),
            (1, _) => scaled(second),
            _ => {
                let both = first.iter().zip(second).zip(scale);
                both.map(|((a, b), by)| 0.5 * (a + b) * by).collect()
            }
        };
        sight.times_cosine(self.normal, &mut row);
        row
    }
}

/// Coordinates in which the length of a slot's vector v is the root of Σ (v · ω)² over the slot.
struct Whitening {
    /// `[slot]`, Lᵀ and its inverse, with L Lᵀ = Σ ω ωᵀ.
    turns: Vec<(DMat3, DMat3)>,
}

impl Whitening {
    fn new(directions: &Directions) -> Self {
        let mut moments = vec![DMat3::ZERO; directions.count()];
        for (cell, slot) in directions.fine() {
            let w = cell.direction;
            moments[slot] += DMat3::from_cols(w * w.x, w * w.y, w * w.z);
        }
        let turns = moments
            .into_iter()
            .map(|m| {
                // Cholesky, column by column.
                let a = m.x_axis.x.sqrt();
                let (b, c) = (m.x_axis.y / a, m.x_axis.z / a);
                let d = (m.y_axis.y - b * b).sqrt();
                let e = (m.y_axis.z - b * c) / d;
                let f = (m.z_axis.z - c * c - e * e).sqrt();
                let lower = DMat3::from_cols(
                    DVec3::new(a, b, c),
                    DVec3::new(0.0, d, e),
                    DVec3::new(0.0, 0.0, f),
                );
                let upper = lower.transpose();
                (upper, upper.inverse())
            })
            .collect();
        Self { turns }
    }

    /// From vectors `[slot]` to coordinates `[slot][axis]`.
    fn apply(&self, vectors: &[Vec3]) -> Vec<f64> {
        let turned = self.turns.iter().zip(vectors);
        turned
            .flat_map(|((upper, _), v)| (*upper * v.as_dvec3()).to_array())
            .collect()
    }

    fn undo(&self, coordinates: &[f64]) -> Vec<Vec3> {
        let turned = self.turns.iter().zip(coordinates.chunks_exact(3));
        turned
            .map(|((_, inverse), c)| (*inverse * DVec3::from_slice(c)).as_vec3())
            .collect()
    }
}

/// Irradiance of the facets by light from other facets, `[facet][rank]`, RGB: x = G ρ (a + x).
fn inside(
    visibility: &Visibility,
    sky: &[f64],
    reflectance: &[Vec3],
    direct: &DMatrix<f64>,
) -> Vec<Vec3> {
    let rank = direct.ncols();
    let own = |q: usize, r: usize| Vec3::splat(direct[(q, r)] as f32);
    let mut light = vec![Vec3::ZERO; sky.len() * rank];
    for _ in 0..MOST_BOUNCES {
        let sent: Vec<Vec3> = light
            .par_chunks(rank)
            .enumerate()
            .flat_map_iter(|(q, x)| {
                let sent = move |(r, x): (usize, &Vec3)| reflectance[q] * (own(q, r) + *x);
                x.iter().enumerate().map(sent)
            })
            .collect();
        let next: Vec<Vec3> = (0..sky.len())
            .into_par_iter()
            .flat_map_iter(|q| {
                let hits = &visibility.hits[q * RAYS..][..RAYS];
                let landed: Vec<usize> = match hits.iter().filter(|&&h| h != NONE).count() {
                    0 => vec![q],
                    _ => hits
                        .iter()
                        .filter(|&&h| h != NONE)
                        .map(|&h| h as usize)
                        .collect(),
                };
                let weight = (1.0 - sky[q]) as f32 / landed.len() as f32;
                let mut sums = vec![Vec3::ZERO; rank];
                for h in landed {
                    for (sum, sent) in sums.iter_mut().zip(&sent[h * rank..]) {
                        *sum += *sent * weight;
                    }
                }
                sums
            })
            .collect();
        let size = |values: &[Vec3]| {
            values
                .iter()
                .fold(0.0_f32, |m, v| m.max(v.abs().max_element()))
        };
        let change = next
            .iter()
            .zip(&light)
            .fold(0.0_f32, |m, (a, b)| m.max((*a - *b).abs().max_element()));
        light = next;
        if change <= CONVERGED * size(&light) {
            break;
        }
    }
    light
}
