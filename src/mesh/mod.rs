//! A scene as the solver sees it: elements, groups of them that send light, and triangles that hide
//! it.

pub mod charts;
pub mod clusters;
pub mod contour;
pub mod corners;
pub mod elements;
pub mod merged;
pub mod meshlets;
pub mod meso_vertices;
pub mod near;
pub mod occluders;
pub mod open_eyes;
pub mod relief;
pub mod shadow_tree;
pub mod sources;
pub mod tiles;
