//! From what the facets of a tile take and see of each other to the response of the tile and of its footprints.
//!
//! What leaves through a part of the mesh's plane towards ω comes from the facets that are seen through it: facet q at
//! height h through the place h tan θ aside. A footprint's response is therefore W' (1 − ρG)⁻¹ ρ a with the rows of W cut to
//! the footprint, window by window, and made to sum to 1 again. Light enters at all facets, as if the footprint's
//! neighbours were lit as it is: what falls on one footprint may leave by another, and the power of a tile under even
//! light is kept, not that of each footprint.

use glam::{DVec2, DVec3, Vec3};
use nalgebra::{DMatrix, DVectorView};
use rayon::prelude::*;

use super::exchange::Exchange;
use super::footprints::Footprints;
use super::response::{Block, Response};
use super::transfer::{CELLS, Facets, Fit};
use super::{HeightField, Visibility};
use crate::directions::{Directions, FineCell};

/// Bounces stop when the largest change is this share of the largest value.
const CONVERGED: f32 = 1e-6;
const MOST_BOUNCES: usize = 2_000;
/// Share of the whole tile in what is seen of a footprint: all of it where no facet is seen through the footprint.
const OF_TILE: f64 = 1e-3;

/// A tile ready to respond.
pub struct Scattering<'a> {
    directions: Directions,
    field: &'a HeightField,
    facets: Facets,
    /// (1 − ρG)⁻¹ ρ a: radiosity of the facets for the moment of each slot, a column for each facet of `[in][axis][colour]`.
    lit: DMatrix<f32>,
    /// (1 − ρG)⁻¹ 1: for light that each facet emits, `[facet]`.
    glowing: Vec<Vec3>,
    /// For each slot, the fine cells that a bilinear look-up takes from it, with their weights.
    looks: Vec<Vec<(usize, f32)>>,
}

impl<'a> Scattering<'a> {
    /// `reflectance` and the normals that shade are given `[facet]`.
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

    /// Of the whole tile.
    pub fn whole(&self) -> Response {
        let k = self.directions.count();
        let seen: Vec<Vec<f32>> = (0..k)
            .into_par_iter()
            .map(|out| self.seen_from(out))
            .collect();
        let emission = seen.iter().map(|shares| {
            let glowing = self.glowing.iter().zip(shares);
            glowing.map(|(glow, &share)| *glow * share).sum()
        });
        let emission = emission.collect();
        let seen = DMatrix::from_iterator(self.glowing.len(), k, seen.into_iter().flatten());
        Response::new(&self.directions, &blocks(&(&self.lit * seen)), emission)
    }

    /// `[footprint]`; `tile` is the response of the whole.
    pub fn of_footprints(&self, footprints: &Footprints, tile: &Response) -> Vec<Response> {
        if footprints.count() == 0 {
            return Vec::new();
        }
        let k = self.directions.count();
        let windows = self.windows(footprints);
        // `[out][footprint]`
        let seen: Vec<Vec<Seen>> = (0..k)
            .into_par_iter()
            .map(|out| self.seen_through(footprints, &windows, out))
            .collect();
        let respond = |footprint: usize| {
            let seen: Vec<&Seen> = seen.iter().map(|of| &of[footprint]).collect();
            // From one direction or another.
            let mut facets: Vec<u32> = (seen.iter())
                .flat_map(|seen| seen.facets.iter().map(|s| s.0))
                .collect();
            facets.sort_unstable();
            facets.dedup();
            let mut lit = DMatrix::zeros(9 * k, facets.len());
            let mut shares = DMatrix::zeros(facets.len(), k);
            for (mut to, &q) in lit.column_iter_mut().zip(&facets) {
                to.copy_from(&self.lit.column(q as usize));
            }
            let mut emission = Vec::with_capacity(k);
            for (out, seen) in seen.iter().enumerate() {
                let mut row = 0;
                let mut glow = tile.emission[out] * seen.of_tile;
                for &(q, share) in &seen.facets {
                    row += facets[row..].partition_point(|&facet| facet < q);
                    shares[(row, out)] = share;
                    glow += self.glowing[q as usize] * share;
                }
                emission.push(glow);
            }
            let mut columns = blocks(&(lit * shares));
            for (out, column) in columns.iter_mut().enumerate() {
                for (slot, block) in column.iter_mut().enumerate() {
                    for (rows, of_tile) in block.iter_mut().zip(&tile.matrix[slot * k + out]) {
                        *rows += *of_tile * seen[out].of_tile;
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

    /// Through which cell of the mesh's plane each facet is seen from each fine cell, `[facet][fine cell]`.
    fn windows(&self, footprints: &Footprints) -> Vec<u32> {
        // With the slope of the view in the field's lengths.
        let slopes: Vec<DVec2> = FineCell::all()
            .map(|cell| cell.direction.truncate() / cell.direction.z)
            .collect();
        (0..self.field.facet_count())
            .into_par_iter()
            .flat_map_iter(|q| {
                let facet = self.field.facet(q);
                (slopes.iter()).map(move |&slope| footprints.window(&facet, slope) as u32)
            })
            .collect()
    }

    /// W of one slot: the share of each facet in what is seen from its directions.
    fn seen_from(&self, slot: usize) -> Vec<f32> {
        let mut seen: Vec<f64> = self
            .facets
            .transfer
            .chunks_exact(CELLS)
            .zip(&self.facets.area)
            .map(|(row, area)| {
                let looks = self.looks[slot].iter();
                let sum: f32 = looks.map(|&(i, weight)| weight * row[i]).sum();
                area * f64::from(sum)
            })
            .collect();
        let sum: f64 = seen.iter().sum();
        seen.iter_mut().for_each(|s| *s /= sum);
        seen.into_iter().map(|s| s as f32).collect()
    }

    /// The same of each footprint, `[footprint]`, their facets in order.
    fn seen_through(&self, footprints: &Footprints, windows: &[u32], slot: usize) -> Vec<Seen> {
        let mut seen: Vec<Vec<(u32, f32)>> = vec![Vec::new(); footprints.count()];
        let mut of_facet = vec![0.0_f32; footprints.count()];
        let mut touched = Vec::new();
        let rows = self.facets.transfer.chunks_exact(CELLS);
        for (q, (row, windows)) in rows.zip(windows.chunks_exact(CELLS)).enumerate() {
            let area = self.facets.area[q] as f32;
            for &(i, weight) in &self.looks[slot] {
                let projected = weight * row[i] * area;
                if projected <= 0.0 {
                    continue;
                }
                for &(f, density) in &footprints.over[windows[i] as usize] {
                    if of_facet[f as usize] == 0.0 {
                        touched.push(f);
                    }
                    of_facet[f as usize] += projected * density;
                }
            }
            for f in touched.drain(..) {
                seen[f as usize].push((q as u32, of_facet[f as usize]));
                of_facet[f as usize] = 0.0;
            }
        }
        // What fills the view of a tile fills that of a footprint: their densities have the same mean.
        let plane = 0.5 * self.field.aspect * self.field.facet_count() as f64;
        let cells: Vec<FineCell> = FineCell::all().collect();
        let looks = self.looks[slot].iter();
        let heights = looks.map(|&(i, weight)| f64::from(weight) * cells[i].direction.z);
        let rest = OF_TILE * plane * heights.sum::<f64>();
        seen.into_iter()
            .map(|mut facets| {
                let whole = rest + facets.iter().map(|s| f64::from(s.1)).sum::<f64>();
                for (_, share) in &mut facets {
                    *share = (f64::from(*share) / whole) as f32;
                }
                Seen {
                    facets,
                    of_tile: (rest / whole) as f32,
                }
            })
            .collect()
    }
}

/// What is seen of a footprint: facets with their shares, and the share of the whole tile. They sum to 1.
struct Seen {
    facets: Vec<(u32, f32)>,
    of_tile: f32,
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

/// Columns of sums over `[in][axis][colour]`, as blocks: `[out]` of `[in]`.
fn blocks(sums: &DMatrix<f32>) -> Vec<Vec<Block>> {
    let column = |sums: DVectorView<'_, f32>| -> Vec<Block> {
        (sums.as_slice().chunks_exact(9))
            .map(|by_axis| [0, 1, 2].map(|c| Vec3::new(by_axis[c], by_axis[3 + c], by_axis[6 + c])))
            .collect()
    };
    sums.column_iter().map(column).collect()
}

/// Radiosity of the facets with all bounces inside the relief, for what they send at first: B = b + ρ G B.
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
