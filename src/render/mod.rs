//! A simple shaded picture of a bake: irradiance smoothed over each surface, reflectance textures
//! per sample, 4 × 4 samples a pixel or more.
//!
//! ```text
//! irradiance ─► smooth ─┐
//! textures ─────────────┼─► passes::shade ──┬─ tile by tile ─► Picture ─► tone ─► .png
//! projection ───────────┤                   │                     └──────────────► .exr
//! light by direction ───┴─► passes::relief ─┘
//! ```

mod background;
mod blocks;
mod compare;
mod convex;
mod emitters;
mod factor_texels;
mod flat_relief;
mod flip;
mod gathered;
mod lighting;
mod lights;
mod mesh;
mod mesh_scene;
mod overdraw;
mod parts;
mod prepared;
mod relief;
mod relief_borders;
mod relief_light;
mod relief_mesh;
mod relief_scene;
mod relief_surfaces;
mod renderer;
mod seen_scene;
mod shaft_lamps;
mod shaft_starts;
mod shafts;
mod slots;
mod textures;

use std::sync::Arc;

pub use compare::{Comparison, side_by_side};
pub use flip::{Flip, PIXELS_PER_DEGREE, ldr};
pub use lighting::{Direct, Lighting, ReliefShading, Show};
pub use overdraw::Overdraw;
pub use renderer::{Cuts, MOST_SAMPLES, Renderer};
pub use slots::slot_colour;
#[cfg(feature = "window")]
pub(crate) use textures::upload as upload_texture;

use crate::error::Result;
pub use crate::mesh::corners::{Joined, corner_irradiance};
pub use crate::picture::{
    Codes, Development, FileKind, Light, MOST_PIXELS, Picture, SAMPLES, Tone, View, tone,
};
use crate::scene::Scene;
use crate::vk::Device;

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
