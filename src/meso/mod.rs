//! Relief: height fields, what they see of themselves, and what they do to light.
//!
//! ```text
//! height map ─► height field ─► visibility (GPU, cached) ─► response ─► relief of the elements
//! ```

mod exchange;
mod height_field;
mod height_pyramid;
mod relief;
mod response;
mod transfer;
mod visibility;

pub use height_field::{Facet, HeightField};
pub use height_pyramid::HeightPyramid;
pub use relief::{Class, Options, Relief, Transport};
pub use response::{Block, Response, slot_shares};
pub use visibility::Visibility;
