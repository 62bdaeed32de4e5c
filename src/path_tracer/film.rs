//! A picture in progress: sums of independent batches, which give its error.

use std::time::Duration;

use glam::DVec3;
use rayon::prelude::*;

use crate::picture::Picture;

/// Standard errors on each side of a mean that hold 95 % of a normal distribution.
pub(crate) const NORMAL_95: f64 = 1.959_964;

/// What paths have found. Every pass of [`PathTracer::render`](super::PathTracer::render) is one
/// batch, independent of the others.
#[derive(Debug, Clone)]
pub struct Film {
    pub width: u32,
    pub height: u32,
    /// Paths of each pixel so far.
    pub paths: u32,
    /// Batches so far.
    pub passes: u32,
    pub elapsed: Duration,
    pixels: Vec<Pixel>,
}

#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Mean radiance of the batches, and the sum of their squared deviations from it, RGB: by
    /// Welford's update (1962), which gives equal batches a spread of exactly 0.
    mean: DVec3,
    deviations: DVec3,
    /// Whether all paths hit fronts that do not emit.
    metered: bool,
}

/// What one batch found in a pixel.
pub(super) struct Batch {
    /// Mean radiance.
    pub mean: DVec3,
    pub metered: bool,
}

impl Film {
    pub(super) fn new(width: u32, height: u32) -> Self {
        let empty = Pixel {
            mean: DVec3::ZERO,
            deviations: DVec3::ZERO,
            metered: true,
        };
        Self {
            width,
            height,
            paths: 0,
            passes: 0,
            elapsed: Duration::ZERO,
            pixels: vec![empty; width as usize * height as usize],
        }
    }

    /// Adds one batch of `paths` paths to every pixel; `batch` takes column and row.
    pub(super) fn add(&mut self, paths: u32, batch: impl Fn(u32, u32) -> Batch + Sync) {
        let width = self.width as usize;
        let count = f64::from(self.passes + 1);
        self.pixels
            .par_chunks_mut(width)
            .enumerate()
            .for_each(|(row, pixels)| {
                for (column, pixel) in pixels.iter_mut().enumerate() {
                    let found = batch(column as u32, row as u32);
                    let before = found.mean - pixel.mean;
                    pixel.mean += before / count;
                    pixel.deviations += before * (found.mean - pixel.mean);
                    pixel.metered &= found.metered;
                }
            });
        self.paths += paths;
        self.passes += 1;
    }

    /// Mean radiance of each pixel, `[row][column]` from the top left, W·m⁻²·sr⁻¹, linear RGB.
    /// Unbiased.
    pub fn radiance(&self) -> Vec<DVec3> {
        self.pixels.iter().map(|p| p.mean).collect()
    }

    /// Standard error of each pixel's radiance, `[row][column]`, RGB: s/√n of the n batches. From
    /// so few batches it is itself uncertain by about 1/√(2n − 2).
    pub fn standard_error(&self) -> Vec<DVec3> {
        self.pixels.iter().map(|p| self.error_of(p)).collect()
    }

    /// Mean radiance of the picture and half the width of its 95 % confidence interval, RGB.
    pub fn mean(&self) -> (DVec3, DVec3) {
        let count = self.pixels.len() as f64;
        let (mut sum, mut variance) = (DVec3::ZERO, DVec3::ZERO);
        for pixel in &self.pixels {
            sum += pixel.mean;
            let error = self.error_of(pixel);
            variance += error * error;
        }
        let error = DVec3::from_array(variance.to_array().map(f64::sqrt)) / count;
        (sum / count, NORMAL_95 * error)
    }

    /// The root of the mean of squared standard error / squared radiance over all pixels that are
    /// not black.
    pub fn relative_error(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0);
        for pixel in &self.pixels {
            let mean = pixel.mean.length_squared();
            if mean > 0.0 {
                sum += self.error_of(pixel).length_squared() / mean;
                count += 1;
            }
        }
        if count > 0 {
            (sum / f64::from(count)).sqrt()
        } else {
            0.0
        }
    }

    /// The picture so far.
    pub fn picture(&self) -> Picture {
        let radiance: Vec<_> = self
            .pixels
            .par_iter()
            .map(|p| p.mean.as_vec3().to_array())
            .collect();
        let metered: Vec<_> = self.pixels.iter().map(|p| p.metered).collect();
        Picture::new((self.width, self.height), radiance, &metered)
    }

    fn error_of(&self, pixel: &Pixel) -> DVec3 {
        standard_error(pixel.deviations, f64::from(self.passes))
    }
}

/// Standard error of a mean of `count` independent values with this sum of squared deviations.
pub(super) fn standard_error(deviations: DVec3, count: f64) -> DVec3 {
    let squared = deviations.max(DVec3::ZERO) / ((count - 1.0) * count);
    DVec3::from_array(squared.to_array().map(f64::sqrt))
}
