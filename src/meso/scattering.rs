//! From what the facets of a tile take and see of each other to the response of the tile and of its footprints.
//!
//! What leaves through a part of the mesh's plane towards ω comes from the facets that are seen through it: facet q at
//! height h through the place h tan θ aside. A footprint's response is therefore W' (1 − ρG)⁻¹ ρ a with the rows of W cut to
//! the footprint, window by window, and made to sum to 1 again. Light enters at all facets, as if the footprint's
//! neighbours were lit as it is: what falls on one footprint may leave by another, and the power of a tile under even
//! light is kept, not that of each footprint.

use glam::{DVec2, DVec3, Vec3};
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
    reflectance: &'a [Vec3],
    facets: Facets,
    exchange: Exchange,
    /// a, `[facet][in]`.
    vectors: Vec<Vec3>,
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
        reflectance: &'a [Vec3],
    ) -> Self {
        let facets = Facets::new(field, normals, visibility);
        let fit = Fit::new(directions);
        Self {
            directions: *directions,
            field,
            reflectance,
            vectors: facets
                .transfer
                .par_chunks(CELLS)
                .flat_map_iter(|row| fit.apply(row))
                .collect(),
            exchange: Exchange::new(visibility, &facets.sky),
            facets,
            looks: slots_of_cells(directions),
        }
    }

    /// Of the whole tile.
    pub fn whole(&self) -> Response {
        let k = self.directions.count();
        let columns: Vec<(Vec<Block>, Vec3)> = (0..k)
            .into_par_iter()
            .map(|out| {
                let seen = self.seen_from(out);
                let weights = gathered(&self.exchange, &seen, self.reflectance);
                let mut column = vec![[Vec3::ZERO; 3]; k];
                let mut emission = Vec3::ZERO;
                for (q, &weight) in weights.iter().enumerate() {
                    emission += weight;
                    let sent = weight * self.reflectance[q];
                    for (block, v) in column.iter_mut().zip(&self.vectors[q * k..]) {
                        for c in 0..3 {
                            block[c] += sent[c] * *v;
                        }
                    }
                }
                (column, emission)
            })
            .collect();
        Response::new(&self.directions, &columns)
    }

    /// `[footprint]`; `tile` is the response of the whole.
    pub fn of_footprints(&self, footprints: &Footprints, tile: &Response) -> Vec<Response> {
        let k = self.directions.count();
        // (1 − ρG)⁻¹ of the columns of ρ a, `[in][axis][facet]`, and of 1: all footprints have them in common.
        let lit: Vec<Vec<Vec3>> = (0..3 * k)
            .into_par_iter()
            .map(|column| {
                let vectors = self.vectors[column / 3..].iter().step_by(k);
                let sent = vectors
                    .zip(self.reflectance)
                    .map(|(v, r)| v[column % 3] * *r);
                bounced(&self.exchange, sent.collect(), self.reflectance)
            })
            .collect();
        // `[facet][in][axis][colour]`: what sums over facets reads lies side by side.
        let width = 9 * k;
        let mut rows = vec![0.0_f32; width * self.field.facet_count()];
        rows.par_chunks_mut(width).enumerate().for_each(|(q, row)| {
            for (at, column) in row.chunks_exact_mut(3).zip(&lit) {
                at.copy_from_slice(&column[q].to_array());
            }
        });
        drop(lit);
        let glowing = bounced(
            &self.exchange,
            vec![Vec3::ONE; self.field.facet_count()],
            self.reflectance,
        );
        // `[out][footprint]`
        let columns: Vec<Vec<(Vec<Block>, Vec3)>> = (0..k)
            .into_par_iter()
            .map(|out| {
                let mut sums = vec![0.0_f32; width];
                let column = |seen: &Seen| {
                    sums.fill(0.0);
                    for &(q, share) in &seen.facets {
                        let row = &rows[q as usize * width..][..width];
                        for (sum, lit) in sums.iter_mut().zip(row) {
                            *sum += lit * share;
                        }
                    }
                    let column = sums
                        .chunks_exact(9)
                        .enumerate()
                        .map(|(slot, by_axis)| {
                            let of_tile = &tile.matrix[slot * k + out];
                            [0, 1, 2].map(|c| {
                                Vec3::new(by_axis[c], by_axis[3 + c], by_axis[6 + c])
                                    + of_tile[c] * seen.of_tile
                            })
                        })
                        .collect();
                    let facets = seen.facets.iter();
                    let glow: Vec3 = facets.map(|&(q, share)| glowing[q as usize] * share).sum();
                    (column, glow + tile.emission[out] * seen.of_tile)
                };
                self.seen_through(footprints, out)
                    .iter()
                    .map(column)
                    .collect()
            })
            .collect();
        (0..footprints.count())
            .map(|f| {
                let columns: Vec<_> = columns.iter().map(|of| of[f].clone()).collect();
                Response::new(&self.directions, &columns)
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

    /// The same of each footprint, `[footprint]`.
    fn seen_through(&self, footprints: &Footprints, slot: usize) -> Vec<Seen> {
        let mut seen: Vec<Vec<(u32, f32)>> = vec![Vec::new(); footprints.count()];
        let mut of_facet = vec![0.0_f32; footprints.count()];
        let mut touched = Vec::new();
        let cells: Vec<FineCell> = FineCell::all().collect();
        // With the slope of the view in the field's lengths.
        let looks: Vec<(usize, f32, DVec2)> = self.looks[slot]
            .iter()
            .map(|&(i, weight)| {
                let d = cells[i].direction;
                (i, weight, DVec2::new(d.x, d.y) / d.z)
            })
            .collect();
        for (q, row) in self.facets.transfer.chunks_exact(CELLS).enumerate() {
            let facet = self.field.facet(q);
            for &(i, weight, slope) in &looks {
                let projected = weight * row[i] * facet.area as f32;
                if projected <= 0.0 {
                    continue;
                }
                for &(f, density) in &footprints.over[footprints.window(&facet, slope)] {
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
        let heights = looks
            .iter()
            .map(|&(i, weight, _)| f64::from(weight) * cells[i].direction.z);
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
