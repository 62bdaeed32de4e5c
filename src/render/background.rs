//! The sky behind the surfaces of a picture.

use rayon::prelude::*;

use crate::picture::{Projection, Tile};
use crate::scene::sky::Sky;

/// Alpha of samples that show no surface, where a sky is drawn.
pub const BEHIND: f32 = -1.0;

/// Gives each sample of a tile that shows no surface the sky's radiance in its direction;
/// `per_side` samples along a pixel's side, rows of `stride`.
pub fn draw_sky(
    sky: &Sky,
    projection: &Projection,
    (tile, per_side): (Tile, u32),
    samples: &mut [[f32; 4]],
    stride: u32,
) {
    let width = (tile.width * per_side) as usize;
    let rows = samples.par_chunks_mut(stride as usize).enumerate();
    rows.for_each(|(y, row)| {
        for (x, sample) in row[..width].iter_mut().enumerate() {
            if sample[3] == BEHIND {
                let at = |first: u32, i: usize| {
                    f64::from(first) + (i as f64 + 0.5) / f64::from(per_side)
                };
                let direction = projection.ray(at(tile.column, x), at(tile.row, y));
                let [r, g, b] = sky.radiance(direction).as_vec3().to_array();
                *sample = [r, g, b, 0.0];
            }
        }
    });
}
