//! Samples gathered into pixels, tile by tile.

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
        let drawn = self.samples as usize;
        let kept = SAMPLES as usize;
        let each = drawn / kept;
        let share = 1.0 / (each * each) as f32;
        let rows: Vec<Vec<(Samples, bool)>> = (0..tile.height as usize)
            .into_par_iter()
            .map(|row| {
                (0..tile.width as usize)
                    .map(|column| {
                        let sample = |y: usize, x: usize| {
                            samples[(row * drawn + y) * stride + column * drawn + x]
                        };
                        let colours = std::array::from_fn(|i| {
                            let mut sum = [0.0; 3];
                            for k in 0..each * each {
                                let (y, x) =
                                    (i / kept * each + k / each, i % kept * each + k % each);
                                let of = sample(y, x);
                                (0..3).for_each(|c| sum[c] += of[c]);
                            }
                            sum.map(|c| c * share)
                        });
                        let metered = |i: usize| sample(i / drawn, i % drawn)[3] > 0.5;
                        (colours, (0..drawn * drawn).all(metered))
                    })
                    .collect()
            })
            .collect();
        for (row, pixels) in rows.into_iter().enumerate() {
            let start = (tile.row + row as u32) * self.width + tile.column;
            for (place, (samples, metered)) in (start..).zip(pixels) {
                let mean = picture::mean(&samples);
                self.radiance[place as usize] = mean;
                if metered {
                    self.metered.push(tone::luminance(mean));
                }
                if contrasts(&samples) {
                    self.contrasts.push((place, samples));
                }
            }
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

fn contrasts(samples: &Samples) -> bool {
    (0..3).any(|c| {
        let values = samples.iter().map(|s| s[c]);
        let (low, high) = values.fold((f32::INFINITY, 0.0_f32), |(low, high), v| {
            (low.min(v), high.max(v))
        });
        low < CONTRAST * high
    })
}
