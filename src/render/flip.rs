//! ꟻLIP: the perceived difference of two pictures shown in alternation, per pixel and in 0..=1.
//!
//! LDR-ꟻLIP is Andersson et al., *ꟻLIP: A Difference Evaluator for Alternating Images* (HPG 2020):
//! the distance of colours blurred as by the eye, amplified by the difference of edges and points.
//! HDR-ꟻLIP is Andersson et al., *Visualizing Errors in Rendered High Dynamic Range Images*
//! (Eurographics 2021): the largest LDR-ꟻLIP of each pixel over all exposures at which the
//! reference is neither too bright nor too dark.

use std::f32::consts::{FRAC_1_SQRT_2, PI};
use std::path::Path;

use glam::{Mat3, Vec3};
use rayon::prelude::*;

use super::Picture;
use super::compare::same_size;
use crate::error::Result;
use crate::picture::tone::{luminance, magma};
use crate::picture::{FileKind, write_png};

/// Pixels to a degree of the visual angle: a screen 0.7 m wide of 3840 pixels, seen from 0.7 m, as
/// in the papers.
pub const PIXELS_PER_DEGREE: f32 = 3840.0 * PI / 180.0;

/// The eye's contrast sensitivity for luminance, red to green, and the two terms of blue to yellow:
/// weight a and width b of a √(π/b) exp(−π² x²/b), x in degrees.
const SENSITIVITY: [[f32; 2]; 4] = [[1.0, 0.0047], [1.0, 0.0053], [34.1, 0.04], [13.5, 0.025]];
/// Exponents of the differences of colours and of features.
const COLOUR_EXPONENT: f32 = 0.7;
const FEATURE_EXPONENT: f32 = 0.5;
/// This share of the largest colour difference is mapped to the second number; larger ones are
/// mapped to the rest.
const KNEE: [f32; 2] = [0.4, 0.95];
/// Width of the most visible edge, degrees.
const EDGE_WIDTH: f32 = 0.082;

/// Rational tone curve of the ACES film (Narkowicz 2015, scaled by 0.6):
/// (a x² + b x) / (c x² + d x + e).
const ACES: [f32; 5] = [0.36 * 2.51, 0.6 * 0.03, 0.36 * 2.43, 0.6 * 0.59, 0.14];
/// Tone-mapped value to which the exposures bring the reference's brightest and its median
/// luminance.
const BRIGHT: f32 = 0.85;

/// The difference of two pictures of radiance.
#[derive(Debug, Clone)]
pub struct Flip {
    pub width: u32,
    pub height: u32,
    /// HDR-ꟻLIP in 0..=1, `[row][column]` from the top left.
    pub error: Vec<f32>,
    /// First and last exposure, powers of two, and how many there are.
    pub exposures: [f32; 2],
    pub count: u32,
}

impl Flip {
    /// HDR-ꟻLIP of a picture from its reference. The exposures come from the reference, so that the
    /// measure is not symmetric.
    ///
    /// # Errors
    /// Pictures of different sizes.
    pub fn new(ours: &Picture, reference: &Picture) -> Result<Self> {
        same_size(ours, reference)?;
        let [start, stop] = exposures(&reference.radiance);
        let count = ((stop - start).ceil() as u32).max(2);
        let mut error = vec![0.0_f32; reference.radiance.len()];
        for i in 0..count {
            let exposure = start + (stop - start) * i as f32 / (count - 1) as f32;
            let shown = |picture: &Picture| -> Vec<[f32; 3]> {
                let scale = exposure.exp2();
                let curve = |c: f32| aces(scale * c.max(0.0)).clamp(0.0, 1.0);
                picture.radiance.par_iter().map(|p| p.map(curve)).collect()
            };
            let found = ldr(&shown(ours), &shown(reference), reference.width);
            error
                .par_iter_mut()
                .zip(found)
                .for_each(|(most, e)| *most = most.max(e));
        }
        Ok(Self {
            width: reference.width,
            height: reference.height,
            error,
            exposures: [start, stop],
            count,
        })
    }

    /// The mean over the pixels, the papers' measure of a picture.
    pub fn mean(&self) -> f64 {
        self.error.iter().map(|&e| f64::from(e)).sum::<f64>() / self.error.len() as f64
    }

    /// Writes the difference: `.png` in the magma colours, black for 0 and pale yellow for 1, or
    /// `.exr` as the numbers.
    ///
    /// # Errors
    /// Another ending; a file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let size = (self.width, self.height);
        match FileKind::of(path)? {
            FileKind::Png => {
                let codes: Vec<u8> = self.error.iter().flat_map(|&e| magma(e)).collect();
                write_png(path, size, &codes)
            }
            FileKind::Exr | FileKind::Hdr => {
                let grey: Vec<_> = self.error.iter().map(|&e| [e; 3]).collect();
                let metered = vec![true; grey.len()];
                Picture::new(size, grey, &metered).write(path, None)
            }
        }
    }
}

/// Exposures, powers of two, that bring the brightest and the median luminance to [`BRIGHT`]. Black
/// pixels are left out if the median would be black; a black picture is shown unexposed.
fn exposures(radiance: &[[f32; 3]]) -> [f32; 2] {
    let [a, b, c, d, e] = ACES;
    let [a, b, c] = [a - BRIGHT * c, b - BRIGHT * d, -BRIGHT * e];
    // a x² + b x + c = 0; the curve rises, and c/a is negative.
    let half = -b / (2.0 * a);
    let bright = half + (half * half - c / a).sqrt();
    let mut all: Vec<f32> = radiance.iter().map(|&p| luminance(p)).collect();
    all.par_sort_unstable_by(f32::total_cmp);
    let median = |sorted: &[f32]| match sorted.len() {
        0 => 0.0,
        n => (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0,
    };
    let lit = &all[all.partition_point(|&l| l <= 0.0)..];
    let middle = if median(&all) > 0.0 {
        median(&all)
    } else {
        median(lit)
    };
    match lit.last() {
        // The scale is finite for any radiance.
        Some(most) => [most, &middle].map(|l| (bright / l).log2().clamp(-126.0, 126.0)),
        None => [0.0; 2],
    }
}

fn aces(x: f32) -> f32 {
    let [a, b, c, d, e] = ACES;
    (a * x + b) * x / ((c * x + d) * x + e)
}

/// LDR-ꟻLIP of two pictures of linear RGB in 0..=1, `[row][column]`, each pixel in 0..=1. Symmetric
/// in the two.
pub fn ldr(ours: &[[f32; 3]], reference: &[[f32; 3]], width: u32) -> Vec<f32> {
    assert_eq!(ours.len(), reference.len(), "pictures of one size");
    let width = width as usize;
    let colours = Colours::new();
    let [ours, reference] = [ours, reference].map(|picture| Seen::new(&colours, picture, width));
    let largest = colours.largest();
    (0..ours.colour.len())
        .into_par_iter()
        .map(|i| {
            let apart = hyab(ours.colour[i], reference.colour[i]).powf(COLOUR_EXPONENT);
            let [share, at] = KNEE;
            let knee = share * largest;
            let colour = if apart < knee {
                at * apart / knee
            } else {
                at + (1.0 - at) * (apart - knee) / (largest - knee)
            };
            let [edges, points] =
                [0, 1].map(|k| (ours.features[i][k] - reference.features[i][k]).abs());
            let feature = (FRAC_1_SQRT_2 * edges.max(points)).powf(FEATURE_EXPONENT);
            // Rounding may bring the largest difference above 1.
            colour.powf(1.0 - feature).min(1.0)
        })
        .collect()
}

/// A picture filtered as by the eye.
struct Seen {
    /// L*a*b* of the blurred colours, their chroma after Hunt.
    colour: Vec<Vec3>,
    /// Strength of edges and of points.
    features: Vec<[f32; 2]>,
}

impl Seen {
    fn new(colours: &Colours, picture: &[[f32; 3]], width: usize) -> Self {
        let opponent: Vec<Vec3> = picture
            .par_iter()
            .map(|&p| colours.opponent(Vec3::from(p)))
            .collect();
        let plane = |c: usize| -> Vec<f32> { opponent.iter().map(|p| p[c]).collect() };
        let blurred = |plane: &[f32], kernel: &[f32]| filter(plane, width, kernel, kernel);
        let [y, red, yellow, blue] = SENSITIVITY.map(|[_, b]| sensitivity(b));
        // The sum of two Gaussians is not separable: each is filtered by itself and weighted by its
        // share of the volume.
        let volume = |i: usize, (_, sum): &(Vec<f32>, f32)| {
            let [a, b] = SENSITIVITY[i];
            a * (PI / b).sqrt() * sum * sum
        };
        let (first, second) = (volume(2, &yellow), volume(3, &blue));
        let second_share = second / (first + second);
        let third = plane(2);
        let lightness = plane(0);
        let [l, a, b, c] = [
            blurred(&lightness, &y.0),
            blurred(&plane(1), &red.0),
            blurred(&third, &yellow.0),
            blurred(&third, &blue.0),
        ];
        let colour = (0..picture.len())
            .into_par_iter()
            .map(|i| {
                let yellow = b[i] + (c[i] - b[i]) * second_share;
                let linear = colours.linear(Vec3::new(l[i], a[i], yellow));
                colours.lab(linear.clamp(Vec3::ZERO, Vec3::ONE))
            })
            .collect();

        let grey: Vec<f32> = lightness.iter().map(|l| (l + 16.0) / 116.0).collect();
        let [even, edge, point] = feature_kernels();
        let across = |kernel: &[f32]| filter(&grey, width, kernel, &even);
        let down = |kernel: &[f32]| filter(&grey, width, &even, kernel);
        let pairs = [[across(&edge), down(&edge)], [across(&point), down(&point)]];
        let features = (0..picture.len())
            .map(|i| [0, 1].map(|k: usize| pairs[k][0][i].hypot(pairs[k][1][i])))
            .collect();
        Self { colour, features }
    }
}

/// Weights of a Gaussian of the eye's sensitivity, normalised to the sum 1, and their sum before.
/// All have the radius of the widest.
fn sensitivity(b: f32) -> (Vec<f32>, f32) {
    let widest = SENSITIVITY.iter().fold(0.0_f32, |most, s| most.max(s[1]));
    let radius = (3.0 * (widest / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let weights: Vec<f32> = (-radius..=radius)
        .map(|x| {
            let degrees = x as f32 / PIXELS_PER_DEGREE;
            (-(PI * degrees).powi(2) / b).exp()
        })
        .collect();
    let sum = weights.iter().sum::<f32>();
    (weights.iter().map(|w| w / sum).collect(), sum)
}

/// A Gaussian whose weights sum to 1, and its first and second derivative, whose weights of one
/// sign sum to ±1.
fn feature_kernels() -> [Vec<f32>; 3] {
    let deviation = 0.5 * EDGE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let kernel = |value: &dyn Fn(f32) -> f32| -> Vec<f32> {
        let weights: Vec<f32> = (-radius..=radius)
            .map(|x| {
                let x = x as f32 / deviation;
                value(x) * (-x * x / 2.0).exp()
            })
            .collect();
        let sum = |sign: f32| weights.iter().map(|w| (sign * w).max(0.0)).sum::<f32>();
        let (above, below) = (sum(1.0), sum(-1.0));
        let scaled = |&w: &f32| {
            if w > 0.0 {
                w / above
            } else {
                w / below.max(f32::MIN_POSITIVE)
            }
        };
        weights.iter().map(scaled).collect()
    };
    [kernel(&|_| 1.0), kernel(&|x| -x), kernel(&|x| x * x - 1.0)]
}

/// A plane filtered along rows and columns; its border is repeated outside.
fn filter(plane: &[f32], width: usize, across: &[f32], down: &[f32]) -> Vec<f32> {
    let height = plane.len() / width;
    let taps = |kernel: &[f32], at: usize, most: usize, value: &dyn Fn(usize) -> f32| -> f32 {
        let radius = kernel.len() / 2;
        let places = (0..kernel.len()).map(|k| (at + k).saturating_sub(radius).min(most - 1));
        kernel.iter().zip(places).map(|(w, i)| w * value(i)).sum()
    };
    let mut rows = vec![0.0; plane.len()];
    rows.par_chunks_mut(width)
        .zip(plane.par_chunks(width))
        .for_each(|(out, row)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = taps(across, x, width, &|i| row[i]);
            }
        });
    let mut columns = vec![0.0; plane.len()];
    columns
        .par_chunks_mut(width)
        .enumerate()
        .for_each(|(y, out)| {
            for (x, out) in out.iter_mut().enumerate() {
                *out = taps(down, y, height, &|i| rows[i * width + x]);
            }
        });
    columns
}

/// Colour spaces; XYZ is of the illuminant D65, by which it is divided throughout.
struct Colours {
    to_xyz: Mat3,
    from_xyz: Mat3,
}

impl Colours {
    fn new() -> Self {
        // Rows X, Y, Z of linear sRGB, IEC 61966-2-1; white is the sum of each row.
        let rows = [
            [10_135_552.0, 8_788_810.0, 4_435_075.0],
            [2_613_072.0, 8_788_810.0, 887_015.0],
            [1_425_312.0, 8_788_810.0, 70_074_185.0],
        ];
        let rows = rows.map(|row: [f64; 3]| row.map(|v| (v / row.iter().sum::<f64>()) as f32));
        let to_xyz = Mat3::from_cols_array_2d(&rows).transpose();
        Self {
            to_xyz,
            from_xyz: to_xyz.inverse(),
        }
    }

    /// Linear RGB to YCxCz, which is linear too.
    fn opponent(&self, rgb: Vec3) -> Vec3 {
        let xyz = self.to_xyz * rgb;
        Vec3::new(
            116.0 * xyz.y - 16.0,
            500.0 * (xyz.x - xyz.y),
            200.0 * (xyz.y - xyz.z),
        )
    }

    /// The inverse.
    fn linear(&self, opponent: Vec3) -> Vec3 {
        let y = (opponent.x + 16.0) / 116.0;
        self.from_xyz * Vec3::new(y + opponent.y / 500.0, y, y - opponent.z / 200.0)
    }

    /// CIE L*a*b*, chroma scaled by lightness: the Hunt effect.
    fn lab(&self, rgb: Vec3) -> Vec3 {
        const DELTA: f32 = 6.0 / 29.0;
        let root = |v: f32| {
            if v > DELTA * DELTA * DELTA {
                v.cbrt()
            } else {
                v / (3.0 * DELTA * DELTA) + 4.0 / 29.0
            }
        };
        let [x, y, z] = (self.to_xyz * rgb).to_array().map(root);
        let lightness = 116.0 * y - 16.0;
        let chroma = 0.01 * lightness;
        Vec3::new(
            lightness,
            chroma * 500.0 * (x - y),
            chroma * 200.0 * (y - z),
        )
    }

    /// The largest distance of two colours, that of green and blue.
    fn largest(&self) -> f32 {
        hyab(self.lab(Vec3::Y), self.lab(Vec3::Z)).powf(COLOUR_EXPONENT)
    }
}

/// Distance in lightness plus that in chroma (Abasi et al. 2020).
fn hyab(a: Vec3, b: Vec3) -> f32 {
    let apart = a - b;
    apart.x.abs() + apart.y.hypot(apart.z)
}
