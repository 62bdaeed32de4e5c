//! Maps of the fine relief: heights and normals.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec3;
use image::DynamicImage;

use super::texture::{decode, neighbours};
use crate::error::{Error, Result};

/// Heights over a surface; bilinear between the centres of the texels, and repeats outside 0..1.
///
/// White is high. The surface of the mesh lies at the map's mean height.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightMap {
    /// The file it came from; for a map made by code, the name of its file when it is written.
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row. In 0..=1 for integer images (the code as it is, no gamma), as
    /// stored for OpenEXR.
    pub values: Vec<f32>,
}

/// Luminance of linear RGB, Rec. 709.
pub(super) const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

impl HeightMap {
    /// Reads PNG (8 and 16 bit), JPEG or OpenEXR (with R, G and B). The height is the luminance of
    /// a coloured image, else the first channel; alpha is ignored. The second value is a note for
    /// the user if the image is coloured.
    ///
    /// # Errors
    /// A file that cannot be read or decoded; a texel that is not finite.
    pub fn load(path: &Path) -> Result<(Self, Option<String>)> {
        Self::load_channel(path, None)
    }

    /// As [`Self::load`], of one channel where it is given.
    pub(super) fn load_channel(
        path: &Path,
        channel: Option<Channel>,
    ) -> Result<(Self, Option<String>)> {
        Self::from_channels(path, Channels::read(path)?, channel)
    }

    /// As [`Self::load`], of an image that was decoded; `path` names it.
    #[cfg(feature = "formats")]
    pub(super) fn from_image(path: &Path, decoded: DynamicImage) -> Result<Self> {
        Ok(Self::from_channels(path, Channels::of(decoded), None)?.0)
    }

    fn from_channels(
        path: &Path,
        mut image: Channels,
        channel: Option<Channel>,
    ) -> Result<(Self, Option<String>)> {
        if let Some(channel) = channel {
            for texel in &mut image.texels {
                *texel = [channel.of(*texel); 3];
            }
        }
        if let Some(at) = image.find(|texel| !texel.iter().all(|c| c.is_finite())) {
            return Err(image.refuse(path, at, "a height must be finite"));
        }
        let coloured = image.texels.iter().any(|[r, g, b]| r != g || r != b);
        let note = coloured.then(|| {
            let like_normals = match image.looks_like_normals() {
                true => "; it looks like a normal map, which belongs to norm or normal_map",
                false => "",
            };
            format!(
                "{}: a coloured height map: the luminance is taken as the height{like_normals}",
                path.display()
            )
        });
        let value = |texel: &[f32; 3]| match coloured {
            true => (0..3).map(|c| texel[c] * LUMINANCE[c]).sum(),
            false => texel[0],
        };
        let map = Self {
            path: path.to_owned(),
            width: image.width,
            height: image.height,
            values: image.texels.iter().map(value).collect(),
        };
        Ok((map, note))
    }

    /// Whether every value is the same: no relief at all.
    pub fn is_constant(&self) -> bool {
        self.values.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// Mean of the values.
    pub fn mean(&self) -> f64 {
        self.values.iter().map(|&v| f64::from(v)).sum::<f64>() / self.values.len() as f64
    }

    /// The value at texture coordinates (v up), bilinear and repeating; neither scaled nor reduced
    /// by the mean.
    pub fn sample(&self, u: f64, v: f64) -> f64 {
        let (columns, x) = neighbours(u, self.width);
        let (rows, y) = neighbours(1.0 - v, self.height);
        let value = |row: usize, column: usize| {
            f64::from(self.values[rows[row] * self.width as usize + columns[column]])
        };
        let top = value(0, 0) + (value(0, 1) - value(0, 0)) * x;
        let bottom = value(1, 0) + (value(1, 1) - value(1, 0)) * x;
        top + (bottom - top) * y
    }
}

/// Normals of the relief in the tangent frame; repeats outside 0..1.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalMap {
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row. Unit vectors: x along increasing u, y along increasing v (up in
    /// the image), z outward.
    pub normals: Vec<[f32; 3]>,
}

impl NormalMap {
    /// Reads PNG (8 and 16 bit) or OpenEXR (with R, G and B): n = 2c − 1, made a unit vector.
    ///
    /// # Errors
    /// A file that cannot be read or decoded; a texel outside 0..=1; a normal of length 0, or one
    /// that does not point out of the surface (z ≤ 0).
    pub fn load(path: &Path) -> Result<Self> {
        Self::from_image(path, decode(path)?)
    }

    /// As [`Self::load`], of an image that was decoded; `path` names it.
    pub(super) fn from_image(path: &Path, decoded: DynamicImage) -> Result<Self> {
        let image = Channels::of(decoded);
        if let Some(at) = image.find(|texel| !texel.iter().all(|c| (0.0..=1.0).contains(c))) {
            return Err(image.refuse(path, at, "a normal is coded in 0..=1, where 0.5 is zero"));
        }
        let vectors = image.vectors();
        if let Some(at) = vectors.iter().position(|n| n.z <= 0.0) {
            let what = match vectors[at].length_squared() == 0.0 {
                true => "this normal has the length 0",
                false => "this normal points into the surface (blue must be above one half)",
            };
            return Err(image.refuse(path, at, what));
        }
        Ok(Self {
            path: path.to_owned(),
            width: image.width,
            height: image.height,
            normals: vectors
                .iter()
                .map(|n| n.normalize().as_vec3().to_array())
                .collect(),
        })
    }
}

impl NormalMap {
    /// With slopes that are `scale` times as steep.
    pub(super) fn scaled(map: Arc<Self>, scale: f32) -> Arc<Self> {
        if scale == 1.0 {
            return map;
        }
        let steeper = |&[x, y, z]: &[f32; 3]| {
            let [x, y, z] = [x, y, z].map(f64::from);
            let scale = f64::from(scale);
            let n = DVec3::new(scale * x, scale * y, z);
            n.normalize().as_vec3().to_array()
        };
        Arc::new(Self {
            normals: map.normals.iter().map(steeper).collect(),
            ..map.as_ref().clone()
        })
    }
}

/// A channel of an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Channel {
    Red,
    Green,
    Blue,
    Luminance,
}

impl Channel {
    /// By the letter of MTL's `-imfchan`.
    pub fn named(name: &str) -> Option<Self> {
        Some(match name {
            "r" => Self::Red,
            "g" => Self::Green,
            "b" => Self::Blue,
            "l" => Self::Luminance,
            _ => return None,
        })
    }

    pub fn of(self, [r, g, b]: [f32; 3]) -> f32 {
        match self {
            Self::Red => r,
            Self::Green => g,
            Self::Blue => b,
            Self::Luminance => [r, g, b].iter().zip(LUMINANCE).map(|(c, w)| c * w).sum(),
        }
    }
}

/// Whether an image holds normals: it has colours, and most texels are unit vectors that point out
/// of a surface.
///
/// # Errors
/// A file that cannot be read or decoded.
pub(super) fn holds_normals(path: &Path) -> Result<bool> {
    let image = Channels::read(path)?;
    Ok(image.texels.iter().any(|[r, g, b]| r != g || r != b) && image.looks_like_normals())
}

/// An image as it is stored: integer codes over the greatest one, floats untouched.
struct Channels {
    width: u32,
    height: u32,
    texels: Vec<[f32; 3]>,
}

impl Channels {
    fn read(path: &Path) -> Result<Self> {
        Ok(Self::of(decode(path)?))
    }

    fn of(decoded: DynamicImage) -> Self {
        let (width, height) = (decoded.width(), decoded.height());
        let texels = match decoded {
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
                decoded.into_rgb32f().pixels().map(|p| p.0).collect()
            }
            // An 8-bit code c is the 16-bit code 257 c, and c / 255 the same float.
            coded => coded
                .into_rgb16()
                .pixels()
                .map(|p| p.0.map(|code| f32::from(code) / f32::from(u16::MAX)))
                .collect(),
        };
        Self {
            width,
            height,
            texels,
        }
    }

    fn find(&self, bad: impl Fn(&[f32; 3]) -> bool) -> Option<usize> {
        self.texels.iter().position(bad)
    }

    fn refuse(&self, path: &Path, at: usize, what: &str) -> Error {
        let (x, y) = (at % self.width as usize, at / self.width as usize);
        let [r, g, b] = self.texels[at];
        Error::file(path, format!("texel ({x}, {y}) is ({r}, {g}, {b}): {what}"))
    }

    /// 2c − 1 of each texel.
    fn vectors(&self) -> Vec<DVec3> {
        self.texels
            .iter()
            .map(|texel| DVec3::from(texel.map(f64::from)) * 2.0 - 1.0)
            .collect()
    }

    /// Whether most texels are unit vectors that point out of a surface.
    fn looks_like_normals(&self) -> bool {
        let unit = |n: &&DVec3| n.z > 0.0 && (n.length() - 1.0).abs() < 0.1;
        let vectors = self.vectors();
        10 * vectors.iter().filter(unit).count() > 9 * vectors.len()
    }
}
