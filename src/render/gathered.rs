//! Samples gathered into pixels, tile by tile.

use glam::Vec3A;
use rayon::prelude::*;

use crate::picture::{self, Picture, SAMPLES, Samples, Tile, tone};

/// A pixel keeps its samples if a channel's lowest is below this share of its highest. Otherwise
/// the tone curve is so nearly linear over them that their mean gives the same code.
const CONTRAST: f32 = 0.8;

/// The part of a picture drawn so far.
pub struct Gathered {
    width: u32,
    height: u32,
    /// Samples drawn along a pixel's side, a multiple of SAMPLES.
    samples: u32,
    radiance: Vec<[f32; 3]>,
    contrasts: Vec<(u32, Samples)>,
    /// Luminance of the metered pixels.
    metered: Vec<f32>,
}

/// What is kept of a row of pixels beside their radiance.
#[derive(Default)]
struct Kept {
    contrasts: Vec<(u32, Samples)>,
    metered: Vec<f32>,
}

impl Gathered {
    pub fn new((width, height): (u32, u32), samples: u32) -> Self {
        Self {
            width,
            height,
            samples,
            radiance: vec![[0.0; 3]; width as usize * height as usize],
            contrasts: Vec::new(),
            metered: Vec::new(),
        }
    }

    /// Adds a tile's samples, in rows of `stride`.
    pub fn add(&mut self, tile: Tile, samples: &[[f32; 4]], stride: usize) {
        let side = self.samples as usize;
        let first = (tile.row * self.width) as usize;
        let rows = self.radiance[first..].par_chunks_mut(self.width as usize);
        let rows = rows.zip(samples.par_chunks(side * stride)).enumerate();
        let kept = rows
            .take(tile.height as usize)
            .map(|(row, (radiance, samples))| {
                let start = (tile.row + row as u32) * self.width + tile.column;
                let mut kept = Kept::default();
                let pixels = radiance[tile.column as usize..].iter_mut().zip(start..);
                for (column, (mean, place)) in pixels.take(tile.width as usize).enumerate() {
                    let drawn = |y: usize, x: usize| samples[y * stride + column * side + x];
                    let (samples, metered) = resolved(side, drawn);
                    *mean = picture::mean(&samples);
                    if metered {
                        kept.metered.push(tone::luminance(*mean));
                    }
                    if contrasts(&samples) {
                        kept.contrasts.push((place, samples));
                    }
                }
                kept
            });
        for mut kept in kept.collect::<Vec<_>>() {
            self.metered.append(&mut kept.metered);
            self.contrasts.append(&mut kept.contrasts);
        }
    }

    /// The tile that was added last as a picture of its own, not metered.
    #[cfg(feature = "window")]
    pub fn last(&self, tile: Tile) -> Picture {
        let columns = tile.column..tile.column + tile.width;
        let rows = tile.row..tile.row + tile.height;
        let row = |row: u32| {
            let start = (row * self.width) as usize;
            &self.radiance[start + columns.start as usize..start + columns.end as usize]
        };
        let within = |place: u32| {
            let (column, row) = (place % self.width, place / self.width);
            let inside = columns.contains(&column) && rows.contains(&row);
            inside.then(|| (row - tile.row) * tile.width + column - tile.column)
        };
        let latest = self.contrasts.iter().rev();
        let contrasts = latest.map_while(|(place, samples)| Some((within(*place)?, *samples)));
        Picture {
            width: tile.width,
            height: tile.height,
            radiance: rows.clone().flat_map(row).copied().collect(),
            automatic_exposure: 0.0,
            contrasts: contrasts.collect(),
        }
    }

    pub fn into_picture(mut self) -> Picture {
        self.contrasts.par_sort_unstable_by_key(|c| c.0);
        Picture {
            width: self.width,
            height: self.height,
            radiance: self.radiance,
            automatic_exposure: picture::automatic_exposure(&mut self.metered),
            contrasts: self.contrasts,
        }
    }
}

/// The samples of a pixel that is `drawn` by row and column with `side` along a side, and whether
/// all of it is metered.
fn resolved(side: usize, drawn: impl Fn(usize, usize) -> [f32; 4]) -> (Samples, bool) {
    const KEPT: usize = SAMPLES as usize;
    let each = side / KEPT;
    let share = 1.0 / (each * each) as f32;
    let mut metered = true;
    let samples = std::array::from_fn(|i| {
        let mut sum = [0.0; 3];
        for k in 0..each * each {
            let (y, x) = (i / KEPT * each + k / each, i % KEPT * each + k % each);
            let [r, g, b, is_metered] = drawn(y, x);
            sum = [sum[0] + r, sum[1] + g, sum[2] + b];
            metered &= is_metered > 0.5;
        }
        sum.map(|c| c * share)
    });
    (samples, metered)
}

/// Whether the samples differ by more than [`CONTRAST`].
fn contrasts(samples: &Samples) -> bool {
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::ZERO);
    for sample in samples {
        let sample = Vec3A::from(*sample);
        (low, high) = (low.min(sample), high.max(sample));
    }
    low.cmplt(CONTRAST * high).any()
}
