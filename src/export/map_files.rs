//! Light maps as files.

use std::io::{self, Cursor};
use std::path::{Path, PathBuf};

use exr::prelude::{SpecificChannels, WritableImage, f16};
use glam::Vec3;
use image::ImageEncoder;
use image::codecs::hdr::HdrEncoder;
use image::codecs::png::PngEncoder;

use super::ktx2;
use super::light_map::LightMap;
use super::texels::NOTHING;
use crate::atomic_file::{with_ending, write_atomically};
use crate::error::{Error, Result};
use crate::picture::tone::coded;
use crate::solver::LightAt;

/// Which light a map holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Global,
    Direct,
    Indirect,
}

impl Part {
    pub fn of(self, light: &LightAt) -> Vec3 {
        match self {
            Self::Global => light.direct + light.indirect,
            Self::Direct => light.direct,
            Self::Indirect => light.indirect,
        }
    }
}

/// A kind of file that holds a light map.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapFile {
    /// OpenEXR of half floats: irradiance, W·m⁻².
    Exr,
    /// Radiance RGBE: irradiance, W·m⁻².
    Hdr,
    /// 8-bit RGBM: irradiance is RGB · alpha · `scale`.
    Rgbm,
    /// 8-bit sRGB: irradiance is the linear value times `scale`; more is cut off.
    Srgb,
    /// KTX 2 in BC6H blocks: irradiance, W·m⁻².
    Ktx2,
}

impl MapFile {
    /// By a path's ending: `.exr`, `.hdr`, `.ktx2`, `.rgbm.png`, `.png`.
    ///
    /// # Errors
    /// Any other ending.
    pub fn of(path: &Path) -> Result<Self> {
        let name = path.to_string_lossy().to_lowercase();
        let kinds = [
            (".exr", Self::Exr),
            (".hdr", Self::Hdr),
            (".ktx2", Self::Ktx2),
            (".rgbm.png", Self::Rgbm),
            (".png", Self::Srgb),
        ];
        let found = kinds.into_iter().find(|(ending, _)| name.ends_with(ending));
        found.map(|(_, kind)| kind).ok_or_else(|| {
            Error::Usage(format!(
                "light map {}: the name must end in .exr, .hdr, .ktx2, .rgbm.png or .png",
                path.display()
            ))
        })
    }
}

/// A page in memory: irradiance, `[row][column]` from the top, W·m⁻², RGB. Texels outside of the
/// charts hold the light of those beside them.
pub struct Page {
    pub width: u32,
    pub height: u32,
    pub irradiance: Vec<Vec3>,
}

impl LightMap {
    /// A page, filled between its charts.
    pub fn page(&self, page: u32, part: Part) -> Page {
        self.page_of(page, |t| part.of(&self.light[t]))
    }

    /// A page of other values of the texels.
    pub fn page_of(&self, page: u32, value: impl Fn(usize) -> Vec3) -> Page {
        let (width, height) = (self.pages.width, self.pages.height);
        let count = width as usize * height as usize;
        let index = &self.map.index[page as usize * count..][..count];
        let known = index.iter().map(|&t| match t {
            NOTHING => None,
            t => Some(value(t as usize)),
        });
        let irradiance = filled(known.collect(), width as usize);
        Page {
            width,
            height,
            irradiance,
        }
    }

    /// The scale of files of 8 bits, a power of two: 99.9 % of the texels are less bright.
    pub fn scale(&self, part: Part) -> f32 {
        let mut values: Vec<f32> = (self.light.iter())
            .map(|light| part.of(light).max_element())
            .collect();
        if values.is_empty() {
            return 1.0;
        }
        let at = (values.len() - 1) * 999 / 1000;
        let (_, value, _) = values.select_nth_unstable_by(at, f32::total_cmp);
        value.max(f32::MIN_POSITIVE).log2().ceil().exp2()
    }

    /// Writes each page to a file of its own: `NAME.exr`, or `NAME-1.exr`, `NAME-2.exr` and so on.
    /// Returns their paths.
    ///
    /// # Errors
    /// An ending that is not of a light map; a file that cannot be written.
    pub fn write(&self, path: &Path, part: Part) -> Result<Vec<PathBuf>> {
        let kind = MapFile::of(path)?;
        let paths = self.paths(path);
        let scale = self.scale(part);
        for (number, path) in (0..).zip(&paths) {
            self.page(number, part).write(path, kind, scale)?;
        }
        Ok(paths)
    }

    /// Paths of the files that [`Self::write`] writes.
    pub fn paths(&self, path: &Path) -> Vec<PathBuf> {
        if self.pages.count == 1 {
            return vec![path.to_owned()];
        }
        let is_rgbm = matches!(MapFile::of(path), Ok(MapFile::Rgbm));
        let (before, ending) = match is_rgbm {
            true => (path.with_extension(""), "rgbm.png".into()),
            false => {
                let ending = path.extension().unwrap_or_default();
                (path.to_owned(), ending.to_string_lossy())
            }
        };
        (1..=self.pages.count)
            .map(|number| with_ending(&before, &format!("-{number}.{ending}")))
            .collect()
    }
}

/// Gives each empty texel the mean of the full ones about it, ring after ring.
fn filled(mut texels: Vec<Option<Vec3>>, width: usize) -> Vec<Vec3> {
    let height = texels.len() / width.max(1);
    let around = |i: usize| {
        let (x, y) = (i % width, i / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        rows.flat_map(move |row| {
            let columns = x.saturating_sub(1)..(x + 2).min(width);
            columns.map(move |column| row * width + column)
        })
    };
    let is_empty = |texels: &[Option<Vec3>], i: usize| texels[i].is_none();
    let borders = |texels: &[Option<Vec3>], i: usize| around(i).any(|j| texels[j].is_some());
    let mut ring: Vec<usize> = (0..texels.len())
        .filter(|&i| is_empty(&texels, i) && borders(&texels, i))
        .collect();
    while !ring.is_empty() {
        let mean = |&i: &usize| {
            let full: Vec<Vec3> = around(i).filter_map(|j| texels[j]).collect();
            full.iter().sum::<Vec3>() / full.len() as f32
        };
        let values: Vec<Vec3> = ring.iter().map(mean).collect();
        for (&i, value) in ring.iter().zip(values) {
            texels[i] = Some(value);
        }
        let mut next: Vec<usize> = (ring.iter())
            .flat_map(|&i| around(i))
            .filter(|&j| is_empty(&texels, j))
            .collect();
        next.sort_unstable();
        next.dedup();
        ring = next;
    }
    texels.into_iter().map(Option::unwrap_or_default).collect()
}

impl Page {
    /// Writes the page; `scale` is that of files of 8 bits.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path, kind: MapFile, scale: f32) -> Result<()> {
        write_atomically(path, |out| {
            let bytes = self.encoded(kind, scale)?;
            out.write_all(&bytes)
        })
    }

    /// The bytes of a file.
    ///
    /// # Errors
    /// An encoder that fails.
    pub fn encoded(&self, kind: MapFile, scale: f32) -> io::Result<Vec<u8>> {
        let mut out = Cursor::new(Vec::new());
        let (width, height) = (self.width, self.height);
        match kind {
            MapFile::Ktx2 => return ktx2::encode(width, height, &self.irradiance),
            MapFile::Exr => {
                let at = |at: exr::math::Vec2<usize>| {
                    let value = self.irradiance[at.y() * width as usize + at.x()];
                    let [r, g, b] = value.to_array().map(|c| f16::from_f32(c.min(65504.0)));
                    (r, g, b)
                };
                let channels = SpecificChannels::rgb(at);
                let size = (width as usize, height as usize);
                exr::image::Image::from_channels(size, channels)
                    .write()
                    .to_buffered(&mut out)
                    .map_err(io::Error::other)?;
            }
            MapFile::Hdr => {
                let texels: Vec<_> = (self.irradiance.iter())
                    .map(|value| image::Rgb(value.to_array()))
                    .collect();
                HdrEncoder::new(&mut out)
                    .encode(&texels, width as usize, height as usize)
                    .map_err(io::Error::other)?;
            }
            MapFile::Rgbm => {
                let codes: Vec<u8> = (self.irradiance.iter())
                    .flat_map(|value| rgbm(*value / scale))
                    .collect();
                PngEncoder::new(&mut out)
                    .write_image(&codes, width, height, image::ExtendedColorType::Rgba8)
                    .map_err(io::Error::other)?;
            }
            MapFile::Srgb => {
                let codes = self.srgb(scale);
                PngEncoder::new(&mut out)
                    .write_image(&codes, width, height, image::ExtendedColorType::Rgb8)
                    .map_err(io::Error::other)?;
            }
        }
        Ok(out.into_inner())
    }

    /// 8-bit sRGB codes of the irradiance over `scale`.
    pub fn srgb(&self, scale: f32) -> Vec<u8> {
        (self.irradiance.iter())
            .flat_map(|value| (*value / scale).to_array())
            .map(|linear| (255.0 * coded(linear)).round() as u8)
            .collect()
    }
}

/// RGB over the greatest of them, and that as alpha, rounded up.
fn rgbm(value: Vec3) -> [u8; 4] {
    let most = value.max_element().clamp(1.0 / 255.0, 1.0);
    let alpha = (255.0 * most).ceil();
    let [r, g, b] = value.to_array().map(|c| {
        let code = 255.0 * c / (alpha / 255.0);
        code.clamp(0.0, 255.0).round() as u8
    });
    [r, g, b, alpha as u8]
}
