//! A scene as it was read: triangles, materials, point lights, cameras. All in scene units; nothing
//! is derived.
//!
//! Positions stay in f64: an offset of 10⁶ units must not cost the shape its precision. `elements`
//! converts them to f32 about the scene's own centre.
//!
//! ```text
//! .obj ─► obj_lint ─► obj + mtl ─┐
//! .gltf, .glb ─► gltf_file ──────┤
//! scene.toml ─► scene_file ──────┼─► assemble ─► masks ─► check ─► Scene ─► write
//! built-in name ─► builtin ──────┘
//! ```

mod assemble;
pub mod builtin;
mod camera;
pub mod camera_path;
mod check;
pub mod contents;
mod displace;
pub(crate) mod even_light;
pub(crate) mod geometry;
#[cfg(feature = "formats")]
mod gltf_file;
mod hash;
mod heights_from_normals;
pub mod ies;
#[cfg(feature = "formats")]
mod lamps;
#[cfg(feature = "formats")]
mod light_tables;
pub mod light_units;
mod lights;
mod load;
#[cfg(feature = "formats")]
mod map_files;
mod maps;
mod masks;
mod material;
mod mesh_file;
mod meshes;
mod mtl;
mod mtl_maps;
mod obj;
mod obj_lint;
#[cfg(feature = "formats")]
mod placement;
mod refine;
mod relief_notes;
mod said;
#[cfg(feature = "formats")]
mod scene_file;
pub mod shapes;
mod sides;
pub mod sky;
mod stem;
mod texture;
mod tile;
mod uv;
mod web;
#[cfg(feature = "formats")]
mod write;
#[cfg(feature = "formats")]
mod write_lights;

use std::path::PathBuf;
use std::sync::Arc;

use glam::DVec3;

pub use displace::{displace, relief_normals};
pub use lights::{Beam, Lights, PointLight, Sun};
pub use load::{ImportOptions, LoadOptions, load};
pub use maps::{HeightMap, NormalMap};
pub use masks::{AlphaMap, AlphaMask};
pub use material::Material;
pub use meshes::MeshRange;
pub use refine::{OnInput, RefinedFrom, Refinement};
pub use texture::Texture;
pub use web::Web;
#[cfg(feature = "formats")]
pub use write::write_scene;

/// A scene that can be baked: at least one triangle, all numbers finite, all reflectances in 0..=1.
#[derive(Debug, Clone, Default)]
pub struct Scene {
    pub name: String,
    /// The file it came from; none for a built-in scene.
    pub path: Option<PathBuf>,
    /// Positions in scene units. Corners that touch in the file share one index: equal positions
    /// are welded.
    pub vertices: Vec<DVec3>,
    /// In the order of the input.
    pub triangles: Vec<Triangle>,
    /// The meshes that the triangles of the input came from, in their order and without gaps.
    pub meshes: Vec<MeshRange>,
    pub materials: Vec<Material>,
    pub lights: Lights,
    pub cameras: Vec<Camera>,
    /// Triangles without area that were left out.
    pub dropped_degenerate: usize,
    /// Triangles left out because an earlier one has the same corners and the same front.
    pub dropped_duplicates: usize,
    /// None of a scene as it was read.
    pub refined_from: Option<RefinedFrom>,
    /// What was made up or ignored while reading, one sentence each, to show to the user.
    pub notes: Vec<String>,
    /// What was ignored and would change the light, one sentence each.
    pub warnings: Vec<String>,
}

impl Scene {
    /// The mesh that a triangle of the input belongs to.
    pub fn mesh_name(&self, triangle: u32) -> Option<&str> {
        meshes::name(&self.meshes, triangle)
    }

    /// The corners of a triangle, scene units.
    pub fn corners(&self, triangle: &Triangle) -> [DVec3; 3] {
        triangle.vertices.map(|v| self.vertices[v as usize])
    }

    /// The least and the greatest corner of the axis-parallel box around all vertices, scene units.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        self.vertices
            .iter()
            .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &p| {
                (low.min(p), high.max(p))
            })
    }

    /// The middle of the scene and the length of an *internal unit*, both in scene units. The unit
    /// is a power of two such that all coordinates about the middle lie in −1..1.
    pub(crate) fn local_frame(&self) -> (DVec3, f64) {
        let (low, high) = self.bounds();
        let half = (0.5 * (high - low)).max_element();
        let unit = if half > 0.0 {
            half.log2().ceil().exp2()
        } else {
            1.0
        };
        (0.5 * (low + high), unit)
    }
}

/// One triangle, counter-clockwise seen from its front, the side that sends and receives light.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Triangle {
    /// Indices into [`Scene::vertices`].
    pub vertices: [u32; 3],
    /// Texture coordinates per corner, v up; one repeat of a texture spans 0..1.
    pub uv: [[f32; 2]; 3],
    /// The same of the emission texture, where that lies elsewhere than the others.
    pub emission_uv: Option<[[f32; 2]; 3]>,
    /// Place in a light map per corner, v up, where the file gives one: `TEXCOORD_1` of glTF.
    pub light_uv: Option<[[f32; 2]; 3]>,
    /// Index into [`Scene::materials`].
    pub material: u32,
}

impl Triangle {
    /// Texture coordinates of the emission texture per corner.
    pub fn uv_of_emission(&self) -> [[f32; 2]; 3] {
        self.emission_uv.unwrap_or(self.uv)
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub name: String,
    /// Scene units.
    pub position: DVec3,
    /// The point shown in the middle of the picture.
    pub look_at: DVec3,
    pub up: DVec3,
    /// Vertical field of view, degrees.
    pub fov_y: f64,
}
