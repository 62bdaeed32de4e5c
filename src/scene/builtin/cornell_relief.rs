//! The Cornell box with a horse of hammered metal.

use std::sync::Arc;

use super::cornell::{self, STATUE_MATERIAL};
use super::still_life::{even_share, sculpted};
use super::{placing, relief_maps, statue};
use crate::error::Result;
use crate::scene::{BuiltinOptions, Material, Scene};

const NAME: &str = "cornell-relief";
/// Elements in all and of the horse in the paper's scene.
const PATCHES: usize = 83_160;
const HORSE: usize = 25_780;
/// Metres: repeat of the dents.
const TILE: f64 = 0.45;
const RELIEF: f64 = 0.07 * TILE;

/// Builds the scene in exactly `options.patches` elements; room, light and camera are those of `cornell`.
///
/// # Errors
/// A statue that cannot be read; too few patches.
pub(super) fn build(options: &BuiltinOptions) -> Result<Scene> {
    let mut mesh = match &options.statue {
        Some(path) => placing::read_statue(path)?,
        None => {
            let patches = options.patches.unwrap_or(PATCHES);
            let count = even_share(patches, HORSE as f64 / PATCHES as f64);
            sculpted(
                NAME,
                "horse",
                statue::distance,
                [statue::LOW, statue::HIGH],
                count,
            )?
        }
    };
    cornell::stand_in_room(&mut mesh);
    placing::clothe(&mut mesh, STATUE_MATERIAL, 1.0 / TILE);
    let mut materials = cornell::materials();
    let metal = &mut materials[STATUE_MATERIAL as usize];
    *metal = Material {
        map_height: Some(Arc::new(relief_maps::hammered_metal(relief_maps::SIZE))),
        height_scale: RELIEF as f32,
        ..metal.clone()
    };
    cornell::assemble(NAME, mesh, materials, options.patches, PATCHES)
}
