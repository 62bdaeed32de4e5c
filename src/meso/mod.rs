//! Relief: height fields, their visibility, and their response to light.
//!
//! ```text
//! height map ─► height field ─► visibility (cached) ─► response ─► relief of the elements
//! light by direction ─► vertices ─► clusters
//! ```

mod basis;
mod coordinates;
mod exchange;
mod factors;
mod footprints;
mod height_field;
mod height_pyramid;
mod horizons;
mod known_factors;
mod relief;
mod response;
mod scattering;
mod shading;
mod transfer;
mod visibility;

pub use basis::{Basis, RANK};
pub use factors::{CORNERS, Factors, RANK_STEP};
pub use footprints::Footprints;
pub use height_field::{Facet, HeightField};
pub use height_pyramid::HeightPyramid;
pub use horizons::Horizons;
pub use known_factors::{FACTOR_ERROR, KnownFactors};
pub use relief::{
    Class, March, MesoTexel, Options, Relief, Texels, TextureFacet, Transport, visibility,
};
pub use response::{Response, slot_shares};
pub use scattering::Scattering;
pub use shading::Shading;
pub use visibility::Visibility;
