//! Pure mathematics in f64: directions, the hemicube, form factors.

pub mod directions;
pub mod form_factor;
pub mod groups;
pub mod hemicube;
pub mod kept;
pub mod random;
pub mod sampling;
