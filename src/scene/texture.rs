//! Textures in linear light.

use std::path::{Path, PathBuf};

use image::DynamicImage;

use crate::error::{Error, Result};
use crate::input_file;
use crate::math::random;

/// A linear RGB image; repeats outside 0..1.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row, linear RGB.
    pub texels: Vec<[f32; 3]>,
}

/// Samples along an edge of a triangle, at most: 64² keeps the mean of one element under a
/// millisecond.
const MOST_STRATA: u32 = 64;
/// Of a mean that only the exposure depends on.
#[cfg(feature = "window")]
const FEW_STRATA: u32 = 8;

impl Texture {
    /// Reads PNG (8 and 16 bit) and JPEG as sRGB, OpenEXR as linear light. Grey is expanded to RGB;
    /// alpha is ignored.
    ///
    /// # Errors
    /// A file that cannot be read or decoded, or that passes the decoder's memory limit; a texel
    /// that is negative or not finite.
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_image(path, decode(path)?)
    }

    /// As [`Self::load`], of an image that was decoded; `path` names it.
    pub(super) fn from_image(path: &Path, decoded: DynamicImage) -> Result<Self> {
        let (width, height) = (decoded.width(), decoded.height());
        let texels = match decoded {
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
                decoded.into_rgb32f().pixels().map(|p| p.0).collect()
            }
            coded => {
                let linear = srgb_table();
                coded
                    .into_rgb16()
                    .pixels()
                    .map(|p| p.0.map(|code| linear[usize::from(code)]))
                    .collect::<Vec<_>>()
            }
        };
        let bad = |texel: &[f32; 3]| texel.iter().any(|c| !c.is_finite() || *c < 0.0);
        if let Some(at) = texels.iter().position(bad) {
            let (x, y) = (at % width as usize, at / width as usize);
            let [r, g, b] = texels[at];
            return Err(Error::file(
                path,
                format!("texel ({x}, {y}) is ({r}, {g}, {b}): must be finite and not negative"),
            ));
        }
        Ok(Self {
            path: path.to_owned(),
            width,
            height,
            texels,
        })
    }

    /// The greatest value of each channel.
    pub fn highest(&self) -> [f32; 3] {
        self.texels.iter().fold([0.0; 3], |highest, texel| {
            std::array::from_fn(|c| highest[c].max(texel[c]))
        })
    }

    /// Mean of the texels, linear RGB.
    pub(super) fn mean(&self) -> [f32; 3] {
        let mut sum = [0.0_f64; 3];
        for texel in &self.texels {
            (0..3).for_each(|c| sum[c] += f64::from(texel[c]));
        }
        sum.map(|sum| (sum / self.texels.len() as f64) as f32)
    }

    /// Bilinear, repeating; v is up, so v = 0 is the bottom edge. Texel centres lie at
    /// half-integers.
    pub fn sample_bilinear(&self, u: f32, v: f32) -> [f32; 3] {
        self.bilinear(f64::from(u), f64::from(v))
    }

    /// The same for coordinates that have not been rounded.
    pub(crate) fn bilinear(&self, u: f64, v: f64) -> [f32; 3] {
        let (columns, x) = neighbours(u, self.width);
        let (rows, y) = neighbours(1.0 - v, self.height);
        let (x, y) = (x as f32, y as f32);
        let texel = |row: usize, column: usize| {
            self.texels[rows[row] * self.width as usize + columns[column]]
        };
        let (a, b, c, d) = (texel(0, 0), texel(0, 1), texel(1, 0), texel(1, 1));
        std::array::from_fn(|i| {
            let top = a[i] + (b[i] - a[i]) * x;
            let bottom = c[i] + (d[i] - c[i]) * x;
            top + (bottom - top) * y
        })
    }

    /// The area mean over a triangle in texture space, linear RGB.
    ///
    /// The triangle is cut into n² equal ones with n twice its longest edge in texels, at most 64,
    /// and each is sampled once: at its centroid, or at a fixed pseudo-random place where n was
    /// limited, so that a regular texture does not alias with the samples. The same input gives the
    /// same bits.
    pub fn mean_over_triangle(&self, uv: &[[f32; 2]; 3]) -> [f32; 3] {
        self.mean_by(uv, MOST_STRATA)
    }

    /// The same by a few samples.
    #[cfg(feature = "window")]
    pub(crate) fn about_over_triangle(&self, uv: &[[f32; 2]; 3]) -> [f32; 3] {
        self.mean_by(uv, FEW_STRATA)
    }

    fn mean_by(&self, uv: &[[f32; 2]; 3], most: u32) -> [f32; 3] {
        let [a, b, c] = uv.map(|[u, v]| [f64::from(u), f64::from(v)]);
        let wanted = 2.0 * self.longest_edge([a, b, c]);
        // A float cast saturates, so an enormous triangle also gets the limit.
        let n = (wanted.ceil() as u32).clamp(1, most);
        let jitter = wanted > f64::from(most);
        let mut sum = [0.0_f64; 3];
        let mut stratum = 0_u64;
        for i in 0..n {
            for j in 0..n - i {
                for inverted in [false, true] {
                    if inverted && i + j + 1 == n {
                        continue;
                    }
                    let (mut s, mut t) = if jitter {
                        place_in_triangle(stratum)
                    } else {
                        (1.0 / 3.0, 1.0 / 3.0)
                    };
                    stratum += 1;
                    if inverted {
                        (s, t) = (1.0 - s, 1.0 - t);
                    }
                    let s = (f64::from(i) + s) / f64::from(n);
                    let t = (f64::from(j) + t) / f64::from(n);
                    let at = |k: usize| a[k] + (b[k] - a[k]) * s + (c[k] - a[k]) * t;
                    let texel = self.bilinear(at(0), at(1));
                    (0..3).for_each(|k| sum[k] += f64::from(texel[k]));
                }
            }
        }
        sum.map(|total| (total / stratum as f64) as f32)
    }

    fn longest_edge(&self, [a, b, c]: [[f64; 2]; 3]) -> f64 {
        let texels = |p: [f64; 2], q: [f64; 2]| {
            ((p[0] - q[0]) * f64::from(self.width)).hypot((p[1] - q[1]) * f64::from(self.height))
        };
        texels(a, b).max(texels(b, c)).max(texels(c, a))
    }
}

/// Most texels of an image: 8192 × 16384. As colours they take 1.6 GB.
const MOST_TEXELS: u64 = 1 << 27;

/// A byte of a deflated stream stands for 1032 bytes at most, and one of these for 8 texels of one
/// bit. Files that claim more are damaged; they are refused before memory is asked for.
const MOST_TEXELS_PER_BYTE: u64 = 1032 * 8;

/// An image as its file stores it; the first bytes give the format.
pub(super) fn decode(path: &Path) -> Result<DynamicImage> {
    decode_bytes(&input_file::read(path)?).map_err(|what| Error::file(path, what))
}

/// As [`decode`], of the bytes of a file. An error is what is to be said of it.
pub(super) fn decode_bytes(bytes: &[u8]) -> std::result::Result<DynamicImage, String> {
    let refuse = |error| format!("cannot be decoded: {error}");
    let reader = || {
        image::ImageReader::new(std::io::Cursor::new(bytes))
            .with_guessed_format()
            .map_err(|error| format!("cannot be read: {error}"))
    };
    let (width, height) = reader()?.into_dimensions().map_err(refuse)?;
    let texels = u64::from(width) * u64::from(height);
    if texels > MOST_TEXELS {
        return Err(format!(
            "{width} × {height} texels are more than {MOST_TEXELS}"
        ));
    }
    if texels > MOST_TEXELS_PER_BYTE * bytes.len() as u64 {
        let length = bytes.len();
        return Err(format!(
            "{width} × {height} texels are more than its {length} bytes can hold"
        ));
    }
    let mut whole = reader()?;
    // What is decoded is bounded by the texels.
    whole.no_limits();
    whole.decode().map_err(refuse)
}

/// The two texels about a coordinate in repeats, and the weight of the second.
pub(super) fn neighbours(coordinate: f64, size: u32) -> ([usize; 2], f64) {
    // Remainders and floors are calls, and this is asked millions of times.
    let at = repeated(coordinate) * f64::from(size) - 0.5;
    let last = size as usize - 1;
    let low = at as usize;
    let (first, before) = match at < 0.0 {
        true => (last, -1.0),
        false => (low.min(last), low as f64),
    };
    let second = if first == last { 0 } else { first + 1 };
    ([first, second], at - before)
}

/// The remainder to 1, which is in 0..=1, of a finite number: as `rem_euclid`, to the bit.
fn repeated(coordinate: f64) -> f64 {
    let inside = coordinate - coordinate as i64 as f64;
    let inside = match inside < 0.0 {
        true => inside + 1.0,
        false => inside,
    };
    // Larger ones are whole numbers.
    if coordinate.abs() < 1e16 { inside } else { 0.0 }
}

/// A uniform place in the triangle (0,0), (1,0), (0,1), the same for the same number.
fn place_in_triangle(number: u64) -> (f64, f64) {
    let z = random::next(&mut number.wrapping_mul(random::STEP));
    let unit = |bits: u64| bits as f64 / f64::from(u32::MAX);
    let (s, t) = (unit(z >> 32), unit(z & u64::from(u32::MAX)));
    if s + t > 1.0 {
        (1.0 - s, 1.0 - t)
    } else {
        (s, t)
    }
}

/// Linear light of each 16-bit sRGB code, IEC 61966-2-1. An 8-bit code c is the 16-bit code 257 c.
pub(super) fn srgb_table() -> Vec<f32> {
    (0..=u16::MAX)
        .map(|code| {
            let c = f64::from(code) / f64::from(u16::MAX);
            let linear = if c <= 0.04045 {
                c / 12.92
            } else {
                ((c + 0.055) / 1.055).powf(2.4)
            };
            linear as f32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// To the bit, at steps and between, of both signs and all sizes.
    #[test]
    fn neighbours_are_found_without_remainders() {
        let plain = |coordinate: f64, size: u32| {
            let at = coordinate.rem_euclid(1.0) * f64::from(size) - 0.5;
            let low = at.floor();
            let first = (low as i64).rem_euclid(i64::from(size)) as usize;
            ([first, (first + 1) % size as usize], at - low)
        };
        let mut state = 5;
        let some = (0..20_000).map(|i| {
            let z = random::next(&mut state);
            let size = 2.0_f64.powi((i % 80) - 60);
            (z as i64 as f64 / i64::MAX as f64) * size
        });
        let steps = (-40..40).flat_map(|i| {
            let at = f64::from(i) / 8.0;
            [at, at.next_up(), at.next_down()]
        });
        let extreme = [0.0, -0.0, 1e-300, -1e-300, 4e15 + 0.5, -9e15, 1e18, -1e300];
        for coordinate in some.chain(steps).chain(extreme) {
            for size in [1, 2, 7, 512] {
                let (expected, found) = (plain(coordinate, size), neighbours(coordinate, size));
                assert_eq!(found.0, expected.0, "{coordinate} of {size}");
                assert_eq!(
                    found.1.to_bits(),
                    expected.1.to_bits(),
                    "{coordinate} of {size}"
                );
            }
        }
    }
}
