//! A lit scene as one eye sees it: what every part of a picture is made from.

use super::{Cuts, Lighting};
use crate::picture::Projection;
use crate::scene::Scene;

/// A lit scene as one eye sees it.
#[derive(Clone, Copy)]
pub struct SeenScene<'a> {
    pub scene: &'a Scene,
    pub lighting: &'a Lighting<'a>,
    pub projection: &'a Projection,
    /// Samples along a side of a pixel.
    pub samples: u32,
    pub cuts: Cuts,
}
