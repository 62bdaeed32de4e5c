//! A slow, simple twin of each GPU pass, in f64 on the CPU.

pub mod bin_pixels;
pub mod couple;
pub mod cull;
pub mod disc;
pub mod form_factors;
pub mod item_buffer;
pub mod light_rows;
pub mod measure;
pub mod near_to_relief;
pub mod normalise;
pub mod occluder_rays;
pub mod paper;
pub mod relief_rays;
pub mod relief_visibility;
pub mod send_relief;
pub mod shade;
pub mod shadow_rays;
