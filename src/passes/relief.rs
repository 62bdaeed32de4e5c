//! Draws triangles with relief by following each pixel's ray through the prism over the triangle.
//! Shaders: `relief.vert`, `relief.frag`, `shared/height_march.glsl`, whose twin is
//! [`crate::reference::relief_rays`]; what is shaded is compared with [`crate::path_tracer`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec3, Vec4};

use super::buffers::upload;
use super::shade::Shade;
use super::shaders::relief::{Bindings, SHADER};
use super::shadow_rays::LightBuffers;
use super::types::{HeightTile, ParallelLight, Prism, ReliefSurface};
use crate::error::Result;
use crate::vk::{
    Buffer, BufferUse, Commands, DescriptorSet, Device, Format, GraphicsPipeline, GraphicsState,
    Image, Sampled, Sampler, VertexAttribute,
};

/// One corner of a prism.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Vertex {
    /// From the eye, internal units, along the world's axes.
    pub position: Vec3,
    pub prism: u32,
}

/// Push constants of one draw: first those of [`super::shade::Parameters`]; `shading` and `view`
/// are SHADING_… and VIEW_… of [`crate::constants`], `pixel` is the angle of a sample in radians,
/// and `cells` are the columns and rows of the directions.
pub use super::shaders::relief::Parameters;

/// What a picture's relief is made of, `[prism]` and `[surface]`.
pub struct Parts<'a> {
    pub prisms: &'a [Prism],
    pub surfaces: &'a [ReliefSurface],
    pub tiles: &'a [HeightTile],
    pub pyramids: &'a [f32],
    /// `[surface][cell][corner][rank]`
    pub factors: &'a [Vec4],
    /// rgb of the β of the light that goes on inside the relief and of that which arrives by slots,
    /// `[light vertex][MOST_RANK]`.
    pub coefficients: &'a [[Vec4; 2]],
    /// rgb, `[light vertex][direction]`
    pub exits: &'a [Vec4],
    /// As the prisms count them.
    pub parallel_lights: &'a [ParallelLight],
}

/// [`Parts`] on the device.
pub struct Buffers {
    prisms: Buffer,
    surfaces: Buffer,
    tiles: Buffer,
    pyramids: Buffer,
    factors: Buffer,
    coefficients: Buffer,
    exits: Buffer,
    parallel_lights: Buffer,
    vertices: Buffer,
    indices: Buffer,
}

/// A run of prisms of one material.
pub struct Draw<'a> {
    pub first_prism: u32,
    pub prism_count: u32,
    pub set: &'a DescriptorSet,
    pub parameters: Parameters,
}

pub struct Relief {
    pipeline: GraphicsPipeline,
}

const CORNERS: u32 = 6;
/// Triangles of a prism's hull, outward where a, b, c turn to the left seen from above: 0 to 2 are
/// the low a, b, c and 3 to 5 the high ones. A side is cut from its lower corner's low to its
/// higher corner's high end.
const HULL: [u32; 24] = [
    0, 2, 1, 3, 4, 5, // caps
    0, 1, 4, 0, 4, 3, // a to b
    1, 2, 5, 1, 5, 4, // b to c
    0, 5, 2, 0, 3, 5, // a to c
];

impl Relief {
    /// Draws into the targets of `shade`; with `counts`, for VIEW_OVERDRAW alone, sums over all
    /// fragments, hidden or not.
    pub fn new(device: &Arc<Device>, shade: &Shade, counts: bool) -> Result<Self> {
        let attribute = |format, offset: usize| VertexAttribute {
            format,
            offset: offset as u32,
        };
        Ok(Self {
            pipeline: GraphicsPipeline::new(
                device,
                shade.pass(),
                &GraphicsState {
                    name: "relief",
                    shaders: &SHADER,
                    vertex_stride: size_of::<Vertex>() as u32,
                    attributes: &[
                        attribute(
                            Format::R32G32B32_SFLOAT,
                            std::mem::offset_of!(Vertex, position),
                        ),
                        attribute(Format::R32_UINT, std::mem::offset_of!(Vertex, prism)),
                    ],
                    sums: counts,
                },
            )?,
        })
    }

    pub fn bind(
        &self,
        albedo: &Image,
        sampler: &Sampler,
        buffers: &Buffers,
        lights: &LightBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "relief",
            &Bindings {
                albedo: Sampled {
                    image: albedo,
                    sampler,
                },
                prisms: &buffers.prisms,
                surfaces: &buffers.surfaces,
                tiles: &buffers.tiles,
                pyramid: &buffers.pyramids,
                factors: &buffers.factors,
                coefficients: &buffers.coefficients,
                exits: &buffers.exits,
                light_points: &lights.points,
                shadow_nodes: &lights.nodes,
                shadow_triangles: &lights.triangles,
                parallel_lights: &buffers.parallel_lights,
                webs: &lights.webs,
                light_polygons: &lights.polygons,
            },
        )
    }

    /// Draws within the render pass that is under way.
    pub fn record<'a>(
        &self,
        cmd: &Commands,
        buffers: &Buffers,
        draws: impl Iterator<Item = Draw<'a>>,
    ) {
        cmd.bind_indices(&buffers.indices);
        for draw in draws {
            cmd.bind_graphics(&self.pipeline, draw.set, &buffers.vertices);
            cmd.push_graphics(&self.pipeline, &draw.parameters);
            let indices = HULL.len() as u32;
            cmd.draw_indexed(draw.first_prism * indices, draw.prism_count * indices);
        }
    }
}

impl Buffers {
    /// `mirrored`: whether a, b, c of a prism turn to the right seen from above, `[prism]`.
    pub fn new(device: &Arc<Device>, parts: &Parts<'_>, mirrored: &[bool]) -> Result<Self> {
        let vertices: Vec<Vertex> = (0..)
            .zip(parts.prisms)
            .flat_map(|(prism, p)| {
                [p.low_a, p.low_b, p.low_c, p.high_a, p.high_b, p.high_c]
                    .map(|position| Vertex { position, prism })
            })
            .collect();
        let indices: Vec<u32> = (0..)
            .zip(mirrored)
            .flat_map(|(prism, &mirrored)| {
                let turn = move |i: usize| {
                    let swapped = if mirrored { [0, 2, 1][i % 3] } else { i % 3 };
                    CORNERS * prism + HULL[i - i % 3 + swapped]
                };
                (0..HULL.len()).map(turn)
            })
            .collect();
        let texels = BufferUse::Texels;
        Ok(Self {
            prisms: upload(device, "relief prisms", parts.prisms, texels)?,
            surfaces: upload(device, "relief surfaces", parts.surfaces, texels)?,
            tiles: upload(device, "relief tiles", parts.tiles, texels)?,
            pyramids: upload(device, "relief pyramids", parts.pyramids, texels)?,
            factors: upload(device, "relief factors", parts.factors, texels)?,
            coefficients: upload(device, "relief coefficients", parts.coefficients, texels)?,
            exits: upload(device, "relief exits", parts.exits, texels)?,
            parallel_lights: upload(device, "relief clusters", parts.parallel_lights, texels)?,
            vertices: upload(device, "relief vertices", &vertices, BufferUse::Geometry)?,
            indices: upload(device, "relief indices", &indices, BufferUse::Geometry)?,
        })
    }
}
