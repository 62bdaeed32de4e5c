//! A simple shaded picture of a bake: irradiance smoothed over each surface, reflectance textures
//! per sample, 4 × 4 samples a pixel.
//!
//! ```text
//! irradiance ─► smooth ─┐
//! textures ─────────────┼─► passes::shade ──┬─ tile by tile ─► Picture ─► tone ─► .png
//! projection ───────────┤                   │                     └──────────────► .exr
//! light by direction ───┴─► passes::relief ─┘
//! ```

mod compare;
mod flat_relief;
mod flip;
mod gathered;
mod lighting;
mod lights;
mod mesh;
mod overdraw;
mod picture;
mod projection;
mod relief;
mod relief_mesh;
mod relief_scene;
mod relief_surfaces;
mod renderer;
mod seen_scene;
mod shafts;
mod slots;
mod smooth;
mod textures;
pub mod tone;

use std::sync::Arc;

pub use compare::{Comparison, side_by_side};
pub use flip::{Flip, PIXELS_PER_DEGREE, ldr};
pub use lighting::{Direct, Light, Lighting, ReliefShading, Show};
pub use overdraw::Overdraw;
#[cfg(feature = "window")]
pub(crate) use picture::write_png;
pub use picture::{FileKind, Picture, SAMPLES};
pub(crate) use projection::Projection;
pub use renderer::Renderer;
pub use slots::slot_colour;
pub use smooth::corner_irradiance;
#[cfg(feature = "window")]
pub(crate) use textures::upload as upload_texture;

use crate::error::{Error, Result};
use crate::scene::{Camera, Scene};
use crate::vk::Device;

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

/// Renders `scene` under its irradiance E: L = ρ(u, v) · E / π + Le on fronts, black on backs,
/// which also block light. Triangles with relief are drawn by relief mapping where their light by
/// direction is given.
///
/// # Errors
/// A size of 0 or above [`MOST_PIXELS`]; a camera that looks nowhere; a device that lacks the
/// memory or fails.
pub fn render<'a>(
    device: &Arc<Device>,
    scene: &'a Scene,
    lighting: impl Into<Lighting<'a>>,
    view: &View<'a>,
) -> Result<Picture> {
    Renderer::new(device, scene, lighting.into(), view, SAMPLES)?.picture()
}
