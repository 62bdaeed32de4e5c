//! Scenes made by code, so that the first command needs no file.

mod bowl_and_bunny;
mod bunny;
mod cornell;
mod cornell_relief;
mod exact;
mod fruit;
mod fruit_platter;
mod grid;
mod lathe;
mod panels;
mod placing;
pub mod relief_maps;
mod shapes;
mod statue;
mod still_life;
mod surface_nets;

use super::{BuiltinOptions, Scene};
use crate::error::{Error, Result};

/// What [`super::load`] takes instead of a path.
pub const NAMES: [&str; 4] = [
    "cornell",
    "cornell-relief",
    "bowl-and-bunny",
    "fruit-platter",
];

/// Builds the scene of that name.
pub(super) fn build(name: &str, options: &BuiltinOptions) -> Result<Scene> {
    match name {
        "cornell" => cornell::build(options),
        "cornell-relief" => cornell_relief::build(options),
        "bowl-and-bunny" => bowl_and_bunny::build(options),
        "fruit-platter" => fruit_platter::build(options),
        _ => Err(Error::Usage(format!(
            "\"{name}\" is no built-in scene: there is {}",
            NAMES.join(", ")
        ))),
    }
}
