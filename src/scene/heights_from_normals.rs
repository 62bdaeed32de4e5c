//! Heights whose slopes come nearest to those of a normal map (Frankot and Chellappa 1988).
//!
//! A map repeats, so its slopes are sums of waves. A derivative multiplies a wave by a number, D_x
//! along x and D_y along y. For slopes with the waves P and Q, the height that leaves the least
//! mean square of |P − D_x H|² + |Q − D_y H|² has H = (D̄_x P + D̄_y Q) / (|D_x|² + |D_y|²).
//!
//! Most normal maps are made from heights by differences of texels, which is a D other than the
//! derivative's. The one that explains most of the map is used.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::DVec2;
use rayon::prelude::*;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex64;

use super::tile::tile_size;
use super::{HeightMap, NormalMap, Scene};

/// Gives materials that have normals and no heights the heights of the normals, with a note for
/// each that a triangle uses.
pub(super) fn add_to(scene: &mut Scene) {
    let mut known: Vec<Known> = Vec::new();
    for index in 0..scene.materials.len() {
        let material = &scene.materials[index];
        let (None, Some(normals)) = (&material.map_height, material.map_normal.clone()) else {
            continue;
        };
        let Some(tile) = tile_size(scene, index as u32) else {
            continue;
        };
        let Integrated {
            map,
            scale,
            unexplained,
        } = match known.iter().find_map(|known| known.on(&normals, tile)) {
            Some(integrated) => integrated,
            None => {
                let integrated = integrate(&normals, tile);
                known.push(Known {
                    normals: normals.clone(),
                    tile,
                    integrated: integrated.clone(),
                });
                integrated
            }
        };
        if scale <= FLAT * tile.max_element() {
            let (name, path) = (&material.name, normals.path.display());
            (scene.notes).push(format!("material \"{name}\": normal map {path} is flat"));
            continue;
        }
        scene.notes.push(format!(
            "material \"{}\": normal map {} has no height map: heights of {:.3} scene units from \
             the lowest to the highest were integrated from it, which leave {:.0} % of its slopes \
             unexplained; --no-heights-from-normals leaves it out",
            material.name,
            normals.path.display(),
            scale,
            100.0 * unexplained
        ));
        let material = &mut scene.materials[index];
        material.map_height = Some(map);
        material.height_scale = scale as f32;
    }
}

/// Heights of a map with tiles of one size.
struct Known {
    normals: Arc<NormalMap>,
    tile: DVec2,
    integrated: Integrated,
}

/// Sides of tiles whose ratios differ by less than this share are of one shape.
const SAME_SHAPE: f64 = 1e-6;

impl Known {
    /// The heights of a map with tiles of this size, if it is the same map and tiles have the same
    /// shape: then only the scale differs.
    fn on(&self, normals: &Arc<NormalMap>, tile: DVec2) -> Option<Integrated> {
        let larger = tile / self.tile;
        let is_shape = (larger.x / larger.y - 1.0).abs() < SAME_SHAPE;
        let is_map = || Arc::ptr_eq(&self.normals, normals) || self.normals == *normals;
        (is_shape && is_map()).then(|| Integrated {
            scale: self.integrated.scale * larger.x,
            ..self.integrated.clone()
        })
    }
}

/// Heights that were integrated.
#[derive(Clone)]
struct Integrated {
    /// Values in 0..=1.
    map: Arc<HeightMap>,
    /// Scene units between the values 0 and 1.
    scale: f64,
    /// Of the slopes' root mean square, the part that no height explains.
    unexplained: f64,
}

/// Of the size of a tile: lower heights are none.
const FLAT: f64 = 1e-9;

/// Of the square of the exact derivative: what D̄D counts as at least, so that waves which
/// differences of texels hardly show are not made of rounding.
const LEAST_SHOWN: f64 = 1e-3;

/// Over the rounding of 8 bit: squared waves that a choice is made by.
const ABOVE_ROUNDING: f64 = 20.0;

/// Integrates a map of which one repeat is `tile` large, along u and v, scene units.
fn integrate(normals: &NormalMap, tile: DVec2) -> Integrated {
    let size = [normals.width as usize, normals.height as usize];
    // One transform for both slopes, which are real.
    let slope = |&[x, y, z]: &[f32; 3]| {
        let [x, y, z] = [x, y, z].map(f64::from);
        // Rows go down, v up.
        Complex64::new(-x / z, y / z)
    };
    let mut waves: Vec<Complex64> = normals.normals.iter().map(slope).collect();
    let least = ABOVE_ROUNDING * rounding(&waves);
    transform(&mut waves, size, Direction::Forward);
    let slopes = Slopes {
        size,
        texels: [tile.x / size[0] as f64, tile.y / size[1] as f64],
        waves,
    };
    let unexplained = |by: &Derivative| slopes.unexplained(*by, least);
    let (by, unexplained) = (DERIVATIVES.iter())
        .map(|by| (*by, unexplained(by)))
        .min_by(|(_, a), (_, b)| a.total_cmp(b))
        .unwrap_or((Derivative::Exact, 0.0));
    let mut heights = slopes.heights(by);
    transform(&mut heights, size, Direction::Inverse);
    let count = heights.len() as f64;
    let values = || heights.iter().map(|h| h.re / count);
    let low = values().fold(f64::INFINITY, f64::min);
    let high = values().fold(f64::NEG_INFINITY, f64::max);
    let scale = high - low;
    let share = |h: f64| match scale > 0.0 {
        true => ((h - low) / scale) as f32,
        false => 0.0,
    };
    Integrated {
        map: Arc::new(HeightMap {
            path: normals.path.clone(),
            width: normals.width,
            height: normals.height,
            values: values().map(share).collect(),
        }),
        scale,
        unexplained,
    }
}

/// What a derivative along a row or a column is taken to be.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Derivative {
    Exact,
    /// Half the difference of the two neighbours.
    Central,
    /// The same over three rows, of weights 1, 2, 1 (Sobel).
    Smoothed,
    /// The difference to the next texel of a row and of a column, or from the one before.
    Neighbour([Step; 2]),
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Step {
    Next,
    Before,
}

const DERIVATIVES: [Derivative; 7] = [
    Derivative::Exact,
    Derivative::Central,
    Derivative::Smoothed,
    Derivative::Neighbour([Step::Next, Step::Next]),
    Derivative::Neighbour([Step::Next, Step::Before]),
    Derivative::Neighbour([Step::Before, Step::Next]),
    Derivative::Neighbour([Step::Before, Step::Before]),
];

impl Derivative {
    /// D of a wave with these angles a texel, along a row and down a column.
    fn of_wave(self, angles: [f64; 2]) -> [Complex64; 2] {
        let imaginary = |x: f64| Complex64::new(0.0, x);
        let step = |angle: f64, step: Step| match step {
            Step::Next => Complex64::cis(angle) - 1.0,
            Step::Before => 1.0 - Complex64::cis(-angle),
        };
        let [x, y] = angles;
        match self {
            // A wave of two texels has no slope at their centres.
            Self::Exact => angles.map(|a| imaginary(if a.abs() < PI { a } else { 0.0 })),
            Self::Central => angles.map(|a| imaginary(a.sin())),
            Self::Smoothed => {
                let mean = |a: f64| (0.5 * a).cos().powi(2);
                [imaginary(x.sin() * mean(y)), imaginary(y.sin() * mean(x))]
            }
            Self::Neighbour([along, down]) => [step(x, along), step(y, down)],
        }
    }
}

/// The waves of a map's slopes, as p + i q, row-major.
struct Slopes {
    size: [usize; 2],
    /// Size of a texel, scene units.
    texels: [f64; 2],
    waves: Vec<Complex64>,
}

/// A wave of the slopes along rows and down columns, and D of it in scene units.
struct Wave {
    slopes: [Complex64; 2],
    derivative: [Complex64; 2],
    /// |D|² as it counts.
    square: f64,
}

impl Slopes {
    fn wave(&self, by: Derivative, index: usize) -> Wave {
        let [width, height] = self.size;
        let at = [index % width, index / width];
        let mirrored = (height - at[1]) % height * width + (width - at[0]) % width;
        let (one, other) = (self.waves[index], self.waves[mirrored].conj());
        let angle = |k: usize, n: usize| match 2 * k <= n {
            true => TAU * k as f64 / n as f64,
            false => TAU * (k as f64 - n as f64) / n as f64,
        };
        let angles = [angle(at[0], width), angle(at[1], height)];
        let [x, y] = by.of_wave(angles);
        let derivative = [x / self.texels[0], y / self.texels[1]];
        let exact = DVec2::new(angles[0] / self.texels[0], angles[1] / self.texels[1]);
        let square = derivative[0].norm_sqr() + derivative[1].norm_sqr();
        Wave {
            slopes: [
                0.5 * (one + other),
                Complex64::new(0.0, -0.5) * (one - other),
            ],
            derivative,
            square: square.max(LEAST_SHOWN * exact.length_squared()),
        }
    }

    /// The waves of the heights.
    fn heights(&self, by: Derivative) -> Vec<Complex64> {
        (0..self.waves.len())
            .into_par_iter()
            .map(|index| self.wave(by, index).height())
            .collect()
    }

    /// Of the root mean square of the slopes, the part that is not those of heights; of waves whose
    /// square is at least `least`.
    fn unexplained(&self, by: Derivative, least: f64) -> f64 {
        let [width, _] = self.size;
        let squares = |index: usize| {
            let wave = self.wave(by, index);
            let all = wave.slopes[0].norm_sqr() + wave.slopes[1].norm_sqr();
            if all < least {
                return [0.0; 2];
            }
            let height = wave.height();
            let rest = |k: usize| (wave.slopes[k] - wave.derivative[k] * height).norm_sqr();
            [rest(0) + rest(1), all]
        };
        // Row by row, so that the sum is the same with any number of threads.
        let rows: Vec<[f64; 2]> = (self.waves.par_chunks(width).enumerate())
            .map(|(row, waves)| {
                let own = row * width..row * width + waves.len();
                own.map(squares).fold([0.0; 2], sum)
            })
            .collect();
        let [rest, all] = rows.into_iter().fold([0.0; 2], sum);
        match all > 0.0 {
            true => (rest / all).sqrt(),
            false => 0.0,
        }
    }
}

impl Wave {
    fn height(&self) -> Complex64 {
        let [[p, q], [x, y]] = [self.slopes, self.derivative];
        match self.square > 0.0 {
            true => (x.conj() * p + y.conj() * q) / self.square,
            false => Complex64::ZERO,
        }
    }
}

fn sum([a, b]: [f64; 2], [c, d]: [f64; 2]) -> [f64; 2] {
    [a + c, b + d]
}

/// The squared wave that rounding normals to 8 bit leads to in the mean.
fn rounding(slopes: &[Complex64]) -> f64 {
    const STEP: f64 = 2.0 / 255.0;
    let of_texel = |s: &Complex64| (1.0 + s.norm_sqr()) * (2.0 + s.norm_sqr());
    STEP * STEP / 12.0 * slopes.iter().map(of_texel).sum::<f64>()
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Direction {
    Forward,
    Inverse,
}

/// The discrete Fourier transform of an image of `[width, height]`, not scaled.
fn transform(image: &mut [Complex64], [width, height]: [usize; 2], direction: Direction) {
    let mut planner = FftPlanner::new();
    let mut plan = |length| match direction {
        Direction::Forward => planner.plan_fft_forward(length),
        Direction::Inverse => planner.plan_fft_inverse(length),
    };
    let (rows, columns) = (plan(width), plan(height));
    image
        .par_chunks_mut(width)
        .for_each(|row| rows.process(row));
    let mut turned: Vec<Complex64> = (0..width * height)
        .into_par_iter()
        .map(|at| image[at % height * width + at / height])
        .collect();
    (turned.par_chunks_mut(height)).for_each(|column| columns.process(column));
    (image.par_iter_mut().enumerate())
        .for_each(|(at, value)| *value = turned[at % width * height + at / width]);
}

#[cfg(test)]
mod tests;
