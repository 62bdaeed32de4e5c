//! Light on the texels of a relief as a short sum of products: E_q = Σ_r a_qr β_r, where the
//! factors a depend only on the relief and the coefficients β only on the incident light. The cost
//! of a frame then does not depend on the number of slots.
//!
//! The rows of the transfer, a facet's response to the light in each slot, are approximately
//! combinations of a few rows: those with the greatest singular values. Rows are compared by their
//! values over the directions, not by their coefficients.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec3, Vec4};
use nalgebra::{DMatrix, SymmetricEigen};
use rayon::prelude::*;

use super::coordinates::Coordinates;
use super::transfer::{CELLS, Facets, Sight};
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
        let coordinates = Coordinates::new(directions);
        let width = coordinates.count();
        // One column a facet.
        let mut columns = DMatrix::zeros(width, facets.area.len());
        let of_facets = columns.as_mut_slice().par_chunks_mut(width);
        (of_facets.zip(facets.transfer.par_chunks(CELLS)))
            .for_each(|(column, row)| coordinates.find(row, column));
        let eigen = SymmetricEigen::new(products(&columns));
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
        let axes = DMatrix::from_fn(rank, width, |r, i| eigen.eigenvectors[(i, order[r])]);
        let basis = (0..rank).flat_map(|r| {
            let axis: Vec<f64> = axes.row(r).iter().copied().collect();
            coordinates.vectors(&axis).collect::<Vec<_>>()
        });
        let direct = &axes * &columns;
        let inside = inside(visibility, &facets.sky, &shading.reflectance, &direct);
        let sight = Sight::new(visibility);
        let of_cell = |cell: usize, corners: &mut [Vec4]| {
            let seen = [2 * cell, 2 * cell + 1].map(|q| {
                let mut seen = [0.0; CELLS];
                sight.seen(q, &mut seen);
                seen
            });
            let mut column = vec![0.0; width];
            for (at, factors) in corners.chunks_exact_mut(rank).enumerate() {
                let corner = Corner::new(field, cell, at);
                let row = corner.transfer(&sight, &seen, &facets.scale);
                coordinates.find(&row, &mut column);
                let mut own = [0.0; MOST_RANK as usize];
                for (axes, of_axis) in axes.as_slice().chunks_exact(rank).zip(&column) {
                    own.iter_mut()
                        .zip(axes)
                        .for_each(|(own, axis)| *own += axis * of_axis);
                }
                let share = 1.0 / corner.facets.len() as f32;
                for (r, (factor, own)) in factors.iter_mut().zip(own).enumerate() {
                    let inside = |q: usize| Vec3::from_slice(&inside[3 * (q * rank + r)..]);
                    let bounced: Vec3 = corner.facets.clone().map(inside).sum();
                    *factor = (bounced * share).extend(own as f32);
                }
            }
        };
        let mut corners = vec![Vec4::ZERO; field.facet_count() / 2 * CORNERS * rank];
        let cells = corners.par_chunks_mut(CORNERS * rank).enumerate();
        cells.for_each(|(cell, corners)| of_cell(cell, corners));
        Self {
            rank,
            basis: basis.collect(),
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

/// Facets whose products are summed as one, so that sums do not depend on the number of threads.
const SUMMED: usize = 1024;

/// C Cᵀ of the columns C.
fn products(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let starts = (0..columns.ncols()).into_par_iter().step_by(SUMMED);
    let sums: Vec<DMatrix<f64>> = starts
        .map(|start| {
            let count = SUMMED.min(columns.ncols() - start);
            let part = columns.columns(start, count);
            part * part.transpose()
        })
        .collect();
    sums.into_iter().sum()
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

/// Light of all ranks that the facets receive from other facets, `[facet][rank][colour]`:
/// x = G ρ (a + x). `direct` is a, `[facet][rank]`.
fn inside(
    visibility: &Visibility,
    sky: &[f64],
    reflectance: &[Vec3],
    direct: &DMatrix<f64>,
) -> Vec<f32> {
    let width = 3 * direct.nrows();
    let mut light = vec![0.0_f32; sky.len() * width];
    let mut sent = light.clone();
    for _ in 0..MOST_BOUNCES {
        let facets = sent.par_chunks_mut(width).zip(light.par_chunks(width));
        facets.enumerate().for_each(|(q, (sent, light))| {
            let reflectance = reflectance[q].to_array();
            let own = direct.column(q);
            let ranks = sent
                .as_chunks_mut::<3>()
                .0
                .iter_mut()
                .zip(light.as_chunks().0);
            for ((sent, light), own) in ranks.zip(own.iter()) {
                let sum = <[f32; 3]>::map(*light, |x| *own as f32 + x);
                *sent = std::array::from_fn(|c| reflectance[c] * sum[c]);
            }
        });
        let received = |(q, light): (usize, &mut [f32])| {
            let hits = &visibility.hits[q * RAYS..][..RAYS];
            let landed = hits.iter().filter(|&&hit| hit != NONE);
            let mut sums = [0.0_f32; 3 * MOST_RANK as usize];
            let sums = &mut sums[..width];
            let add = |sums: &mut [f32], from: usize| {
                let sent = &sent[from * width..][..width];
                sums.iter_mut()
                    .zip(sent)
                    .for_each(|(sum, sent)| *sum += sent);
            };
            landed.clone().for_each(|&hit| add(sums, hit as usize));
            let count = landed.count();
            if count == 0 {
                add(sums, q);
            }
            let weight = (1.0 - sky[q]) as f32 / count.max(1) as f32;
            let (mut change, mut most) = (0.0_f32, 0.0_f32);
            for (light, sum) in light.iter_mut().zip(sums) {
                let next = *sum * weight;
                change = change.max((next - *light).abs());
                most = most.max(next.abs());
                *light = next;
            }
            (change, most)
        };
        let greatest = |a: (f32, f32), b: (f32, f32)| (a.0.max(b.0), a.1.max(b.1));
        let facets = light.par_chunks_mut(width).enumerate();
        let (change, most) = facets.map(received).reduce(|| (0.0, 0.0), greatest);
        if change <= CONVERGED * most {
            break;
        }
    }
    light
}
