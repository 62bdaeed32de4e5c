//! Scenes made by code, so that the first command needs no file.

mod bowl_and_bunny;
mod brick_court;
mod bunny;
mod cornell;
mod cornell_relief;
mod fruit;
mod fruit_platter;
mod grid;
mod masonry_maps;
mod noise;
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

/// Names that [`super::load`] takes instead of a path. The second to the fourth are scenes of
/// the paper's Table 1.
pub const NAMES: [&str; 5] = [
    "cornell",
    "fruit-platter",
    "bowl-and-bunny",
    "cornell-relief",
    "brick-court",
];

/// Builds the scene of that name.
pub(super) fn build(name: &str, options: &LoadOptions) -> Result<Scene> {
    match name {
        "cornell" => cornell::build(options),
        "fruit-platter" => fruit_platter::build(options),
        "bowl-and-bunny" => bowl_and_bunny::build(options),
        "cornell-relief" => cornell_relief::build(options),
        "brick-court" => brick_court::build(options),
        _ => Err(Error::Usage(format!(
            "\"{name}\" is no built-in scene: there is {}",
            NAMES.join(", ")
        ))),
    }
}
