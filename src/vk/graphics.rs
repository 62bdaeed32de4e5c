//! Graphics pipelines.

use std::sync::Arc;

use ash::vk;

use super::pipeline::{Module, PipelineOwner, constant_entries, recipe};
use super::{DescriptorSet, Device, GraphicsShaders, RenderPass, ShaderBindings};
use crate::error::Result;

/// One attribute of the one vertex buffer.
#[derive(Debug, Clone, Copy)]
pub struct VertexAttribute {
    pub format: vk::Format,
    pub offset: u32,
}

/// What a graphics pipeline is made of. Triangles, reversed depth (greater wins), viewport set per
/// draw.
pub struct GraphicsState<'a> {
    pub name: &'a str,
    pub shaders: &'a GraphicsShaders<'a>,
    /// The fragment shader's specialisation constants 0, 1, …
    pub constants: &'a [u32],
    /// Without attributes there is no vertex buffer.
    pub vertex_stride: u32,
    pub attributes: &'a [VertexAttribute],
    pub blending: Blending,
    pub sides: Sides,
}

/// Which sides of triangles are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sides {
    Both,
    /// Those that face the eye.
    Fronts,
    Backs,
}

/// A graphics pipeline. A clone is another handle to the same pipeline, and so is one of the same
/// state: the device makes it once.
#[derive(Clone)]
pub struct GraphicsPipeline {
    pub(super) owner: Arc<PipelineOwner>,
    device: Arc<Device>,
}

pub(super) const GRAPHICS_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

/// How a fragment's colour is combined with the colour in the target.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Blending {
    /// The nearest wins.
    Nearest,
    /// Replaces what lies in front of it, and is drawn nowhere else; depths stay.
    Under,
    /// All are summed; depth is ignored.
    Sum,
    /// The later lies over the earlier by its alpha, with which its colour is premultiplied; depth
    /// is ignored.
    Over,
    /// As `Over`, on what lies in the same place or behind; depths stay.
    Glaze,
    /// Added to what lies in the same place or behind; depths stay.
    Add,
}

impl GraphicsPipeline {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, pass: &RenderPass, state: &GraphicsState<'_>) -> Result<Self> {
        let shaders = [state.shaders.vertex, state.shaders.fragment];
        let of = recipe(
            &shaders,
            format_args!("{:?} {:?}", pass.owner.colour, state.fixed()),
        );
        let make = || {
            let interface = state.shaders.interface;
            PipelineOwner::new(device, state.name, interface, GRAPHICS_STAGES, |layout| {
                Self::make(device, pass, state, layout)
            })
        };
        Ok(Self {
            owner: device.pipelines.find_or_make(of, make)?,
            device: Arc::clone(device),
        })
    }

    fn make(
        device: &Device,
        pass: &RenderPass,
        state: &GraphicsState<'_>,
        layout: vk::PipelineLayout,
    ) -> Result<vk::Pipeline> {
        let vertex = Module::new(device, state.shaders.vertex)?;
        let fragment = Module::new(device, state.shaders.fragment)?;
        let entries = constant_entries(state.constants);
        let specialisation = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(bytemuck::cast_slice(state.constants));
        let stages = [
            stage(vk::ShaderStageFlags::VERTEX, &vertex),
            stage(vk::ShaderStageFlags::FRAGMENT, &fragment).specialization_info(&specialisation),
        ];
        let buffers = [vk::VertexInputBindingDescription::default()
            .binding(0)
            .stride(state.vertex_stride)
            .input_rate(vk::VertexInputRate::VERTEX)];
        let attributes = state.attribute_descriptions();
        let used = buffers.len().min(attributes.len());
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&buffers[..used])
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(match state.sides {
                Sides::Both => vk::CullModeFlags::NONE,
                Sides::Fronts => vk::CullModeFlags::BACK,
                Sides::Backs => vk::CullModeFlags::FRONT,
            })
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(!matches!(state.blending, Blending::Sum | Blending::Over))
            .depth_write_enable(state.blending == Blending::Nearest)
            .depth_compare_op(match state.blending {
                Blending::Add | Blending::Glaze => vk::CompareOp::GREATER_OR_EQUAL,
                Blending::Under => vk::CompareOp::LESS,
                _ => vk::CompareOp::GREATER,
            });
        let blends = [state.blending.attachment()];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blends);
        let dynamic_states = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic_states);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stages)
            .vertex_input_state(&input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(layout)
            .render_pass(pass.owner.raw);
        // SAFETY: everything that `info` points to outlives the call.
        let made = unsafe {
            device
                .raw
                .create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
        };
        let made = made.map_err(|(_, e)| device.error("creating a graphics pipeline")(e))?;
        Ok(made[0])
    }

    /// A descriptor set for this pipeline.
    ///
    /// # Errors
    /// A device that fails.
    pub fn bind(&self, name: &str, bindings: &impl ShaderBindings) -> Result<DescriptorSet> {
        (self.owner.descriptors).bind(&self.device, name, bindings)
    }
}

fn stage<'a>(
    stage: vk::ShaderStageFlags,
    module: &Module<'_>,
) -> vk::PipelineShaderStageCreateInfo<'a> {
    vk::PipelineShaderStageCreateInfo::default()
        .stage(stage)
        .module(module.raw)
        .name(c"main")
}

impl GraphicsState<'_> {
    /// All that does not come from shaders.
    fn fixed(&self) -> impl std::fmt::Debug {
        let vertices = (self.vertex_stride, self.attributes);
        let interface = self.shaders.interface;
        (
            interface,
            self.constants,
            vertices,
            self.blending,
            self.sides,
        )
    }

    fn attribute_descriptions(&self) -> Vec<vk::VertexInputAttributeDescription> {
        (0..)
            .zip(self.attributes)
            .map(|(location, attribute)| {
                vk::VertexInputAttributeDescription::default()
                    .location(location)
                    .binding(0)
                    .format(attribute.format)
                    .offset(attribute.offset)
            })
            .collect()
    }
}

impl Blending {
    fn attachment(self) -> vk::PipelineColorBlendAttachmentState {
        let kept = match self {
            Self::Over | Self::Glaze => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
            Self::Nearest | Self::Under | Self::Sum | Self::Add => vk::BlendFactor::ONE,
        };
        vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(!matches!(self, Self::Nearest | Self::Under))
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(kept)
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(kept)
            .alpha_blend_op(vk::BlendOp::ADD)
            .color_write_mask(vk::ColorComponentFlags::RGBA)
    }
}
