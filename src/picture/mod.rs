//! Pictures in linear light, of every renderer: their views, their files and their tones.

mod develop;
mod file;
mod projection;
pub mod tone;

use rayon::prelude::*;

pub use develop::{Codes, Development, Tone};
#[cfg(any(feature = "export", feature = "window"))]
pub(crate) use file::exposure_by_area;
pub use file::{FileKind, Picture, SAMPLES};
pub(crate) use file::{Samples, automatic_exposure, mean, write_png};
#[cfg(test)]
pub(crate) use projection::tests;
pub(crate) use projection::{NEAR, Projection, Tile};

use crate::error::{Error, Result};
use crate::scene::Camera;

/// A view of a scene.
#[derive(Debug, Clone, Copy)]
pub struct View<'a> {
    pub camera: &'a Camera,
    /// Pixels.
    pub width: u32,
    pub height: u32,
}

impl View<'_> {
    /// # Errors
    /// A size of 0 or above [`MOST_PIXELS`].
    pub(crate) fn check(&self) -> Result<()> {
        for (name, side) in [("width", self.width), ("height", self.height)] {
            if !(1..=MOST_PIXELS).contains(&side) {
                return Err(Error::Usage(format!(
                    "picture {name} {side} must be in 1..={MOST_PIXELS}"
                )));
            }
        }
        Ok(())
    }
}

/// Most pixels along a side of a picture.
pub const MOST_PIXELS: u32 = 16_384;

/// Which part of the light is drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Light {
    /// All of it.
    #[default]
    Global,
    /// Emission, and light straight from emitters and point lights, reflected once.
    Direct,
    /// The rest: light reflected more than once.
    Indirect,
}

impl Light {
    pub(crate) fn of<T: Copy + Sync + Send>(
        self,
        all: &[T],
        direct: &[T],
        less: impl Fn(T, T) -> T + Sync,
    ) -> Vec<T> {
        match self {
            Self::Global => all.to_vec(),
            Self::Direct => direct.to_vec(),
            Self::Indirect => all
                .par_iter()
                .zip(direct)
                .map(|(&all, &direct)| less(all, direct))
                .collect(),
        }
    }
}
