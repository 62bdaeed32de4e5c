//! The triangles that the surface pass draws, in order of their materials.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec2, Vec3};

use crate::error::Result;
use crate::passes::buffers::upload;
use crate::scene::{Material, Scene};
use crate::vk::{Buffer, BufferUse, Device};

/// One corner of a triangle.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Vertex {
    /// From the scene's middle, internal units.
    pub position: Vec3,
    pub normal: Vec3,
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
    /// How far its relief reaches above or below it, internal units.
    pub rise: f32,
}

/// No element is marked, or an element belongs to no source.
pub const NOTHING: u32 = u32::MAX;

/// Drawn triangles of one material.
pub struct MeshRange {
    pub material: u32,
    /// First vertex.
    pub first: u32,
    /// Number of vertices.
    pub count: u32,
}

/// A scene's triangles on the device.
pub struct SurfaceMesh {
    pub vertices: Buffer,
    pub indices: Buffer,
    /// Index in the scene, `[drawn triangle]`.
    pub order: Vec<u32>,
    pub ranges: Vec<MeshRange>,
}

impl SurfaceMesh {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, scene: &Scene) -> Result<Self> {
        let mut order: Vec<u32> = (0..scene.triangles.len() as u32).collect();
        let material = |e: u32| scene.triangles[e as usize].material;
        order.sort_by_key(|&e| material(e));
        let mut ranges = Vec::new();
        let mut first = 0;
        for same in order.chunk_by(|&a, &b| material(a) == material(b)) {
            let count = 3 * same.len() as u32;
            ranges.push(MeshRange {
                material: material(same[0]),
                first,
                count,
            });
            first += count;
        }
        let vertices = vertices(scene, &order);
        let indices: Vec<u32> = (0..vertices.len() as u32).collect();
        Ok(Self {
            vertices: upload(device, "surface vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "surface indices", &indices, BufferUse::Geometry)?,
            order,
            ranges,
        })
    }

    /// `[drawn triangle]`; `sources` are `[triangle]` of the input, or empty.
    pub fn about(&self, scene: &Scene, sources: &[u32]) -> Vec<About> {
        let unit = scene.local_frame().1;
        let rises: Vec<f32> = scene.materials.iter().map(|m| rise(m, unit)).collect();
        let about = self.order.iter().map(|&e| About {
            triangle: e,
            source: sources.get(e as usize).copied().unwrap_or(NOTHING),
            rise: rises[scene.triangles[e as usize].material as usize],
        });
        about.collect()
    }
}

/// Greatest height of a material's relief above or below its mean, internal units.
fn rise(material: &Material, unit: f64) -> f32 {
    let Some(map) = &material.map_height else {
        return 0.0;
    };
    let mean = map.mean();
    let most = map.values.iter().map(|&v| (f64::from(v) - mean).abs());
    let scale = f64::from(material.height_scale.abs());
    (most.fold(0.0, f64::max) * scale / unit) as f32
}

/// `[drawn triangle][corner]`.
fn vertices(scene: &Scene, order: &[u32]) -> Vec<Vertex> {
    let (origin, unit) = scene.local_frame();
    order
        .iter()
        .flat_map(|&e| {
            let triangle = &scene.triangles[e as usize];
            let corners = scene.corners(triangle).map(|p: DVec3| (p - origin) / unit);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
            let images = triangle.uv.map(|[u, v]| Vec2::new(u, 1.0 - v));
            // The texture repeats: coordinates shifted to near 0 are more precise.
            let whole = images[0].floor();
            [0, 1, 2].map(|k| Vertex {
                position: corners[k].as_vec3(),
                normal,
                uv: images[k] - whole,
            })
        })
        .collect()
}
