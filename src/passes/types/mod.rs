//! The structs that Rust and GLSL share, scalar layout. `shaders/shared/types.glsl` has the same
//! fields in the same order; `tests/shader_layout.rs` compares every offset.

mod relief;
mod rows;
mod scene;
mod shadow;

pub use relief::{
    HeightHit, HeightRay, HeightTile, MesoElement, ParallelLight, Prism, Reflected, ReliefSurface,
};
pub use rows::{CouplingTarget, Draw, KeptRow, KeptState, ReceiverList, Slot, View};
pub use scene::{Component, Meshlet, ReceiverBlock, Source, Triangle, contour_corners};
pub use shadow::{LightPoint, LitTriangle, ShadowNode, ShadowOccluder, ShadowRay, ShadowTriangle};

pub use crate::meso::{MesoTexel, TextureFacet};
