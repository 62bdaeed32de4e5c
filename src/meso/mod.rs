//! Relief: height fields, what they see of themselves, and what they do to light.
//!
//! ```text
//! height map ─► height field ─► visibility (GPU, cached) ─► response ─► relief of the elements
//! solution ─► vertices
//! ```

mod exchange;
mod height_field;
mod relief;
mod response;
mod transfer;
mod vertices;
mod visibility;

pub use height_field::{Facet, HeightField};
pub use relief::{Class, Options, Relief, Transport};
pub use response::{Block, Response, slot_shares};
pub use vertices::MesoVertices;
pub use visibility::Visibility;
