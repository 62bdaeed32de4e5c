//! Light at places in files that other programs read.
//!
//! ```text
//! scene ─► surface (charts) ─► texels ─► light_map ─► map_files, glb, web
//!                                          borders, directional
//!       ─► vertex_light ─► glb
//! places ─► sensors, probes
//! ```

pub mod baked_colours;
mod borders;
mod charts;
pub mod directional;
pub mod glb;
mod ktx2;
mod lattice;
pub mod light_map;
pub mod map_files;
mod own_charts;
pub mod probes;
pub mod sensors;
pub mod surface;
pub mod texels;
mod text_points;
pub mod vertex_light;
pub mod web;
