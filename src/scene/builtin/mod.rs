//! Scenes made by code, so that the first command needs no file.

mod cornell;
mod grid;
pub mod relief_maps;
mod statue;
mod surface_nets;

use super::{BuiltinOptions, Scene};
use crate::error::{Error, Result};

/// What [`super::load`] takes instead of a path.
pub const NAMES: [&str; 1] = ["cornell"];

/// Builds the scene of that name.
pub(super) fn build(name: &str, options: &BuiltinOptions) -> Result<Scene> {
    match name {
        "cornell" => cornell::build(options),
        _ => Err(Error::Usage(format!(
            "\"{name}\" is no built-in scene: there is {}",
            NAMES.join(", ")
        ))),
    }
}
