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
    radiance: Vec<[f32; 3]>,
    contrasts: Vec<(u32, Samples)>,
    /// Luminance of the metered pixels.
    metered: Vec<f32>,
}

impl Gathered {
    pub fn new((width, height): (u32, u32)) -> Self {
        Self {
            width,
            height,
            radiance: vec![[0.0; 3]; width as usize * height as usize],
            contrasts: Vec::new(),
            metered: Vec::new(),
        }
    }

    /// Adds a tile's samples, in rows of `stride`.
    pub fn add(&mut self, tile: Tile, samples: &[[f32; 4]], stride: usize) {
        let side = SAMPLES as usize;
        let rows: Vec<Vec<(Samples, bool)>> = (0..tile.height as usize)
            .into_par_iter()
            .map(|row| {
                (0..tile.width as usize)
                    .map(|column| {
                        let sample = |i: usize| {
                            samples[(row * side + i / side) * stride + column * side + i % side]
                        };
                        let colours = std::array::from_fn(|i| {
                            let [r, g, b, _] = sample(i);
                            [r, g, b]
                        });
                        (colours, (0..side * side).all(|i| sample(i)[3] > 0.5))
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
