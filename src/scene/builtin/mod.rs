//! Scenes made by code, so that the first command needs no file.

mod bowl_and_bunny;
mod brick_court;
mod bunny;
mod cornell;
mod cornell_box;
mod cornell_relief;
mod fruit;
mod fruit_platter;
mod grid;
mod masonry_maps;
mod noise;
mod panels;
pub mod relief_maps;
mod round_cone;
mod slabs;
mod solid;
mod splitting;
mod stage;
mod statue;
mod surface_nets;

use super::{LoadOptions, Scene};
use crate::error::{Error, Result};

/// Names that [`super::load`] takes instead of a path. The second to the fourth stand in for the
/// scenes of the paper's Table 1.
pub const NAMES: [&str; 10] = [
    "cornell",
    "fruit-platter",
    "bowl-and-bunny",
    "cornell-relief",
    "brick-court",
    "cornell-box",
    "brick-corner",
    "brick-wall",
    "woven-cloth",
    "embossed-plate",
];

/// Those whose meshes are as coarse as people draw them, and are cut as those of files are.
pub const COARSE: [&str; 5] = [
    "cornell-box",
    "brick-corner",
    "brick-wall",
    "woven-cloth",
    "embossed-plate",
];

/// Builds the scene of that name.
pub(super) fn build(name: &str, options: &LoadOptions) -> Result<Scene> {
    match name {
        "cornell" => cornell::build(options),
        "fruit-platter" => fruit_platter::build(options),
        "bowl-and-bunny" => bowl_and_bunny::build(options),
        "cornell-relief" => cornell_relief::build(options),
        "brick-court" => brick_court::build(options),
        name if COARSE.contains(&name) => coarse(name, options),
        _ => Err(Error::Usage(format!(
            "\"{name}\" is no built-in scene: there is {}",
            NAMES.join(", ")
        ))),
    }
}

fn coarse(name: &str, options: &LoadOptions) -> Result<Scene> {
    if options.patches.is_some() || options.statue.is_some() {
        return Err(Error::Usage(format!(
            "{name}: it has no statue, and its number of elements follows from --element-size and \
             --fineness"
        )));
    }
    match name {
        "cornell-box" => cornell_box::build(options),
        "brick-corner" => panels::brick_corner(options),
        "brick-wall" => panels::brick_wall(options),
        "woven-cloth" => panels::woven_cloth(options),
        _ => panels::embossed_plate(options),
    }
}
