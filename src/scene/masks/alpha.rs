//! Alpha of an image, and what of it is opaque.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::DVec2;
use image::DynamicImage;

use crate::error::Result;
use crate::scene::maps::Channel;
use crate::scene::texture::decode;

/// Opacity by place, 0..=1; repeats outside 0..1.
#[derive(Debug, Clone, PartialEq)]
pub struct AlphaMap {
    pub path: PathBuf,
    pub width: u32,
    pub height: u32,
    /// Row-major from the top row.
    pub alpha: Vec<f32>,
}

/// Which surfaces of a material are there: those whose alpha is the cutoff or more.
#[derive(Debug, Clone, PartialEq)]
pub struct AlphaMask {
    pub map: Arc<AlphaMap>,
    /// Alpha is as many times that of the map.
    pub factor: f32,
    pub cutoff: f32,
}

/// The cutoff of what does not give one.
pub(crate) const DEFAULT_CUTOFF: f32 = 0.5;

impl AlphaMap {
    /// One alpha everywhere.
    pub fn even(path: &Path, alpha: f32) -> Self {
        Self {
            path: path.to_owned(),
            width: 1,
            height: 1,
            alpha: vec![alpha],
        }
    }

    /// Reads a mask, see [`Self::from_image`].
    ///
    /// # Errors
    /// A file that cannot be read or decoded.
    pub(in crate::scene) fn load(path: &Path, channel: Option<Channel>) -> Result<Self> {
        Ok(Self::from_image(path, decode(path)?, channel))
    }

    /// A channel of an image as it is coded; without one the alpha channel, or the luminance of an
    /// image that has no alpha channel or an opaque one.
    pub(in crate::scene) fn from_image(
        path: &Path,
        decoded: DynamicImage,
        channel: Option<Channel>,
    ) -> Self {
        let (width, height) = (decoded.width(), decoded.height());
        let texels = decoded.into_rgba32f();
        let is_opaque = texels.pixels().all(|p| p.0[3] >= 1.0);
        let of = |&[r, g, b, a]: &[f32; 4]| match channel {
            Some(channel) => channel.of([r, g, b]),
            None if is_opaque => Channel::Luminance.of([r, g, b]),
            None => a,
        };
        Self {
            path: path.to_owned(),
            width,
            height,
            alpha: texels.pixels().map(|p| finite(of(&p.0))).collect(),
        }
    }

    /// The alpha channel of an image as it is coded.
    pub(in crate::scene) fn alpha_of(path: &Path, decoded: DynamicImage) -> Self {
        let (width, height) = (decoded.width(), decoded.height());
        let texels = decoded.into_rgba32f();
        Self {
            path: path.to_owned(),
            width,
            height,
            alpha: texels.pixels().map(|p| finite(p.0[3])).collect(),
        }
    }
}

/// 0..=1; floats of OpenEXR may be anything.
fn finite(alpha: f32) -> f32 {
    match alpha.is_nan() {
        true => 0.0,
        false => alpha.clamp(0.0, 1.0),
    }
}

impl AlphaMask {
    /// Texels: the size of one repeat.
    pub(super) fn size(&self) -> DVec2 {
        DVec2::new(f64::from(self.map.width), f64::from(self.map.height))
    }

    /// Places in texels from the middle of the first one, right and down.
    pub(super) fn in_texels(&self, [u, v]: [f32; 2]) -> DVec2 {
        DVec2::new(f64::from(u), 1.0 - f64::from(v)) * self.size() - 0.5
    }

    /// Alpha beyond the cutoff in the middle of a texel: 0 or more is opaque.
    pub(super) fn texel(&self, x: usize, y: usize) -> f64 {
        let alpha = self.map.alpha[y * self.map.width as usize + x];
        f64::from(alpha) * f64::from(self.factor) - f64::from(self.cutoff)
    }

    /// The same at any place, bilinear.
    pub(super) fn is_opaque_at(&self, place: DVec2) -> bool {
        let low = place.floor();
        let share = place - low;
        let size = self.size();
        let texel = |at: DVec2| {
            let at = at.rem_euclid(size);
            self.texel(at.x as usize, at.y as usize)
        };
        let row = |y: f64| {
            let at = low + DVec2::new(0.0, y);
            let (left, right) = (texel(at), texel(at + DVec2::X));
            left + (right - left) * share.x
        };
        let (top, bottom) = (row(0.0), row(1.0));
        top + (bottom - top) * share.y >= 0.0
    }
}
