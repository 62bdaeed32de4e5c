//! Radiosity by hemicube item buffers on Vulkan.
//!
//! ```text
//! scene ─► mesh (elements, sources, occluders) ─┐
//!                                               ▼
//!              ┌──────────────── solver ─────────────────┐
//!              │ rows ─► coupling ─► solve ─► gather     │
//!              └─────────────────────────────────────────┘
//!                                               ▼
//!                        light ─► bake (file) ─► render (picture)
//!
//! scene ─► displaced ─► path_tracer (the truth, to compare with)
//! ```
//!
//! | of the paper | where |
//! | --- | --- |
//! | equation (1), F_ij = Σ ΔF_q | `shaders/bin_pixels.comp`, [`math::hemicube`] |
//! | equation (2), ΔE = ΔB F A_i / A_j | `shaders/pixel_rows.comp`, [`reference::bin_pixels`] |
//! | the same by Lambert's formula | `shaders/form_factors.comp`, [`math::form_factor`] |
//! | equation (3), light sent by direction | [`meso`], `shaders/send_relief.comp` |
//! | equation (4), light received by direction | `shaders/gather_to_relief.comp` |
//! | Figure 1, from elements to vertices | [`mesh::meso_vertices`] |
//! | drawing by relief mapping | [`render`], `shaders/relief.frag` |
//! | hemicubes | [`math::hemicube`], [`passes::item_buffer`] |
//!
//! Cargo features: `cli` (the program and its benchmarks) and `window` (`view`) are on by default,
//! and nothing else needs them; `formats`, part of `cli`, brings scene.toml, JPEG and OpenEXR.
//!
//! [`bake::bake`] is the main road; [`solver::Solver`] gives each step.
#![deny(unsafe_code)]

pub mod atomic_file;
pub mod bake;
#[cfg(feature = "cli")]
pub mod bench;
pub mod beside;
mod cache_folder;
#[cfg(feature = "cli")]
pub mod console;
pub mod constants;
pub mod error;
#[cfg(feature = "export")]
pub mod export;
pub mod input_file;
pub mod math;
pub mod mesh;
pub mod meso;
pub mod passes;
pub mod path_tracer;
pub mod picture;
pub mod reference;
pub mod render;
pub mod scene;
pub mod solver;
pub mod structs;
#[cfg(feature = "window")]
pub mod view;
pub mod vk;
