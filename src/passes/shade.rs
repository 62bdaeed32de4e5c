//! Draws elements as radiance, L = ρ(u, v) · E / π + Le. Shaders: `shade.vert`, `shade.frag`; twin:
//! [`crate::reference::shade`]. What comes straight from light points is compared with
//! [`crate::path_tracer`].

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

use super::buffers::upload;
use super::pass_parts::{PartedPass, PassParts};
use super::shaders::shade::{Bindings, SHADER};
use super::shadow_rays::{LightBuffers, LightCounts, LightKinds};
use super::types::LitTriangle;
use crate::constants::{LIT_IN_PARTS, LIT_NOT, LIT_OPEN};
use crate::error::Result;
use crate::vk::{
    Attachment, Blending, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, Framebuffer,
    GraphicsPipeline, GraphicsState, Image, ImageUse, RenderPass, Sampled, Sampler, Sides, Stage,
    VertexAttribute,
};

/// One corner of an element.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Vertex {
    /// From the eye, internal units, along the world's axes.
    pub position: Vec3,
    /// Incident power per area E, W·m⁻², RGB.
    pub irradiance: Vec3,
    /// Texture coordinates, v down, as images are stored.
    pub uv: Vec2,
}

/// Push constants of one draw: `x`, `y` and `w` are rows of the projection, `near` is the distance
/// of the near plane in internal units, `reflectance` is ρ or the factor of the texture, `emitted`
/// is Le in W·m⁻²·sr⁻¹, and `metered` is 1 where an exposure meter looks and 0 elsewhere; it goes
/// to alpha. Of the `light_count` points that light the draw straight, those of emitters come
/// first.
pub use super::shaders::shade::Parameters;

/// What is lit straight, on the device.
pub struct LitBuffers {
    triangles: Buffer,
    part_states: Buffer,
}

impl LitBuffers {
    /// `[drawn triangle]`, or none where nothing is lit straight; and PART_… of their parts, two
    /// bits each.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, triangles: &[LitTriangle], states: &[u32]) -> Result<Self> {
        let texels = BufferUse::Texels;
        Ok(Self {
            triangles: upload(device, "lit triangles", triangles, texels)?,
            part_states: upload(device, "parts of lit triangles", states, texels)?,
        })
    }
}

impl Parameters {
    /// The same, lit straight by so many lights, in a tile with that sample in its top left corner.
    pub fn lit_by(self, counts: LightCounts, corner: [u32; 2]) -> Self {
        Self {
            light_count: counts.points,
            emitter_points: counts.of_emitters,
            polygon_count: counts.polygons,
            corner,
            ..self
        }
    }
}

/// Runs of triangles of one material.
#[derive(Clone)]
pub struct Draw<'a> {
    pub triangles: Vec<Range<u32>>,
    pub texture: &'a DescriptorSet,
    /// LIT_… of [`crate::constants`].
    pub lit: u32,
    /// Whether its colours are added to what is there in the same place.
    pub adds: bool,
    pub parameters: Parameters,
}

/// Render passes into a [`Target`].
#[derive(Clone)]
pub struct Passes {
    pub(super) first: RenderPass,
    /// The same over depths that another pass has drawn.
    over_depths: RenderPass,
    /// For the parts after the first.
    further: RenderPass,
}

impl Passes {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let colour = Attachment::copied(FORMAT);
        let [first, further] = RenderPass::in_parts(device, "shade", colour)?;
        Ok(Self {
            over_depths: RenderPass::over_depths(device, "shade", colour)?,
            first,
            further,
        })
    }
}

pub struct Shade {
    passes: Passes,
    /// `[LIT_…]`
    lit: [GraphicsPipeline; 3],
    /// For draws that add; None unless asked for.
    adding: Option<GraphicsPipeline>,
}

/// Colour, depth and readback for one size of tile.
pub struct Target {
    pub width: u32,
    pub height: u32,
    framebuffer: Framebuffer,
    colour: Image,
    depth: Image,
    readback: Buffer,
}

/// Radiance and the meter's flag.
const FORMAT: Format = Format::R32G32B32A32_SFLOAT;
const TEXEL_BYTES: u64 = 16;

impl Shade {
    /// Only with `adds` draws can add.
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(
        device: &Arc<Device>,
        passes: &Passes,
        adds: bool,
        lights: LightKinds,
    ) -> Result<Self> {
        let attribute = |format, offset: usize| VertexAttribute {
            format,
            offset: offset as u32,
        };
        let state = GraphicsState {
            name: "shade",
            shaders: &SHADER,
            constants: &[LIT_NOT, 0, 1, 1],
            vertex_stride: size_of::<Vertex>() as u32,
            attributes: &[
                attribute(
                    Format::R32G32B32_SFLOAT,
                    std::mem::offset_of!(Vertex, position),
                ),
                attribute(
                    Format::R32G32B32_SFLOAT,
                    std::mem::offset_of!(Vertex, irradiance),
                ),
                attribute(Format::R32G32_SFLOAT, std::mem::offset_of!(Vertex, uv)),
            ],
            blending: Blending::Nearest,
            sides: Sides::Both,
        };
        let added = GraphicsState {
            blending: Blending::Add,
            ..state
        };
        let lit = |how| {
            let constants = [how, lights.beams.into(), lights.ways, lights.points.into()];
            let state = GraphicsState {
                constants: &constants,
                ..state
            };
            GraphicsPipeline::new(device, &passes.first, &state)
        };
        let adding = adds.then(|| GraphicsPipeline::new(device, &passes.first, &added));
        Ok(Self {
            lit: [lit(LIT_NOT)?, lit(LIT_OPEN)?, lit(LIT_IN_PARTS)?],
            adding: adding.transpose()?,
            passes: passes.clone(),
        })
    }

    /// Binds the texture of a material, the light points with what casts shadows, and what they
    /// light.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn bind(
        &self,
        albedo: &Image,
        sampler: &Sampler,
        lights: &LightBuffers,
        lit: &LitBuffers,
    ) -> Result<DescriptorSet> {
        self.lit[0].bind(
            "shade",
            &Bindings {
                albedo: Sampled {
                    image: albedo,
                    sampler,
                },
                light_points: &lights.points,
                shadow_nodes: &lights.nodes,
                shadow_triangles: &lights.triangles,
                lit_triangles: &lit.triangles,
                part_states: &lit.part_states,
                webs: &lights.webs,
                light_polygons: &lights.polygons,
            },
        )
    }

    /// Lets `first` draw into the left top of the target, draws there too, and copies all of
    /// it to where the CPU reads it; `drawn` is recorded before the copies.
    pub fn record<'a>(
        &self,
        cmd: &Commands,
        target: &Target,
        mesh: &Mesh<'_>,
        first: impl FnOnce(&mut PartedPass<'_>),
        draws: impl Iterator<Item = Draw<'a>>,
        drawn: impl FnOnce(),
    ) {
        let clear = [0, 0, 0, mesh.background.to_bits()];
        let pass = match mesh.over_depths {
            true => &self.passes.over_depths,
            false => &self.passes.first,
        };
        let parts = PassParts {
            passes: [pass, &self.passes.further],
            framebuffer: &target.framebuffer,
            size: mesh.size,
            clear,
            triangles: mesh.part_triangles,
        };
        let mut pass = PartedPass::begin(cmd, parts);
        first(&mut pass);
        for draw in draws {
            let pipeline = match (draw.adds, &self.adding) {
                (true, Some(adding)) => adding,
                _ => &self.lit[draw.lit as usize],
            };
            pass.draw(draw.triangles, |cmd| {
                cmd.bind_indices(mesh.indices);
                cmd.bind_graphics(pipeline, draw.texture, Some(mesh.vertices));
                cmd.push_graphics(pipeline, &draw.parameters);
            });
        }
        pass.end();
        drawn();
        cmd.copy_image_to_buffer(&target.colour, &target.readback);
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
    }
}

/// What is drawn, and where.
pub struct Mesh<'a> {
    /// Samples across and down, in the left top of the target.
    pub size: (u32, u32),
    pub vertices: &'a Buffer,
    pub indices: &'a Buffer,
    /// Alpha of samples that show nothing.
    pub background: f32,
    /// Whether the target's depths are those of another pass.
    pub over_depths: bool,
    /// Triangles of a part of the submission, at most.
    pub part_triangles: u32,
}

impl Target {
    pub fn new(device: &Arc<Device>, shade: &Shade, (width, height): (u32, u32)) -> Result<Self> {
        let size = (width, height);
        let colour = Image::new(device, "shade", size, FORMAT, ImageUse::ColourTarget)?;
        let depth = Image::new(
            device,
            "shade depth",
            size,
            Format::D32_SFLOAT,
            ImageUse::DepthTarget,
        )?;
        let samples = u64::from(width) * u64::from(height);
        let readback = |name, bytes| Buffer::new(device, name, bytes, BufferUse::Readback);
        Ok(Self {
            width,
            height,
            framebuffer: Framebuffer::new(device, "shade", &shade.passes.first, &colour, &depth)?,
            colour,
            depth,
            readback: readback("shade readback", samples * TEXEL_BYTES)?,
        })
    }

    pub(super) fn depth(&self) -> &Image {
        &self.depth
    }

    /// The first `rows` rows of the whole target's width, `[row][column]`: RGB radiance,
    /// W·m⁻²·sr⁻¹, and the meter's flag. The submission must be done.
    pub fn rows(&self, rows: u32) -> Vec<[f32; 4]> {
        self.readback.read(0, self.width as usize * rows as usize)
    }

    /// Shows those rows to `look`.
    pub fn look_at_rows<R>(&self, rows: u32, look: impl FnOnce(&[[f32; 4]]) -> R) -> R {
        let count = self.width as usize * rows as usize;
        self.readback
            .look_at(|samples: &[[f32; 4]]| look(&samples[..count]))
    }
}
