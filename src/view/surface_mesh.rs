//! The triangles that the surface pass draws, in order of their materials, those with relief last.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};

use super::slopes::slope_axes;
use crate::error::Result;
use crate::passes::buffers::upload;
use crate::scene::Scene;
use crate::vk::{Buffer, BufferUse, Device};

/// One corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Vertex {
    /// In [`SurfaceMesh::frame`].
    pub position: Vec3,
    /// v down, as images are stored.
    pub uv: Vec2,
}

/// What the shader reads of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct About {
    /// Index in the input.
    pub triangle: u32,
    pub source: u32,
    /// Squares and product of the axes of its slopes, see [`slope_axes`]: uu, 2uv, vv; and the
    /// square of how high its relief is over what it was when the mesh was made.
    pub stretch: [f32; 4],
}

/// No element is marked, or an element belongs to no source.
pub const NOTHING: u32 = u32::MAX;

/// Drawn triangles of one material.
pub struct MeshRange {
    pub material: u32,
    pub triangles: Range<u32>,
    pub relief: bool,
}

/// A scene's triangles on the device.
pub struct SurfaceMesh {
    pub vertices: Buffer,
    pub indices: Buffer,
    /// Origin and unit of its corners, scene units: the middle and the internal unit of the scene
    /// that it was made of.
    pub frame: (DVec3, f64),
    /// Index in the scene, `[drawn triangle]`.
    pub order: Vec<u32>,
    pub ranges: Vec<MeshRange>,
    /// The first drawn triangle with relief.
    pub first_relief: usize,
    /// Scales of the heights when it was made, `[material]`.
    heights: Vec<f32>,
}

impl SurfaceMesh {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, scene: &Scene) -> Result<Self> {
        let material = |e: u32| scene.triangles[e as usize].material;
        let has_relief = |e: u32| scene.materials[material(e) as usize].has_relief();
        let mut order: Vec<u32> = (0..scene.triangles.len() as u32).collect();
        order.sort_by_key(|&e| (has_relief(e), material(e)));
        let mut ranges = Vec::new();
        let mut first = 0;
        for same in order.chunk_by(|&a, &b| material(a) == material(b)) {
            let end = first + same.len() as u32;
            ranges.push(MeshRange {
                material: material(same[0]),
                triangles: first..end,
                relief: has_relief(same[0]),
            });
            first = end;
        }
        let frame = scene.local_frame();
        let vertices = vertices(scene, &order, frame);
        let indices: Vec<u32> = (0..vertices.len() as u32).collect();
        Ok(Self {
            vertices: upload(device, "surface vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "surface indices", &indices, BufferUse::Geometry)?,
            first_relief: order.partition_point(|&e| !has_relief(e)),
            heights: scene.materials.iter().map(|m| m.height_scale).collect(),
            frame,
            order,
            ranges,
        })
    }

    /// Takes the places of the corners from `scene`, which is otherwise the same scene.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn move_to(&mut self, device: &Arc<Device>, scene: &Scene) -> Result<()> {
        let vertices = vertices(scene, &self.order, self.frame);
        self.vertices = upload(device, "surface vertices", &vertices, BufferUse::Geometry)?;
        Ok(())
    }

    /// `[drawn triangle]`; `sources` are `[triangle]` of the input, or empty.
    pub fn about(&self, scene: &Scene, sources: &[u32]) -> Vec<About> {
        let about = self.order.iter().map(|&e| {
            let triangle = &scene.triangles[e as usize];
            let [u, v] = slope_axes(scene, triangle);
            let stretch = DVec3::new(u.length_squared(), 2.0 * u.dot(v), v.length_squared());
            let material = triangle.material as usize;
            let before = self.heights[material];
            let rise = match before == 0.0 {
                true => 0.0,
                false => scene.materials[material].height_scale / before,
            };
            About {
                triangle: e,
                source: sources.get(e as usize).copied().unwrap_or(NOTHING),
                stretch: stretch.as_vec3().extend(rise * rise).to_array(),
            }
        });
        about.collect()
    }
}

/// `[drawn triangle][corner]`.
fn vertices(scene: &Scene, order: &[u32], (origin, unit): (DVec3, f64)) -> Vec<Vertex> {
    order
        .iter()
        .flat_map(|&e| {
            let triangle = &scene.triangles[e as usize];
            let corners = scene.corners(triangle).map(|p: DVec3| (p - origin) / unit);
            let images = triangle.uv.map(|[u, v]| Vec2::new(u, 1.0 - v));
            // The texture repeats: coordinates shifted to near 0 are more precise.
            let whole = images[0].floor();
            [0, 1, 2].map(|k| Vertex {
                position: corners[k].as_vec3(),
                uv: images[k] - whole,
            })
        })
        .collect()
}
