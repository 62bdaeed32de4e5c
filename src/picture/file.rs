//! A picture in linear light, and its files.

use std::io;
#[cfg(feature = "formats")]
use std::io::Cursor;
use std::path::Path;

use image::ImageEncoder;
#[cfg(feature = "formats")]
use image::codecs::hdr::HdrEncoder;
#[cfg(feature = "formats")]
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use rayon::prelude::*;

use super::develop::{Codes, Development};
use super::tone;
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input_file;

/// Samples of a pixel along each side that a picture is made of by default, and that one keeps
/// where they differ, each the mean of more where more are drawn.
pub const SAMPLES: u32 = 4;

/// The samples of one pixel, W·m⁻²·sr⁻¹, RGB.
pub type Samples = [[f32; 3]; (SAMPLES * SAMPLES) as usize];

/// A rendered picture.
#[derive(Debug, Clone)]
pub struct Picture {
    pub width: u32,
    pub height: u32,
    /// Mean radiance of each pixel, `[row][column]` from the top left, W·m⁻²·sr⁻¹, linear RGB.
    /// Black where nothing is.
    pub radiance: Vec<[f32; 3]>,
    /// The exposure, as a power of two, of a picture written without one, see [`Picture::write`].
    pub automatic_exposure: f32,
    /// Place in `radiance`, ascending, and samples of each pixel of strong contrast. The mean
    /// suffices for the others, so that a picture of 16384² fits in memory.
    pub(crate) contrasts: Vec<(u32, Samples)>,
}

/// Value of the 90th percentile of luminance after automatic exposure.
const METER_TARGET: f32 = 0.6;

/// The exposure, as a power of two, for pixels of these luminances.
pub(crate) fn automatic_exposure(metered: &mut [f32]) -> f32 {
    if metered.is_empty() {
        return 0.0;
    }
    let place = (metered.len() - 1) * 9 / 10;
    let (_, &mut bright, _) = metered.select_nth_unstable_by(place, f32::total_cmp);
    // A black picture needs no exposure.
    if bright > 0.0 {
        (METER_TARGET / bright).log2()
    } else {
        0.0
    }
}

/// Share of a surface that is darker than what the exposure is for.
#[cfg(any(feature = "export", feature = "window"))]
const METERED_SHARE: f64 = 0.9;

/// The exposure, as a power of two, for surfaces of these luminances and areas: as for the pixels
/// of a picture that shows each by its area.
#[cfg(any(feature = "export", feature = "window"))]
pub(crate) fn exposure_by_area(surfaces: impl Iterator<Item = (f32, f64)>) -> f32 {
    // What no light reaches, backs of walls most of all, is not exposed for.
    let mut lit: Vec<_> = surfaces.filter(|(luminance, _)| *luminance > 0.0).collect();
    lit.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let whole: f64 = lit.iter().map(|l| l.1).sum();
    let mut below = 0.0;
    let bright = lit.iter().find(|(_, area)| {
        below += area;
        below >= METERED_SHARE * whole
    });
    bright.map_or(0.0, |(luminance, _)| (METER_TARGET / luminance).log2())
}

/// A kind of picture file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    Png,
    Exr,
    Hdr,
}

impl FileKind {
    /// By a path's ending, in upper or lower case.
    ///
    /// # Errors
    /// Any other ending.
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|e| e.to_string_lossy().to_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some("hdr") => Ok(Self::Hdr),
            _ => Err(Error::Usage(format!(
                "picture {}: the name must end in .png (tone-mapped), .exr or .hdr (linear \
                 radiance)",
                path.display()
            ))),
        }
    }
}

impl Picture {
    /// A picture of pixels without samples of their own, `[row][column]` from the top left;
    /// `metered` marks those that the exposure meter counts.
    pub fn new((width, height): (u32, u32), radiance: Vec<[f32; 3]>, metered: &[bool]) -> Self {
        let mut luminances: Vec<_> = radiance
            .iter()
            .zip(metered)
            .filter(|(_, metered)| **metered)
            .map(|(&radiance, _)| tone::luminance(radiance))
            .collect();
        Self {
            width,
            height,
            automatic_exposure: automatic_exposure(&mut luminances),
            radiance,
            contrasts: Vec::new(),
        }
    }

    /// Pictures of equal height side by side, exposed as the last one.
    pub fn side_by_side(pictures: &[Self]) -> Result<Self> {
        let last = pictures
            .last()
            .ok_or_else(|| Error::Usage("no pictures to put side by side".into()))?;
        if pictures.iter().any(|p| p.height != last.height) {
            return Err(Error::Usage(
                "pictures of different heights do not stand side by side".into(),
            ));
        }
        let width: u32 = pictures.iter().map(|p| p.width).sum();
        let mut radiance = Vec::with_capacity(width as usize * last.height as usize);
        for row in 0..last.height as usize {
            for p in pictures {
                let of_row = row * p.width as usize..(row + 1) * p.width as usize;
                radiance.extend_from_slice(&p.radiance[of_row]);
            }
        }
        let mut contrasts = Vec::new();
        let mut left = 0;
        for p in pictures {
            let moved = |place: u32| place / p.width * width + left + place % p.width;
            contrasts.extend(
                p.contrasts
                    .iter()
                    .map(|&(place, samples)| (moved(place), samples)),
            );
            left += p.width;
        }
        contrasts.sort_unstable_by_key(|c| c.0);
        Ok(Self {
            width,
            height: last.height,
            radiance,
            automatic_exposure: last.automatic_exposure,
            contrasts,
        })
    }

    /// Pictures of one width below each other, each brightened as much as its own exposure is above
    /// that of the last.
    ///
    /// # Errors
    /// None, or of different widths.
    pub fn stacked(pictures: &[Self]) -> Result<Self> {
        let last = pictures
            .last()
            .ok_or_else(|| Error::Usage("no pictures to stack".into()))?;
        if pictures.iter().any(|p| p.width != last.width) {
            return Err(Error::Usage(
                "pictures of different widths do not stand below each other".into(),
            ));
        }
        let scaled = |p: &Self| -> Vec<[f32; 3]> {
            let gain = (p.automatic_exposure - last.automatic_exposure).exp2();
            let radiance = p.radiance.iter();
            radiance.map(|pixel| pixel.map(|c| c * gain)).collect()
        };
        Ok(Self {
            width: last.width,
            height: pictures.iter().map(|p| p.height).sum(),
            radiance: pictures.iter().flat_map(scaled).collect(),
            automatic_exposure: last.automatic_exposure,
            contrasts: Vec::new(),
        })
    }

    /// Reads linear radiance from an OpenEXR or Radiance HDR file; all pixels are metered.
    ///
    /// # Errors
    /// A file that cannot be read, or that holds no finite RGB.
    pub fn read(path: &Path) -> Result<Self> {
        let format = match FileKind::of(path)? {
            FileKind::Exr => image::ImageFormat::OpenExr,
            FileKind::Hdr => image::ImageFormat::Hdr,
            FileKind::Png => {
                let what = "a PNG holds no radiance: give an .exr or .hdr";
                return Err(Error::file(path, what));
            }
        };
        let bytes = input_file::read(path)?;
        let decoded = image::load_from_memory_with_format(&bytes, format)
            .map_err(|e| Error::file(path, e.to_string()))?
            .into_rgb32f();
        let size = decoded.dimensions();
        let radiance: Vec<[f32; 3]> = decoded.pixels().map(|p| p.0).collect();
        if radiance.as_flattened().iter().any(|v| !v.is_finite()) {
            return Err(Error::file(path, "not all numbers are finite"));
        }
        let metered = vec![true; radiance.len()];
        Ok(Self::new(size, radiance, &metered))
    }

    /// Writes the picture, by the ending of `path`: `.png` as `development` says, which may be an
    /// exposure alone; `.exr` and `.hdr` as linear radiance, W·m⁻²·sr⁻¹, as it is: 32-bit floats,
    /// Radiance's RGBE.
    ///
    /// # Errors
    /// Another ending; a file that cannot be written.
    pub fn write(&self, path: &Path, development: impl Into<Development>) -> Result<()> {
        let development = development.into();
        let size = (self.width, self.height);
        match (FileKind::of(path)?, development.codes) {
            (FileKind::Png, Codes::Srgb8) => write_png(path, size, &self.srgb_codes(development)),
            (FileKind::Png, codes) => self.write_deep_png(path, development, codes),
            #[cfg(not(feature = "formats"))]
            (FileKind::Exr | FileKind::Hdr, _) => Err(Error::file(
                path,
                "OpenEXR and Radiance HDR need the Cargo feature `formats`",
            )),
            #[cfg(feature = "formats")]
            (FileKind::Exr, _) => write_atomically(path, |out| {
                // The encoder seeks back to fill in its table, which a stream cannot.
                let mut whole = Cursor::new(Vec::new());
                OpenExrEncoder::new(&mut whole)
                    .write_image(
                        bytemuck::cast_slice(&self.radiance),
                        self.width,
                        self.height,
                        image::ExtendedColorType::Rgb32F,
                    )
                    .map_err(io::Error::other)?;
                out.write_all(whole.get_ref())
            }),
            #[cfg(feature = "formats")]
            (FileKind::Hdr, _) => write_atomically(path, |out| {
                let pixels: Vec<_> = self.radiance.iter().map(|&c| image::Rgb(c)).collect();
                let [width, height] = [self.width, self.height].map(|side| side as usize);
                HdrEncoder::new(out)
                    .encode(&pixels, width, height)
                    .map_err(io::Error::other)
            }),
        }
    }

    /// 16 bits a channel.
    fn write_deep_png(&self, path: &Path, development: Development, codes: Codes) -> Result<()> {
        let linear = self.developed(&development);
        let code = |&value: &f32| {
            let value = match codes {
                Codes::Linear16 => value.clamp(0.0, 1.0),
                _ => tone::coded(value),
            };
            ((65535.0 * value).round() as u16).to_be_bytes()
        };
        let bytes: Vec<u8> = linear.as_flattened().iter().flat_map(code).collect();
        write_atomically(path, |out| {
            let mut encoder = png::Encoder::new(out, self.width, self.height);
            encoder.set_color(png::ColorType::Rgb);
            encoder.set_depth(png::BitDepth::Sixteen);
            match codes {
                Codes::Linear16 => encoder.set_source_gamma(png::ScaledFloat::new(1.0)),
                _ => encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric),
            }
            let mut writer = encoder.write_header().map_err(io::Error::other)?;
            writer.write_image_data(&bytes).map_err(io::Error::other)?;
            writer.finish().map_err(io::Error::other)
        })
    }

    /// Linear RGB of each pixel as it is shown.
    fn developed(&self, development: &Development) -> Vec<[f32; 3]> {
        let shown = development.shown(self.automatic_exposure);
        let mut linear: Vec<[f32; 3]> = self.radiance.par_iter().map(|&r| shown(r)).collect();
        // Tone-mapped before they are averaged: otherwise one sample of a lamp dominates its pixel,
        // and the lamp's edge is jagged.
        for (place, samples) in &self.contrasts {
            linear[*place as usize] = mean(&samples.map(&shown));
        }
        linear
    }

    /// 8-bit sRGB codes, `[row][column][channel]`.
    pub(crate) fn srgb_codes(&self, development: impl Into<Development>) -> Vec<u8> {
        self.srgb_codes_at([0, 0], development)
    }

    /// The same of a part of a larger picture, by the column and the row of its corner there.
    pub(crate) fn srgb_codes_at(
        &self,
        [left, top]: [u32; 2],
        development: impl Into<Development>,
    ) -> Vec<u8> {
        let linear = self.developed(&development.into());
        let width = self.width as usize;
        let mut codes = vec![0; 3 * linear.len()];
        codes
            .par_chunks_mut(3 * width)
            .zip(linear.par_chunks(width))
            .enumerate()
            .for_each(|(row, (codes, linear))| {
                for (column, (code, linear)) in codes.chunks_mut(3).zip(linear).enumerate() {
                    for channel in 0..3 {
                        code[channel] =
                            tone::code(linear[channel], left + column as u32, top + row as u32);
                    }
                }
            });
        codes
    }
}

/// Writes 8-bit codes, `[row][column][channel]`.
pub(crate) fn write_png(path: &Path, (width, height): (u32, u32), codes: &[u8]) -> Result<()> {
    write_atomically(path, |out| {
        PngEncoder::new(out)
            .write_image(codes, width, height, image::ExtendedColorType::Rgb8)
            .map_err(io::Error::other)
    })
}

/// The mean of a pixel's samples.
pub(crate) fn mean(samples: &Samples) -> [f32; 3] {
    std::array::from_fn(|c| samples.iter().map(|s| s[c]).sum::<f32>() / samples.len() as f32)
}
