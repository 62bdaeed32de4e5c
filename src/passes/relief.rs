//! Shades the relief that [`super::relief_hits`] found, each sample once. Shaders: `relief.vert`,
//! `relief.frag`; what is shaded is compared with [`crate::path_tracer`].

use std::sync::Arc;

use glam::Vec4;

use super::buffers::upload;
use super::relief_hits::{Hits, ShapeBuffers};
use super::shade::Passes;
use super::shaders::relief::{Bindings, SHADER};
use super::shadow_rays::{LightBuffers, LightKinds};
use super::types::ParallelLight;
use crate::constants::HORIZON_SECTORS;
use crate::error::Result;
use crate::vk::{
    Blending, Buffer, BufferUse, Commands, DescriptorSet, Device, GraphicsPipeline, GraphicsState,
    Image, Sampled, Sampler, Sides,
};

/// Push constants of one draw, most as those of [`super::shade::Parameters`]; `pixel` is the angle
/// of a sample in radians, and `cells` are the columns and rows of the directions.
pub use super::shaders::relief::Parameters;

/// The light on a picture's relief.
pub struct Lights<'a> {
    /// `[surface][cell][corner][rank / 2]`, packed as `render/factor_texels.rs` says.
    pub factors: &'a [[u32; 4]],
    /// β of the light that goes on inside the relief and of that which arrives by slots,
    /// `[light vertex][MOST_RANK]`, packed too.
    pub coefficients: &'a [[u32; 4]],
    /// rgb, `[light vertex][direction]`
    pub exits: &'a [Vec4],
    /// As the prisms count them.
    pub parallel_lights: &'a [ParallelLight],
    /// [`Horizons::bounds`](crate::meso::Horizons::bounds), as the tiles count them.
    pub horizons: &'a [[u8; HORIZON_SECTORS as usize]],
    /// Of the relief, as the prisms count them: shares of the corners b and c at both ends.
    pub borders: &'a [Vec4],
}

/// [`Lights`] on the device.
pub struct Buffers {
    factors: Buffer,
    coefficients: Buffer,
    exits: Buffer,
    parallel_lights: Buffer,
    horizons: Buffer,
    borders: Buffer,
}

/// The prisms of one material.
pub struct Draw<'a> {
    pub set: &'a DescriptorSet,
    pub parameters: Parameters,
}

/// What the pipeline is made for, so that it does nothing else.
#[derive(Debug, Clone, Copy)]
pub struct Kind {
    /// One of SHADING_… of [`crate::constants`].
    pub shading: u32,
    /// One of VIEW_….
    pub view: u32,
    /// Whether there is light by factors, by light points and by parallel lights.
    pub factored: bool,
    pub sharp: bool,
    pub clustered: bool,
    pub lights: LightKinds,
    /// Whether the relief has borders.
    pub borders: bool,
    /// Whether marches use the levels of the pyramid.
    pub levels: bool,
}

pub struct Relief {
    pipeline: GraphicsPipeline,
    by_texel: Sampler,
    albedo: Sampler,
}

impl Relief {
    /// Draws into the targets of [`super::shade`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, passes: &Passes, kind: Kind) -> Result<Self> {
        let lit = [kind.factored, kind.sharp, kind.clustered, kind.lights.beams].map(u32::from);
        let last = [kind.lights.ways, kind.borders.into(), kind.levels.into()];
        let constants = [&[kind.shading, kind.view], &lit[..], &last].concat();
        Ok(Self {
            pipeline: GraphicsPipeline::new(
                device,
                &passes.first,
                &GraphicsState {
                    name: "relief",
                    shaders: &SHADER,
                    constants: &constants,
                    vertex_stride: 0,
                    attributes: &[],
                    // Where no relief was found, nothing is shaded.
                    blending: Blending::Under,
                    sides: Sides::Both,
                },
            )?,
            by_texel: Sampler::new(device, "relief hits", false)?,
            albedo: Sampler::new(device, "relief albedo", true)?,
        })
    }

    /// # Errors
    /// A device that fails.
    pub fn bind(
        &self,
        hits: &Hits,
        albedo: &Image,
        shape: &ShapeBuffers,
        buffers: &Buffers,
        lights: &LightBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "relief",
            &Bindings {
                albedo: Sampled {
                    image: albedo,
                    sampler: &self.albedo,
                },
                hits: Sampled {
                    image: &hits.image,
                    sampler: &self.by_texel,
                },
                prisms: &shape.prisms,
                surfaces: &shape.surfaces,
                tiles: &shape.tiles,
                pyramid: &shape.pyramids,
                factors: &buffers.factors,
                coefficients: &buffers.coefficients,
                exits: &buffers.exits,
                light_points: &lights.points,
                shadow_nodes: &lights.nodes,
                shadow_triangles: &lights.triangles,
                parallel_lights: &buffers.parallel_lights,
                webs: &lights.webs,
                light_polygons: &lights.polygons,
                horizons: &buffers.horizons,
                borders: &buffers.borders,
            },
        )
    }

    /// Draws within a render pass that has begun over the depths of the hits, before all else.
    pub fn record<'a>(&self, cmd: &Commands, draws: impl Iterator<Item = Draw<'a>>) {
        for draw in draws {
            cmd.bind_graphics(&self.pipeline, draw.set, None);
            cmd.push_graphics(&self.pipeline, &draw.parameters);
            cmd.draw(3);
        }
    }
}

impl Buffers {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, lights: &Lights<'_>) -> Result<Self> {
        let texels = BufferUse::Texels;
        Ok(Self {
            factors: upload(device, "relief factors", lights.factors, texels)?,
            coefficients: upload(device, "relief coefficients", lights.coefficients, texels)?,
            exits: upload(device, "relief exits", lights.exits, texels)?,
            parallel_lights: upload(device, "relief clusters", lights.parallel_lights, texels)?,
            horizons: upload(device, "relief horizons", lights.horizons, texels)?,
            borders: upload(device, "relief borders", lights.borders, texels)?,
        })
    }
}
