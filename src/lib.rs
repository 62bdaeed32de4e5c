//! Mesolux.
pub mod atomic_file;
pub mod charts;
pub mod constants;
pub mod contour;
pub mod elements;
pub mod error;
pub mod form_factor;
pub mod hemicube;
pub mod meshlets;
pub mod passes;
pub mod reference;
pub mod render;
pub mod scene;
pub mod solver;
pub mod sources;
pub mod vk;
