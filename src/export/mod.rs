//! Light at places in files that other programs read.
//!
//! ```text
//! scene ─► surface (charts) ─► texels ─► light_map ─► map_files
//!                                          borders, directional
//! places ─► sensors
//! ```

pub mod baked_colours;
mod borders;
pub mod directional;
pub mod glb;
mod ktx2;
mod lattice;
pub mod light_map;
pub mod map_files;
pub mod probes;
pub mod sensors;
pub mod surface;
pub mod texels;
pub mod web;
