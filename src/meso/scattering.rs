//! The responses of a tile and of its footprints, from what its facets receive and see of each
//! other.
//!
//! Light that leaves a part of the mesh's plane towards ω comes from the facets seen through it:
//! facet q at height h is seen through the place shifted by h tan θ. A footprint's response is
//! therefore W' (1 − ρG)⁻¹ ρ a, where the rows of W are restricted to the facets seen through the
//! footprint and normalised to sum to 1. Light enters at all facets, as if the footprint's
//! neighbours were lit as it is: light that falls on one footprint may leave through another. Under
//! even light the power of the tile is conserved, but not that of each footprint.

use glam::{DVec2, DVec3, Vec3};
use nalgebra::{DMatrix, DMatrixView, DVectorView};
use rayon::prelude::*;

use super::exchange::Exchange;
use super::footprints::Footprints;
use super::response::{Block, Response};
use super::transfer::{CELLS, Facets, Fit};
use super::{HeightField, Visibility};
use crate::math::directions::{Directions, FineCell};

/// Bounces stop when the largest change is this share of the largest value.
const CONVERGED: f32 = 1e-6;
const MOST_BOUNCES: usize = 2_000;
/// Weight of the whole tile that is mixed into the view of a footprint. Where no facet is seen
/// through the footprint, the view is that of the whole tile.
const OF_TILE: f64 = 1e-3;

/// A tile with its internal light solved.
pub struct Scattering<'a> {
    directions: Directions,
    field: &'a HeightField,
    facets: Facets,
    /// (1 − ρG)⁻¹ ρ a: radiosity of the facets for the moment of each slot, one column
    /// `[in][axis][colour]` for each facet.
    lit: DMatrix<f32>,
    /// (1 − ρG)⁻¹ 1: for light that each facet emits, `[facet]`.
    glowing: Vec<Vec3>,
    /// See [`slots_of_cells`].
    looks: DMatrix<f32>,
}

impl Response {
    /// The response of a whole tile by `physical` transport. `reflectance` and the shading normals
    /// are `[facet]`.
    pub fn physical(
        directions: &Directions,
        field: &HeightField,
        visibility: &Visibility,
        normals: &[DVec3],
        reflectance: &[Vec3],
    ) -> Self {
        Scattering::new(directions, field, visibility, normals, reflectance).whole()
    }
}

impl<'a> Scattering<'a> {
    /// `reflectance` and the shading normals are `[facet]`.
    pub fn new(
        directions: &Directions,
        field: &'a HeightField,
        visibility: &Visibility,
        normals: &[DVec3],
        reflectance: &[Vec3],
    ) -> Self {
        let facets = Facets::new(field, normals, visibility);
        let exchange = Exchange::new(visibility, &facets.sky);
        let fit = Fit::new(directions);
        // a, `[facet][in]`.
        let vectors: Vec<Vec3> = facets
            .transfer
            .par_chunks(CELLS)
            .flat_map_iter(|row| fit.apply(row))
            .collect();
        let k = directions.count();
        // `[in][axis]` of `[facet]`
        let columns: Vec<Vec<Vec3>> = (0..3 * k)
            .into_par_iter()
            .map(|column| {
                let vectors = vectors[column / 3..].iter().step_by(k);
                let sent = vectors.zip(reflectance).map(|(v, r)| v[column % 3] * *r);
                bounced(&exchange, sent.collect(), reflectance)
            })
            .collect();
        let mut lit = DMatrix::zeros(9 * k, field.facet_count());
        (lit.as_mut_slice().par_chunks_mut(9 * k).enumerate()).for_each(|(q, facet)| {
            for (at, column) in facet.chunks_exact_mut(3).zip(&columns) {
                at.copy_from_slice(&column[q].to_array());
            }
        });
        let glowing = bounced(&exchange, vec![Vec3::ONE; field.facet_count()], reflectance);
        Self {
            directions: *directions,
            field,
            facets,
            lit,
            glowing,
            looks: slots_of_cells(directions),
        }
    }

    /// The response of the whole tile.
    pub fn whole(&self) -> Response {
        let transfer = DMatrixView::from_slice(&self.facets.transfer, CELLS, self.glowing.len());
        let mut seen = transfer.tr_mul(&self.looks);
        for (mut facet, &area) in seen.row_iter_mut().zip(&self.facets.area) {
            facet *= area as f32;
        }
        for mut out in seen.column_iter_mut() {
            let whole: f64 = out.iter().map(|&s| f64::from(s)).sum();
            out /= whole as f32;
        }
        let emission = self.emission(&seen, 0..self.glowing.len());
        Response::new(&self.directions, &blocks(&(&self.lit * seen)), emission)
    }

    /// The responses of the footprints, `[footprint]`; `tile` is that of the whole tile.
    pub fn of_footprints(&self, footprints: &Footprints, tile: &Response) -> Vec<Response> {
        let k = self.directions.count();
        let seen = self.seen_through(footprints);
        // The facets seen fill the view of a tile, and equally that of a footprint: their densities
        // have the same mean.
        let plane = 0.5 * self.field.aspect * self.field.facet_count() as f64;
        let rest: Vec<f64> = (self.looks.column_iter())
            .map(|looks| {
                let heights = looks.iter().zip(FineCell::all());
                let height: f64 = heights
                    .map(|(&l, cell)| f64::from(l) * cell.direction.z)
                    .sum();
                OF_TILE * plane * height
            })
            .collect();
        let respond = |footprint: usize| {
            let seen = || seen.iter().flat_map(|facets| &facets[footprint]);
            let mut facets: Vec<u32> = seen().map(|s| s.facet).collect();
            facets.dedup();
            let mut lit = DMatrix::zeros(9 * k, facets.len());
            for (mut to, &q) in lit.column_iter_mut().zip(&facets) {
                to.copy_from(&self.lit.column(q as usize));
            }
            // Projected areas, `[fine cell][facet]`.
            let mut areas = DMatrix::zeros(CELLS, facets.len());
            let mut column = 0;
            for s in seen() {
                column += usize::from(facets[column] != s.facet);
                areas[(s.cell as usize, column)] += s.area;
            }
            let mut shares = areas.tr_mul(&self.looks);
            let mut of_tile = vec![0.0; k];
            for (out, mut shares) in shares.column_iter_mut().enumerate() {
                let whole = rest[out] + shares.iter().map(|&s| f64::from(s)).sum::<f64>();
                shares /= whole as f32;
                of_tile[out] = (rest[out] / whole) as f32;
            }
            let facets = facets.iter().map(|&q| q as usize);
            let mut emission = self.emission(&shares, facets);
            let mut columns = blocks(&(lit * shares));
            for (out, column) in columns.iter_mut().enumerate() {
                emission[out] += tile.emission[out] * of_tile[out];
                for (slot, block) in column.iter_mut().enumerate() {
                    for (rows, of_whole) in block.iter_mut().zip(&tile.matrix[slot * k + out]) {
                        *rows += *of_whole * of_tile[out];
                    }
                }
            }
            Response::new(&self.directions, &columns, emission)
        };
        (0..footprints.count())
            .into_par_iter()
            .map(respond)
            .collect()
    }

    /// H of facets with their shares in the view, `[facet][out]`.
    fn emission(
        &self,
        shares: &DMatrix<f32>,
        facets: impl Iterator<Item = usize> + Clone,
    ) -> Vec<Vec3> {
        let of_column = |shares: DVectorView<'_, f32>| {
            let shares = shares.iter().zip(facets.clone());
            shares.map(|(&share, q)| self.glowing[q] * share).sum()
        };
        shares.column_iter().map(of_column).collect()
    }

    /// The facets seen through each footprint, in order: `[part of the facets][footprint]`.
    fn seen_through(&self, footprints: &Footprints) -> Vec<Vec<Vec<Seen>>> {
        // The slope of the view in the field's units of length.
        let slopes: Vec<DVec2> = FineCell::all()
            .map(|cell| cell.direction.truncate() / cell.direction.z)
            .collect();
        (self.facets.transfer)
            .par_chunks(PART * CELLS)
            .enumerate()
            .map(|(part, rows)| {
                let mut seen = vec![Vec::new(); footprints.count()];
                for (i, row) in rows.chunks_exact(CELLS).enumerate() {
                    let q = part * PART + i;
                    let facet = self.field.facet(q);
                    for (cell, (&slope, &transfer)) in slopes.iter().zip(row).enumerate() {
                        if transfer == 0.0 {
                            continue;
                        }
                        for &(f, density) in &footprints.over[footprints.window(&facet, slope)] {
                            seen[f as usize].push(Seen {
                                facet: q as u32,
                                cell: cell as u32,
                                area: transfer * facet.area as f32 * density,
                            });
                        }
                    }
                }
                seen
            })
            .collect()
    }
}

/// Facets per task of a thread.
const PART: usize = 512;

/// A facet seen through a footprint from a fine cell.
#[derive(Clone, Copy)]
struct Seen {
    facet: u32,
    cell: u32,
    /// Projected area.
    area: f32,
}

/// Weight of each slot in a bilinear look-up at each fine cell, `[fine cell][slot]`.
fn slots_of_cells(directions: &Directions) -> DMatrix<f32> {
    let mut looks = DMatrix::zeros(CELLS, directions.count());
    for (i, cell) in FineCell::all().enumerate() {
        for (slot, weight) in directions.bilinear(cell.direction) {
            looks[(i, slot)] += weight as f32;
        }
    }
    looks
}

/// Turns columns `[in][axis][colour]` into blocks, `[in][out]`.
fn blocks(sums: &DMatrix<f32>) -> Vec<Vec<Block>> {
    let column = |sums: DVectorView<'_, f32>| -> Vec<Block> {
        (sums.as_slice().chunks_exact(9))
            .map(|by_axis| [0, 1, 2].map(|c| Vec3::new(by_axis[c], by_axis[3 + c], by_axis[6 + c])))
            .collect()
    };
    sums.column_iter().map(column).collect()
}

/// Radiosity B of the facets with all bounces inside the relief, for their initial radiosity b: B =
/// b + ρ G B.
fn bounced(exchange: &Exchange, first: Vec<Vec3>, reflectance: &[Vec3]) -> Vec<Vec3> {
    let mut total = first.clone();
    let mut bounce = first;
    let mut highest = total
        .iter()
        .map(|v| v.abs().max_element())
        .fold(0.0, f32::max);
    for _ in 0..MOST_BOUNCES {
        let mut next = vec![Vec3::ZERO; total.len()];
        for (hit, sent) in bounce.iter().enumerate() {
            for &(to, weight) in exchange.to(hit) {
                next[to as usize] += *sent * weight;
            }
        }
        let mut change = 0.0_f32;
        for ((b, reflectance), total) in next.iter_mut().zip(reflectance).zip(&mut total) {
            *b *= *reflectance;
            *total += *b;
            change = change.max(b.abs().max_element());
            highest = highest.max(total.abs().max_element());
        }
        bounce = next;
        if change <= CONVERGED * highest {
            break;
        }
    }
    total
}
