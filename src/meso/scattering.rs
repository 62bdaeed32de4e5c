//! The responses of a tile and of its footprints, from what its facets receive and see of each
//! other.
//!
//! Light that leaves a part of the mesh's plane towards ω comes from the facets seen through it:
//! facet q at height h is seen through the place shifted by h tan θ. A footprint's response is
//! therefore W' (1 − ρG)⁻¹ ρ E(ω), where the rows of W are restricted to the facets seen through
//! the footprint and normalised to sum to 1. Light enters at all facets, as if the footprint's
//! neighbours were lit as it is: light that falls on one footprint may leave through another. Under
//! even light the power of the tile is conserved, but not that of each footprint.
//!
//! Few facets are seen through a footprint, so that its response depends on the direction of the
//! light in its own way: each has a basis of its own. Only light that has bounced inside the relief
//! is found by the basis of the tile.

use glam::{DVec2, DVec3, Vec3};
use nalgebra::{DMatrix, DMatrixView, DVectorView};
use rayon::prelude::*;

use super::basis::{Basis, RANK};
use super::exchange::Exchange;
use super::footprints::Footprints;
use super::response::Response;
use super::transfer::{CELLS, Facets};
use super::{HeightField, Visibility};
use crate::math::directions::{Directions, FineCell};

/// Bounces stop when the largest change is this share of the largest value.
const CONVERGED: f32 = 1e-6;
const MOST_BOUNCES: usize = 2_000;
/// Weight of the whole tile that is mixed into the view of a footprint. Where no facet is seen
/// through the footprint, the view is that of the whole tile.
const OF_TILE: f64 = 1e-3;
/// Slots that a basis is found from: how light leaves need not be known finely to know which
/// directions it comes from differ.
const COARSE: Directions = Directions {
    columns: 8,
    rows: 8,
};
/// Columns of the three colours, `[rank][colour]`.
const COLOURS: usize = 3 * RANK;

/// A tile with its internal light solved.
pub struct Scattering<'a> {
    directions: Directions,
    field: &'a HeightField,
    reflectance: &'a [Vec3],
    facets: Facets,
    /// Of the tile.
    basis: Basis,
    /// Over the mean of each colour, `[facet]`: how colours differ from place to place, not which
    /// is the strongest, matters to a basis.
    relative: Vec<Vec3>,
    /// One over that mean.
    over_mean: Vec3,
    /// Radiosity of the facets for each coefficient, straight and after bounces inside the relief:
    /// one column `[rank][colour]` for each facet.
    straight: DMatrix<f32>,
    bounced: DMatrix<f32>,
    /// (1 − ρG)⁻¹ 1: for light that each facet emits, `[facet]`.
    glowing: Vec<Vec3>,
    /// See [`fits`].
    fits: DMatrix<f32>,
    coarse_fits: DMatrix<f32>,
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
        reflectance: &'a [Vec3],
    ) -> Self {
        let facets = Facets::new(field, normals, visibility);
        let exchange = Exchange::new(visibility, &facets.sky);
        let coarse_fits = fits(&COARSE);
        let seen = seen(&facets, &coarse_fits);
        let mean = reflectance.iter().sum::<Vec3>() / reflectance.len() as f32;
        let over_mean = Vec3::select(mean.cmpgt(Vec3::ZERO), mean.recip(), Vec3::ZERO);
        let relative: Vec<Vec3> = reflectance.iter().map(|&r| r * over_mean).collect();
        let basis = Basis::of(sent_from_cells(&facets, &seen, &relative));
        let straight = straight(&facets.transfer, &basis, reflectance);
        let mut bounces = straight.clone();
        // `[rank]` of `[facet]`
        let columns: Vec<Vec<Vec3>> = (0..RANK)
            .into_par_iter()
            .map(|r| {
                let colours = straight.rows(3 * r, 3);
                let first: Vec<Vec3> = (colours.column_iter())
                    .map(|c| Vec3::new(c[0], c[1], c[2]))
                    .collect();
                bounced(&exchange, first, reflectance)
            })
            .collect();
        for (r, column) in columns.iter().enumerate() {
            for (q, all) in column.iter().enumerate() {
                for c in 0..3 {
                    bounces[(3 * r + c, q)] = all[c] - straight[(3 * r + c, q)];
                }
            }
        }
        let glowing = bounced(&exchange, vec![Vec3::ONE; field.facet_count()], reflectance);
        Self {
            directions: *directions,
            field,
            reflectance,
            facets,
            basis,
            relative,
            over_mean,
            straight,
            bounced: bounces,
            glowing,
            fits: fits(directions),
            coarse_fits,
        }
    }

    /// The response of the whole tile.
    pub fn whole(&self) -> Response {
        let seen = seen(&self.facets, &self.fits);
        let matrix = (&self.straight + &self.bounced) * &seen;
        let emission = self.emission(&seen, 0..self.glowing.len());
        Response::new(
            &self.directions,
            self.basis.clone(),
            rows(&matrix),
            emission,
        )
    }

    /// The responses of the footprints, `[footprint]`; `tile` is that of the whole tile.
    pub fn of_footprints(&self, footprints: &Footprints, tile: &Response) -> Vec<Response> {
        let seen = self.seen_through(footprints);
        (0..footprints.count())
            .into_par_iter()
            .map(|footprint| self.of_footprint(&seen, footprint, tile))
            .collect()
    }

    /// `seen` are the facets that each part of them lists for the footprints, see
    /// [`Self::seen_through`].
    fn of_footprint(&self, seen: &[Vec<Vec<Seen>>], footprint: usize, tile: &Response) -> Response {
        let Some(view) = self.view(seen, footprint) else {
            return tile.clone();
        };
        // Of the facets that are seen: what they receive from each fine cell, and their light after
        // bounces.
        let transfer = DMatrixView::from_slice(&self.facets.transfer, CELLS, self.glowing.len());
        let transfer = transfer.select_columns(&view.facets);
        let bounced = self.bounced.select_columns(&view.facets);
        let basis = self.basis_of(&view, &transfer, &bounced);
        let reflectance: Vec<Vec3> = view.facets.iter().map(|&q| self.reflectance[q]).collect();
        let from_tile = self.basis.product(&basis);
        let lit =
            straight(transfer.as_slice(), &basis, &reflectance) + turned(&bounced, &from_tile);
        let (seen, of_tile) = (&view.areas * &self.fits, &view.of_tile * &self.fits);
        let mut matrix = lit * &seen;
        let k = self.directions.count();
        let mut whole = DMatrix::zeros(COLOURS, k);
        for (i, sent) in tile.matrix.iter().enumerate() {
            (0..3).for_each(|c| whole[(3 * (i / k) + c, i % k)] = sent[c]);
        }
        let whole = turned(&whole, &from_tile);
        let mut emission = self.emission(&seen, view.facets.iter().copied());
        for (out, &share) in of_tile.iter().enumerate() {
            emission[out] += tile.emission[out] * share;
            (0..COLOURS).for_each(|row| matrix[(row, out)] += whole[(row, out)] * share);
        }
        Response::new(&self.directions, basis, rows(&matrix), emission)
    }

    /// What is seen through a footprint; None where nothing is.
    fn view(&self, seen: &[Vec<Vec<Seen>>], footprint: usize) -> Option<View> {
        let seen = || seen.iter().flat_map(|facets| &facets[footprint]);
        let mut facets: Vec<usize> = seen().map(|s| s.facet as usize).collect();
        facets.dedup();
        // Projected areas, `[fine cell][facet]`, and their sums with the share of the whole tile.
        let mut areas = DMatrix::zeros(CELLS, facets.len());
        let plane = 0.5 * self.field.aspect * self.field.facet_count() as f64;
        let of_tile: Vec<f64> = FineCell::all()
            .map(|cell| OF_TILE * plane * cell.direction.z)
            .collect();
        let mut whole = of_tile.clone();
        let mut column = 0;
        for s in seen() {
            column += usize::from(facets[column] != s.facet as usize);
            areas[(s.cell as usize, column)] += s.area;
            whole[s.cell as usize] += f64::from(s.area);
        }
        let scales: Vec<f32> = (FineCell::all().zip(&whole))
            .map(|(cell, whole)| (cell.direction.z / whole) as f32)
            .collect();
        for column in areas.as_mut_slice().chunks_exact_mut(CELLS) {
            let areas = column.iter_mut().zip(&scales);
            areas.for_each(|(area, scale)| *area *= scale);
        }
        let shares = of_tile.iter().zip(&scales);
        let of_tile = shares.map(|(&of_tile, scale)| of_tile as f32 * scale);
        (!facets.is_empty()).then(|| View {
            facets,
            areas: areas.transpose(),
            of_tile: DMatrix::from_iterator(1, CELLS, of_tile),
        })
    }

    /// The basis of a footprint. `transfer` is `[fine cell]` and `bounced` `[rank][colour]`, one
    /// column for each facet that is seen.
    fn basis_of(&self, view: &View, transfer: &DMatrix<f32>, bounced: &DMatrix<f32>) -> Basis {
        let seen = &view.areas * &self.coarse_fits;
        let relative: Vec<Vec3> = view.facets.iter().map(|&q| self.relative[q]).collect();
        let mut sent = (transfer * reflected(&seen, &relative)).transpose();
        for (mut column, cell) in sent.column_iter_mut().zip(FineCell::all()) {
            column /= cell.direction.z as f32;
        }
        let bounced = bounced * seen;
        let of_slots = DMatrix::from_fn(RANK, COARSE.count(), |r, out| {
            bounced[(3 * r + out % 3, out)] * self.over_mean[out % 3]
        });
        sent += of_slots.transpose() * self.basis.matrix();
        Basis::of(sent.cast())
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

/// Weights of the fine cells by which each slot is fitted, `[fine cell][slot]`: light f(ω) is Σ_j
/// f_j h_j(ω) with h_j the weights of the bilinear look-up, and f_j = Σ_i fits_ij z_i f(ω_i) are
/// the values closest to it under the weights z. The power Σ_i z_i f(ω_i) stays. A mean over the
/// directions that look a slot up would blur f by as much as the look-up does again.
fn fits(directions: &Directions) -> DMatrix<f32> {
    let k = directions.count();
    let mut looks = DMatrix::<f64>::zeros(CELLS, k);
    for (i, cell) in FineCell::all().enumerate() {
        for (slot, weight) in directions.bilinear(cell.direction) {
            looks[(i, slot)] += weight;
        }
    }
    let mut weighted = looks.clone();
    for (mut row, cell) in weighted.row_iter_mut().zip(FineCell::all()) {
        row *= cell.direction.z;
    }
    let normal = looks.tr_mul(&weighted);
    let inverse = normal.cholesky().map(|of| of.inverse());
    (looks * inverse.expect("every slot is looked up by directions of its own")).cast()
}

/// Shares W of the facets in each slot, `[facet][slot]`; those of a slot sum to 1.
fn seen(facets: &Facets, fits: &DMatrix<f32>) -> DMatrix<f32> {
    let transfer = DMatrixView::from_slice(&facets.transfer, CELLS, facets.area.len());
    let mut seen = DMatrix::zeros(facets.area.len(), fits.ncols());
    let parts: Vec<DMatrix<f32>> = (0..facets.area.len())
        .into_par_iter()
        .step_by(PART)
        .map(|first| {
            let count = PART.min(facets.area.len() - first);
            transfer.columns(first, count).transpose() * fits
        })
        .collect();
    for (part, of) in parts.iter().enumerate() {
        seen.rows_mut(part * PART, of.nrows()).copy_from(of);
    }
    for mut out in seen.column_iter_mut() {
        let mut whole = 0.0;
        for (share, &area) in out.iter_mut().zip(&facets.area) {
            *share *= area as f32;
            whole += f64::from(*share);
        }
        out /= whole as f32;
    }
    seen
}

/// What is seen through a footprint from the fine cells.
struct View {
    /// In order.
    facets: Vec<usize>,
    /// Their projected areas, and the share of the whole tile that is mixed in, `[facet][fine
    /// cell]` and `[fine cell]`: together the z of the cell.
    areas: DMatrix<f32>,
    of_tile: DMatrix<f32>,
}

/// Shares of facets, `[facet][slot]`, times their reflectance: each slot takes one colour, all
/// three in turn, so that a basis knows them all.
fn reflected(seen: &DMatrix<f32>, reflectance: &[Vec3]) -> DMatrix<f32> {
    let mut reflected = seen.clone();
    for (slot, mut column) in reflected.column_iter_mut().enumerate() {
        let shares = column.iter_mut().zip(reflectance);
        shares.for_each(|(share, of)| *share *= of[slot % 3]);
    }
    reflected
}

/// Light that leaves for an irradiance of 1 from each fine cell, without bounces inside the relief,
/// `[slot][fine cell]`. `seen` is `[facet][slot]` and `reflectance` `[facet]`.
fn sent_from_cells(facets: &Facets, seen: &DMatrix<f32>, reflectance: &[Vec3]) -> DMatrix<f64> {
    let transfer = DMatrixView::from_slice(&facets.transfer, CELLS, reflectance.len());
    let parts: Vec<DMatrix<f32>> = (0..reflectance.len())
        .into_par_iter()
        .step_by(PART)
        .map(|first| {
            let count = PART.min(reflectance.len() - first);
            let seen = seen.rows(first, count).into_owned();
            transfer.columns(first, count) * reflected(&seen, &reflectance[first..])
        })
        .collect();
    let mut sent: DMatrix<f64> = DMatrix::zeros(CELLS, seen.ncols());
    for part in parts {
        sent += part.cast::<f64>();
    }
    for (mut row, cell) in sent.row_iter_mut().zip(FineCell::all()) {
        row /= cell.direction.z;
    }
    sent.transpose()
}

/// Radiosity of facets that reflect what they receive straight, one column `[rank][colour]` for
/// each facet. `transfer` is `[facet][fine cell]`.
fn straight(transfer: &[f32], basis: &Basis, reflectance: &[Vec3]) -> DMatrix<f32> {
    let heights: f64 = FineCell::all().map(|cell| cell.direction.z).sum();
    let basis = basis.matrix() / heights as f32;
    let mut lit = DMatrix::zeros(COLOURS, reflectance.len());
    (lit.as_mut_slice().par_chunks_mut(COLOURS * PART))
        .zip(transfer.par_chunks(CELLS * PART))
        .zip(reflectance.par_chunks(PART))
        .for_each(|((lit, transfer), reflectance)| {
            let received = &basis * DMatrixView::from_slice(transfer, CELLS, reflectance.len());
            let facets = lit.chunks_exact_mut(COLOURS).zip(received.column_iter());
            for ((lit, received), reflectance) in facets.zip(reflectance) {
                for (lit, &of) in lit.chunks_exact_mut(3).zip(received.iter()) {
                    lit.copy_from_slice(&(*reflectance * of).to_array());
                }
            }
        });
    lit
}

/// Columns `[rank][colour]` by the functions of another basis; `product` is
/// [`Basis::product`] with it.
fn turned(columns: &DMatrix<f32>, product: &DMatrix<f32>) -> DMatrix<f32> {
    let mut turned = DMatrix::zeros(COLOURS, columns.ncols());
    for c in 0..3 {
        let of_colour = columns.rows_with_step(c, RANK, 2);
        let product = product.transpose() * of_colour;
        turned.rows_with_step_mut(c, RANK, 2).copy_from(&product);
    }
    turned
}

/// R, `[rank][out]`, from columns `[rank][colour]` for each direction out.
fn rows(matrix: &DMatrix<f32>) -> Vec<Vec3> {
    (0..RANK)
        .flat_map(|r| {
            (matrix.column_iter())
                .map(move |out| Vec3::new(out[3 * r], out[3 * r + 1], out[3 * r + 2]))
        })
        .collect()
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
