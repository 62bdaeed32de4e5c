//! Height maps made by code. Each repeats without a seam, is square, and is the same on every call.

use std::f64::consts::{PI, TAU};
use std::path::PathBuf;

use super::super::HeightMap;

/// Texels a side that the features below are designed for.
pub const SIZE: u32 = 64;

/// Round dents that meet in ridges, 8 across the tile.
pub fn hammered_metal(size: u32) -> HeightMap {
    let dents = Scatter { cells: 8, seed: 1 };
    make("hammered-metal", size, |u, v| {
        let [nearest, _] = dents.nearest_two(u, v);
        (nearest * nearest).min(1.0)
    })
}

/// Small pits in a gently uneven skin, 11 across the tile.
pub fn orange_peel(size: u32) -> HeightMap {
    let pits = Scatter { cells: 11, seed: 2 };
    make("orange-peel", size, |u, v| {
        let [nearest, second] = pits.nearest_two(u, v);
        // Not deeper where two pits meet.
        let pit = |d: f64| (-d * d / 0.16).exp();
        let uneven = (TAU * (2.0 * u + v)).sin() + (TAU * (u - 3.0 * v)).sin();
        0.05 * uneven - pit(nearest).hypot(pit(second)).min(1.0)
    })
}

/// Rows of stitches, each a V of two strands: 8 columns, 8 rows.
pub fn knit(size: u32) -> HeightMap {
    make("knit", size, |u, v| {
        let across = (8.0 * u).rem_euclid(1.0);
        // From the seam between columns (0) to the middle of the V (1) and back.
        let inward = 1.0 - (2.0 * across - 1.0).abs();
        let round = (PI * (2.0 * across).rem_euclid(1.0)).sin();
        let strand = 0.5 + 0.5 * (TAU * (8.0 * v + 0.6 * inward)).cos();
        round.sqrt() * (0.35 + 0.65 * strand)
    })
}

/// Running bond: 4 bricks across, 8 courses, mortar set back.
pub fn brick(size: u32) -> HeightMap {
    make("brick", size, |u, v| {
        let course = (8.0 * v).floor();
        let along = (4.0 * u + 0.5 * course.rem_euclid(2.0)).rem_euclid(1.0);
        let up = (8.0 * v).rem_euclid(1.0);
        // Distance to the nearest joint, in heights of a course; a brick is two long.
        let joint = (2.0 * along.min(1.0 - along)).min(up.min(1.0 - up));
        let t = ((joint - 0.06) / 0.16).clamp(0.0, 1.0);
        t * t * (3.0 - 2.0 * t)
    })
}

/// A plain weave, 6 threads each way: each goes over one and under the next.
pub fn weave(size: u32) -> HeightMap {
    make("weave", size, |u, v| {
        let thread = |along: f64, across: f64| {
            let at = 6.0 * across;
            let off = at.rem_euclid(1.0) - 0.5;
            let round = (1.0 - (off / 0.44).powi(2)).max(0.0).sqrt();
            let over = if at.floor().rem_euclid(2.0) == 0.0 {
                1.0
            } else {
                -1.0
            };
            // Over at the middle of every second thread that it meets.
            (0.45 + 0.3 * over * (PI * 6.0 * along).sin()) * round.min(1.0) + 0.25 * round
        };
        thread(u, v).max(thread(v + 1.0 / 6.0, u))
    })
}

/// A star of eight rays in two rings, raised from a flat ground.
pub fn star(size: u32) -> HeightMap {
    make("star", size, |u, v| {
        let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        let (r, angle) = (x.hypot(y), y.atan2(x));
        let step = |t: f64| {
            let t = t.clamp(0.0, 1.0);
            t * t * (3.0 - 2.0 * t)
        };
        // A ridge at some distance from its middle, its foot as smooth as its crest.
        let bead = |off: f64, half: f64| (1.0 - (off / (1.3 * half)).powi(2)).max(0.0).powi(2);
        let rings = bead(r - 0.86, 0.055).max(0.7 * bead(r - 0.70, 0.04));
        // Each ray falls off to its edges, from a crest in its middle.
        let turn = (angle * 8.0 / TAU).rem_euclid(1.0) - 0.5;
        let reach = 0.60 - 0.24 * (2.0 * turn.abs()).sqrt();
        let ray = step((reach - r) / 0.10) * (1.0 - 1.2 * turn.abs());
        let boss = 1.1 * bead(r, 0.17);
        let dots = (0..16).map(|i| {
            let at = TAU * (f64::from(i) + 0.5) / 16.0;
            0.6 * bead((x - 0.78 * at.cos()).hypot(y - 0.78 * at.sin()), 0.03)
        });
        let border = step((x.abs().max(y.abs()) - 0.94) / 0.03);
        dots.fold(rings.max(ray).max(boss).max(border), f64::max)
    })
}

/// The height map of a function on the tile, stretched to 0..=1 in steps of 1/65535, so that a
/// 16-bit PNG holds it.
fn make(name: &str, size: u32, height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    let heights: Vec<f64> = (0..size)
        .flat_map(|row| (0..size).map(move |column| (place(column), 1.0 - place(row))))
        .map(|(u, v)| height(u, v))
        .collect();
    stretched(name, size, size, &heights).0
}

/// A height map of heights `[row][column]` from the top, stretched to 0..=1 in steps of 1/65535,
/// and its height scale: the range of the heights.
pub(super) fn stretched(name: &str, width: u32, height: u32, heights: &[f64]) -> (HeightMap, f32) {
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = (high - low).max(f64::MIN_POSITIVE);
    let map = HeightMap {
        path: PathBuf::from(format!("{name}.png")),
        width,
        height,
        values: heights
            .iter()
            .map(|h| ((h - low) / span * f64::from(u16::MAX)).round() as u16)
            .map(|code| f32::from(code) / f32::from(u16::MAX))
            .collect(),
    };
    (map, span as f32)
}

/// One random point in each cell of a square grid on the tile.
struct Scatter {
    cells: i32,
    seed: u64,
}

impl Scatter {
    /// Distances to the two nearest points, in cells.
    fn nearest_two(&self, u: f64, v: f64) -> [f64; 2] {
        let (x, y) = (u * f64::from(self.cells), v * f64::from(self.cells));
        let mut found = [f64::INFINITY; 2];
        for dy in -2..=2 {
            for dx in -2..=2 {
                let (cx, cy) = (x.floor() as i32 + dx, y.floor() as i32 + dy);
                let [jx, jy] = self.jitter(cx, cy);
                let distance = (f64::from(cx) + jx - x).hypot(f64::from(cy) + jy - y);
                if distance < found[0] {
                    found = [distance, found[0]];
                } else if distance < found[1] {
                    found[1] = distance;
                }
            }
        }
        found
    }

    /// The random point of a cell, which repeats with the tile.
    fn jitter(&self, x: i32, y: i32) -> [f64; 2] {
        let cell = y.rem_euclid(self.cells) * self.cells + x.rem_euclid(self.cells);
        // SplitMix64, Steele et al. 2014.
        let mut z = (self.seed * 4_096 + cell as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        let part = |bits: u64| 0.2 + 0.6 * (bits & 0xffff) as f64 / 65_535.0;
        [part(z), part(z >> 16)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Root mean square slope for a tile of one unit and a height scale of 1.
    fn rms_slope(map: &HeightMap) -> f64 {
        let step = 0.5 / f64::from(map.width);
        let mut sum = 0.0;
        for i in 0..map.width {
            for j in 0..map.height {
                let (u, v) = (
                    f64::from(i) * 2.0 * step + step,
                    f64::from(j) * 2.0 * step + step,
                );
                let du = (map.sample(u + step, v) - map.sample(u - step, v)) / (2.0 * step);
                let dv = (map.sample(u, v + step) - map.sample(u, v - step)) / (2.0 * step);
                sum += du * du + dv * dv;
            }
        }
        (sum / f64::from(map.width * map.height)).sqrt()
    }

    #[test]
    fn they_use_every_height_and_repeat_without_a_seam() {
        for make in [hammered_metal, orange_peel, knit, brick] {
            let map = make(SIZE);
            let size = SIZE as usize;
            let (mut within, mut across) = (0.0_f32, 0.0_f32);
            for k in 0..size {
                across = across
                    .max((map.values[k] - map.values[k + size * (size - 1)]).abs())
                    .max((map.values[k * size] - map.values[k * size + size - 1]).abs());
                for i in 1..size {
                    within = within
                        .max((map.values[i * size + k] - map.values[(i - 1) * size + k]).abs())
                        .max((map.values[k * size + i] - map.values[k * size + i - 1]).abs());
                }
            }
            let name = map.path.display();
            assert!(
                across <= within,
                "{name}: a step of {across} at the seam, {within} within"
            );
            assert!(
                map.values.contains(&0.0) && map.values.contains(&1.0),
                "{name}"
            );
            let exact = |v: &f32| (v * 65_535.0).round() / 65_535.0 == *v;
            assert!(map.values.iter().all(exact), "{name}");
            println!(
                "{name}: rms slope {:.2}, mean {:.3}",
                rms_slope(&map),
                map.mean()
            );
            assert_eq!(make(SIZE), map);
        }
    }
}
