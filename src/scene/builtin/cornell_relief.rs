//! The Cornell box of the paper's Table 1: an area light and a yellow horse of hammered metal.

use std::sync::Arc;

use super::stage::{self, Stage, even_share};
use super::{cornell, relief_maps, solid, statue};
use crate::error::Result;
use crate::scene::{Lights, LoadOptions, Material, Scene};

const NAME: &str = "cornell-relief";
const PATCHES: usize = 83_160;
const SHARE: f64 = 0.31;
/// With fewer the horse loses its ears.
const LEAST_PATCHES: usize = 8_000;
/// Tiles of hammered metal a metre: a texel is about a third of an element's edge in the default
/// number.
const REPEATS: f64 = 1.35;
/// Metres. The rms slope of the relief is 0.27.
const HEIGHT: f32 = 0.03;

/// Builds the room of `cornell` with a horse that has relief.
///
/// # Errors
/// Too few patches; a statue that cannot be read.
pub(super) fn build(options: &LoadOptions) -> Result<Scene> {
    let mut horse = match &options.statue {
        Some(path) => stage::read_statue(path)?,
        None => {
            let patches = stage::planned(NAME, options, PATCHES, LEAST_PATCHES)?;
            let count = even_share(patches, SHARE);
            solid::sculpt(&statue::HORSE, count)
        }
    };
    let room = cornell::ROOM;
    let extent = cornell::STATUE_SIZE * room.size.y;
    stage::place(&mut horse, extent, cornell::STATUE_TURN, cornell::FOOT);
    stage::cover(&mut horse, cornell::STATUE_MATERIAL, REPEATS);
    let mut materials = cornell::materials().to_vec();
    let metal = &mut materials[cornell::STATUE_MATERIAL as usize];
    *metal = Material {
        map_height: Some(Arc::new(relief_maps::hammered_metal(relief_maps::SIZE))),
        height_scale: HEIGHT,
        ..metal.clone()
    };
    let stage = Stage {
        name: NAME,
        patches: PATCHES,
        room,
        material_of: cornell::material_of,
        materials,
        solids: vec![horse.named("horse")],
        lights: Lights::default(),
        camera: cornell::camera(),
    };
    stage.build(options)
}
