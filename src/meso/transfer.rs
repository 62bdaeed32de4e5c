//! The facets' response to light from the sky.

use glam::DVec3;
use rayon::prelude::*;

use super::visibility::Azimuth;
use super::{HeightField, Visibility};
use crate::math::directions::{FINE, FineCell};

/// The facets of a tile with the visibility of the sky, `[facet]`; rows are over the fine cells.
pub(super) struct Facets {
    /// Irradiance for a unit of radiance and solid angle from each fine cell, `[facet][fine cell]`.
    pub(super) transfer: Vec<f32>,
    pub(super) area: Vec<f64>,
    /// Share of a uniform sky's light that arrives at the facet.
    pub(super) sky: Vec<f64>,
    /// Factor that makes the light received from each direction equal to the light that falls on
    /// the tile, `[fine cell]`.
    pub(super) scale: Vec<f32>,
}

/// What facets see of the sky, and how they face it; `[fine cell]`, each part of the cells in a
/// list of its own, so that loops over them run in vectors.
pub(super) struct Sight<'a> {
    /// For [`Visibility::horizons`].
    azimuths: Vec<Azimuth>,
    /// z of the inner rim, and over the height of the cell, 1.
    high: Vec<f32>,
    over_height: Vec<f32>,
    /// Of the middle.
    direction: [Vec<f32>; 3],
    visibility: &'a Visibility,
}

impl<'a> Sight<'a> {
    pub(super) fn new(visibility: &'a Visibility) -> Self {
        let cells: Vec<FineCell> = FineCell::all().collect();
        let of = |value: &dyn Fn(&FineCell) -> f64| -> Vec<f32> {
            cells.iter().map(|cell| value(cell) as f32).collect()
        };
        let azimuth = |c: &FineCell| Azimuth::new(c.direction.y.atan2(c.direction.x));
        Self {
            azimuths: cells.iter().map(azimuth).collect(),
            high: of(&|cell| cell.z_range[1]),
            over_height: of(&|cell| 1.0 / (cell.z_range[1] - cell.z_range[0])),
            direction: [0, 1, 2].map(|axis| of(&|cell| cell.direction[axis])),
            visibility,
        }
    }

    /// Share of each cell that a facet sees, 0..=1.
    pub(super) fn seen(&self, facet: usize, seen: &mut [f32; CELLS]) {
        let kept = self.visibility.horizons(facet);
        for (seen, azimuth) in seen.iter_mut().zip(&self.azimuths) {
            *seen = azimuth.horizon(kept).max(0.0);
        }
        let cells = self.high.iter().zip(&self.over_height);
        for (seen, (high, over_height)) in seen.iter_mut().zip(cells) {
            let horizon = *seen / (1.0 + *seen * *seen).sqrt();
            *seen = ((high - horizon) * over_height).clamp(0.0, 1.0);
        }
    }

    /// Cosine between a normal and each cell, 0 behind it, times what `row` has.
    pub(super) fn times_cosine(&self, normal: DVec3, row: &mut [f32]) {
        let normal = normal.as_vec3();
        let [x, y, z] = &self.direction;
        for (value, ((x, y), z)) in row.iter_mut().zip(x.iter().zip(y).zip(z)) {
            *value *= (normal.x * x + normal.y * y + normal.z * z).max(0.0);
        }
    }
}

/// Fine cells.
pub(super) const CELLS: usize = (FINE * FINE) as usize;
/// Largest factor of the light from one direction: only grazing light, which few facets see, would
/// need a larger one.
const MOST_SCALE: f64 = 4.0;

/// Facets whose rows are summed as one, so that sums do not depend on the number of threads.
const SUMMED: usize = 512;

/// Rows of facets times their areas, summed.
fn sum(rows: &[f32], areas: &[f64]) -> [f64; CELLS] {
    let mut sums = [0.0; CELLS];
    for (row, area) in rows.chunks(CELLS).zip(areas) {
        for (sum, &t) in sums.iter_mut().zip(row) {
            *sum += area * f64::from(t);
        }
    }
    sums
}

impl Facets {
    pub(super) fn new(field: &HeightField, normals: &[DVec3], visibility: &Visibility) -> Self {
        let sight = Sight::new(visibility);
        let cells: Vec<FineCell> = FineCell::all().collect();
        let count = field.facet_count();
        let area: Vec<f64> = (0..count).map(|q| field.facet(q).area).collect();
        let mut transfer = vec![0.0_f32; count * CELLS];
        transfer
            .par_chunks_mut(CELLS)
            .enumerate()
            .for_each(|(q, row)| {
                let mut seen = [0.0; CELLS];
                sight.seen(q, &mut seen);
                row.copy_from_slice(&seen);
                sight.times_cosine(normals[q], row);
            });
        // The light that falls on the tile from each direction must arrive at its facets.
        let tile = 0.5 * field.aspect * count as f64;
        let sums = transfer
            .par_chunks(SUMMED * CELLS)
            .zip(area.par_chunks(SUMMED));
        let sums: Vec<[f64; CELLS]> = sums.map(|(rows, areas)| sum(rows, areas)).collect();
        let mut arriving = [0.0; CELLS];
        for part in &sums {
            arriving
                .iter_mut()
                .zip(part)
                .for_each(|(sum, part)| *sum += part);
        }
        let scale: Vec<f32> = arriving
            .iter()
            .zip(&cells)
            .map(|(sum, cell)| (tile * cell.direction.z / sum.max(1e-300)).min(MOST_SCALE) as f32)
            .collect();
        let heights: f64 = cells.iter().map(|c| c.direction.z).sum();
        let sky = transfer
            .par_chunks_mut(CELLS)
            .map(|row| {
                row.iter_mut().zip(&scale).for_each(|(t, s)| *t *= s);
                (row.iter().map(|&t| f64::from(t)).sum::<f64>() / heights).min(1.0)
            })
            .collect();
        Self {
            transfer,
            area,
            sky,
            scale,
        }
    }
}
