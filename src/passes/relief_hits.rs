//! Finds what relief each sample shows: its ray is followed through the prisms over triangles, and
//! the nearest hit stays, to be shaded by [`super::relief`]. Shaders: `relief_hits.vert`,
//! `relief_hits.frag`, `shared/relief_hit.glsl`, `shared/height_march.glsl`, whose twin is
//! [`crate::reference::relief_rays`].

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

use super::buffers::upload;
use super::pass_parts::{PartedPass, PassParts};
use super::shade::Target;
use super::shaders::relief_hits::{Bindings, SHADER};
use super::types::{HeightTile, Prism, ReliefSurface};
use crate::error::Result;
use crate::vk::{
    Attachment, Blending, Buffer, BufferUse, Commands, DescriptorSet, Device, Format, Framebuffer,
    GraphicsPipeline, GraphicsShaders, GraphicsState, Image, ImageUse, RenderPass, Sides,
    VertexAttribute,
};

/// Push constants: rows of the projection as those of [`super::shade::Parameters`], and the angle
/// of a sample in radians.
pub use super::shaders::relief_hits::Parameters;

/// One corner of a prism.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Vertex {
    /// From the eye, internal units, along the world's axes.
    position: Vec3,
    prism: u32,
}

/// The shape of a picture's relief, `[prism]` and `[surface]`.
pub struct Shape<'a> {
    pub prisms: &'a [Prism],
    /// Whether a, b, c of a prism turn to the right seen from above.
    pub mirrored: &'a [bool],
    pub surfaces: &'a [ReliefSurface],
    pub tiles: &'a [HeightTile],
    pub pyramids: &'a [f32],
}

/// [`Shape`] on the device.
pub struct ShapeBuffers {
    pub(super) prisms: Buffer,
    pub(super) surfaces: Buffer,
    pub(super) tiles: Buffer,
    pub(super) pyramids: Buffer,
    vertices: Buffer,
    indices: Buffer,
}

/// The prisms that a tile may show, and in which parts they are drawn.
pub struct Drawn {
    pub prisms: Vec<Range<u32>>,
    pub parameters: Parameters,
    /// Triangles of a part of the submission, at most.
    pub part_triangles: u32,
}

pub struct ReliefHits {
    pass: RenderPass,
    /// For the parts after the first.
    further: RenderPass,
    pipeline: GraphicsPipeline,
}

/// Hits of one size of tile, over the depths of another target.
pub struct Hits {
    framebuffer: Framebuffer,
    pub(super) image: Image,
}

/// See `shared/prisms.glsl`.
const FORMAT: Format = Format::R32G32B32A32_UINT;
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

impl ReliefHits {
    /// `shading` is one of SHADING_… of [`crate::constants`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, shading: u32) -> Result<Self> {
        let hits = Attachment::read_by_shaders(FORMAT);
        let [pass, further] = RenderPass::in_parts(device, "relief hits", hits)?;
        let constants = [shading];
        let state = prisms("relief hits", &SHADER, &constants);
        let pipeline = GraphicsPipeline::new(device, &pass, &state)?;
        Ok(Self {
            pass,
            further,
            pipeline,
        })
    }

    /// Where hits over the depths of a target are found.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn target(&self, device: &Arc<Device>, target: &Target) -> Result<Hits> {
        let (size, used) = ((target.width, target.height), ImageUse::ColourTarget);
        let image = Image::new(device, "relief hits", size, FORMAT, used)?;
        let depth = target.depth();
        Ok(Hits {
            framebuffer: Framebuffer::new(device, "relief hits", &self.pass, &image, depth)?,
            image,
        })
    }

    /// # Errors
    /// A device that fails.
    pub fn bind(&self, shape: &ShapeBuffers) -> Result<DescriptorSet> {
        self.pipeline.bind("relief hits", &shape.bindings())
    }

    /// Finds hits in the left top `size` of the target, in a render pass of its own, which clears
    /// its depths and keeps them for the next.
    pub fn record(
        &self,
        cmd: &Commands,
        hits: &Hits,
        size: (u32, u32),
        set: &DescriptorSet,
        shape: &ShapeBuffers,
        drawn: &Drawn,
    ) {
        let parts = PassParts {
            passes: [&self.pass, &self.further],
            framebuffer: &hits.framebuffer,
            size,
            clear: [0; 4],
            triangles: drawn.part_triangles,
        };
        let mut pass = PartedPass::begin(cmd, parts);
        shape.draw(&mut pass, &self.pipeline, set, drawn);
        pass.end();
    }
}

const ATTRIBUTES: [VertexAttribute; 2] = [
    VertexAttribute {
        format: Format::R32G32B32_SFLOAT,
        offset: std::mem::offset_of!(Vertex, position) as u32,
    },
    VertexAttribute {
        format: Format::R32_UINT,
        offset: std::mem::offset_of!(Vertex, prism) as u32,
    },
];

/// State of pipelines that draw the backs of prisms: these are seen from outside and from inside,
/// and once.
pub(super) fn prisms<'a>(
    name: &'a str,
    shaders: &'a GraphicsShaders<'a>,
    constants: &'a [u32],
) -> GraphicsState<'a> {
    GraphicsState {
        name,
        shaders,
        constants,
        vertex_stride: size_of::<Vertex>() as u32,
        attributes: &ATTRIBUTES,
        blending: Blending::Nearest,
        sides: Sides::Backs,
    }
}

impl ShapeBuffers {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, shape: &Shape<'_>) -> Result<Self> {
        let vertices: Vec<Vertex> = (0..)
            .zip(shape.prisms)
            .flat_map(|(prism, p)| {
                [p.low_a, p.low_b, p.low_c, p.high_a, p.high_b, p.high_c]
                    .map(|position| Vertex { position, prism })
            })
            .collect();
        let indices: Vec<u32> = (0..)
            .zip(shape.mirrored)
            .flat_map(|(prism, &mirrored)| {
                let turn = move |i: usize| {
                    let swapped = if mirrored { [0, 2, 1][i % 3] } else { i % 3 };
                    CORNERS * prism + HULL[i - i % 3 + swapped]
                };
                (0..HULL.len()).map(turn)
            })
            .collect();
        let (texels, drawn) = (BufferUse::Texels, BufferUse::Geometry);
        Ok(Self {
            prisms: upload(device, "relief prisms", shape.prisms, texels)?,
            surfaces: upload(device, "relief surfaces", shape.surfaces, texels)?,
            tiles: upload(device, "relief tiles", shape.tiles, texels)?,
            pyramids: upload(device, "relief pyramids", shape.pyramids, texels)?,
            vertices: upload(device, "relief vertices", &vertices, drawn)?,
            indices: upload(device, "relief indices", &indices, drawn)?,
        })
    }

    pub(super) fn bindings(&self) -> Bindings<'_> {
        Bindings {
            prisms: &self.prisms,
            surfaces: &self.surfaces,
            tiles: &self.tiles,
            pyramid: &self.pyramids,
        }
    }

    /// Draws prisms within the render pass that is under way.
    pub(super) fn draw(
        &self,
        pass: &mut PartedPass<'_>,
        pipeline: &GraphicsPipeline,
        set: &DescriptorSet,
        drawn: &Drawn,
    ) {
        let of_prism = HULL.len() as u32 / 3;
        let prisms = drawn.prisms.iter();
        let triangles = prisms.map(|run| of_prism * run.start..of_prism * run.end);
        pass.draw(triangles, |cmd| {
            cmd.bind_indices(&self.indices);
            cmd.bind_graphics(pipeline, set, Some(&self.vertices));
            cmd.push_graphics(pipeline, &drawn.parameters);
        });
    }
}
