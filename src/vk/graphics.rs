//! Render passes with everything spelled out, framebuffers, graphics pipelines.

use std::sync::Arc;

use ash::vk;

use super::compute::{Module, pipeline_layout};
use super::{Bind, Binding, DescriptorLayout, DescriptorSet, Device, Image};
use crate::error::Result;

/// One colour attachment of a render pass. It is cleared at the start and kept at the end.
#[derive(Debug, Clone, Copy)]
pub struct Attachment {
    pub format: vk::Format,
    /// The layout it is left in, and so what may read it next.
    pub then: AfterPass,
}

/// What happens to a colour attachment after its render pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum AfterPass {
    /// Shaders read it.
    Shaders,
    /// It is copied from.
    Copy,
}

/// What happens to the depths after a render pass.
#[derive(Debug, Clone, Copy)]
enum Depth {
    Dropped,
    Kept,
    Copied,
}

impl Attachment {
    pub fn read_by_shaders(format: vk::Format) -> Self {
        Self {
            format,
            then: AfterPass::Shaders,
        }
    }

    pub fn copied(format: vk::Format) -> Self {
        Self {
            format,
            then: AfterPass::Copy,
        }
    }
}

/// A render pass of one subpass: one colour attachment (cleared, stored) and a depth attachment (cleared, stored if asked for). In further
/// parts of one, neither is cleared.
pub struct RenderPass {
    pub(super) raw: vk::RenderPass,
    device: Arc<Device>,
}

pub(super) const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

impl RenderPass {
    pub fn new(device: &Arc<Device>, name: &str, colour: Attachment) -> Result<Self> {
        Self::with_depth(device, name, colour, false)
    }

    /// With `copied`, the depths are kept to be copied from.
    pub fn with_depth(
        device: &Arc<Device>,
        name: &str,
        colour: Attachment,
        copied: bool,
    ) -> Result<Self> {
        let depth = if copied {
            Depth::Copied
        } else {
            Depth::Dropped
        };
        Self::from_attachments(device, name, colour, depth, false)
    }

    /// Two: for what is drawn first, and for what is drawn to it afterwards, as often as there is more.
    pub fn in_parts(device: &Arc<Device>, name: &str, colour: Attachment) -> Result<[Self; 2]> {
        let part = |further| Self::from_attachments(device, name, colour, Depth::Kept, further);
        Ok([part(false)?, part(true)?])
    }

    fn from_attachments(
        device: &Arc<Device>,
        name: &str,
        colour: Attachment,
        depth: Depth,
        further: bool,
    ) -> Result<Self> {
        let (depth_store, depth_layout) = match depth {
            Depth::Copied => (
                vk::AttachmentStoreOp::STORE,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
            ),
            Depth::Kept => (
                vk::AttachmentStoreOp::STORE,
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            ),
            Depth::Dropped => (
                vk::AttachmentStoreOp::DONT_CARE,
                vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL,
            ),
        };
        let (layout, stage, access) = match colour.then {
            AfterPass::Shaders => (
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
                vk::PipelineStageFlags::COMPUTE_SHADER | vk::PipelineStageFlags::FRAGMENT_SHADER,
                vk::AccessFlags::SHADER_READ,
            ),
            AfterPass::Copy => (
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                vk::PipelineStageFlags::TRANSFER,
                vk::AccessFlags::TRANSFER_READ,
            ),
        };
        let (load, from) = match further {
            true => (vk::AttachmentLoadOp::LOAD, [layout, depth_layout]),
            false => (vk::AttachmentLoadOp::CLEAR, [vk::ImageLayout::UNDEFINED; 2]),
        };
        let attachments = [
            vk::AttachmentDescription::default()
                .format(colour.format)
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(load)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                .initial_layout(from[0])
                .final_layout(layout),
            vk::AttachmentDescription::default()
                .format(DEPTH_FORMAT)
                .samples(vk::SampleCountFlags::TYPE_1)
                .load_op(load)
                .store_op(depth_store)
                .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                .initial_layout(from[1])
                .final_layout(depth_layout),
        ];
        let colours = [vk::AttachmentReference::default()
            .attachment(0)
            .layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)];
        let depth = vk::AttachmentReference::default()
            .attachment(1)
            .layout(vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
        let subpasses = [vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&colours)
            .depth_stencil_attachment(&depth)];
        let targets = vk::PipelineStageFlags::COLOR_ATTACHMENT_OUTPUT
            | vk::PipelineStageFlags::EARLY_FRAGMENT_TESTS
            | vk::PipelineStageFlags::LATE_FRAGMENT_TESTS;
        let writes = vk::AccessFlags::COLOR_ATTACHMENT_READ
            | vk::AccessFlags::COLOR_ATTACHMENT_WRITE
            | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_READ
            | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE;
        let dependencies = [
            // Whoever read the last content of the targets is done before they are cleared.
            vk::SubpassDependency::default()
                .src_subpass(vk::SUBPASS_EXTERNAL)
                .dst_subpass(0)
                .src_stage_mask(stage | targets)
                .src_access_mask(
                    vk::AccessFlags::COLOR_ATTACHMENT_WRITE
                        | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE,
                )
                .dst_stage_mask(targets)
                .dst_access_mask(writes),
            // What was drawn is seen by whoever reads it next.
            vk::SubpassDependency::default()
                .src_subpass(0)
                .dst_subpass(vk::SUBPASS_EXTERNAL)
                .src_stage_mask(targets)
                .src_access_mask(
                    vk::AccessFlags::COLOR_ATTACHMENT_WRITE
                        | vk::AccessFlags::DEPTH_STENCIL_ATTACHMENT_WRITE,
                )
                .dst_stage_mask(stage)
                .dst_access_mask(access),
        ];
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses)
            .dependencies(&dependencies);
        // SAFETY: `info` outlives the call.
        let raw = unsafe { device.raw.create_render_pass(&info, None) }
            .map_err(device.error("creating a render pass"))?;
        device.set_name(raw, name);
        Ok(Self {
            raw,
            device: Arc::clone(device),
        })
    }
}

impl Drop for RenderPass {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the pass waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_render_pass(self.raw, None) };
    }
}

/// A colour and a depth image to draw into.
pub struct Framebuffer {
    pub(super) raw: vk::Framebuffer,
    pub(super) width: u32,
    pub(super) height: u32,
    device: Arc<Device>,
}

impl Framebuffer {
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        pass: &RenderPass,
        colour: &Image,
        depth: &Image,
    ) -> Result<Self> {
        let views = [colour.view, depth.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.raw)
            .attachments(&views)
            .width(colour.width)
            .height(colour.height)
            .layers(1);
        // SAFETY: the images outlive the framebuffer, which their owner keeps beside them.
        let raw = unsafe { device.raw.create_framebuffer(&info, None) }
            .map_err(device.error("creating a framebuffer"))?;
        device.set_name(raw, name);
        Ok(Self {
            raw,
            width: colour.width,
            height: colour.height,
            device: Arc::clone(device),
        })
    }
}

impl Drop for Framebuffer {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the framebuffer waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_framebuffer(self.raw, None) };
    }
}

/// One attribute of the one vertex buffer.
#[derive(Debug, Clone, Copy)]
pub struct VertexAttribute {
    pub format: vk::Format,
    pub offset: u32,
}

/// What a graphics pipeline is made of. Triangles, no culling, reversed depth (greater wins), viewport set per draw.
pub struct GraphicsState<'a> {
    pub name: &'a str,
    pub vertex: &'a [u32],
    pub fragment: &'a [u32],
    pub bindings: &'a [Binding],
    pub push_bytes: usize,
    pub vertex_stride: u32,
    pub attributes: &'a [VertexAttribute],
    /// Colours of all fragments are summed and depth is not looked at.
    pub sums: bool,
}

pub struct GraphicsPipeline {
    pub(super) raw: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) push_bytes: u32,
    descriptors: DescriptorLayout,
    device: Arc<Device>,
}

pub(super) const GRAPHICS_STAGES: vk::ShaderStageFlags = vk::ShaderStageFlags::from_raw(
    vk::ShaderStageFlags::VERTEX.as_raw() | vk::ShaderStageFlags::FRAGMENT.as_raw(),
);

/// How a fragment's colour meets what is there.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Blending {
    /// The nearest wins.
    Nearest,
    /// All are summed; depth is not looked at.
    Sum,
    /// The later lies over the earlier by its alpha, which its colour has been multiplied by; depth is not looked at.
    Over,
}

impl GraphicsPipeline {
    pub fn new(device: &Arc<Device>, pass: &RenderPass, state: &GraphicsState<'_>) -> Result<Self> {
        let blending = match state.sums {
            true => Blending::Sum,
            false => Blending::Nearest,
        };
        Self::blended(device, pass, state, blending)
    }

    /// A pipeline that lays what it draws over what is there, by alpha that the colours have been multiplied by; depth is not
    /// looked at.
    pub fn over(
        device: &Arc<Device>,
        pass: &RenderPass,
        state: &GraphicsState<'_>,
    ) -> Result<Self> {
        Self::blended(device, pass, state, Blending::Over)
    }

    fn blended(
        device: &Arc<Device>,
        pass: &RenderPass,
        state: &GraphicsState<'_>,
        blending: Blending,
    ) -> Result<Self> {
        let descriptors = DescriptorLayout::new(device, state.name, state.bindings)?;
        let layout = pipeline_layout(
            device,
            state.name,
            &descriptors,
            state.push_bytes,
            GRAPHICS_STAGES,
        )?;
        let mut pipeline = Self {
            raw: vk::Pipeline::null(),
            layout,
            push_bytes: state.push_bytes as u32,
            descriptors,
            device: Arc::clone(device),
        };
        let vertex = Module::new(device, state.vertex)?;
        let fragment = Module::new(device, state.fragment)?;
        let stages = [
            vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::VERTEX)
                .module(vertex.raw)
                .name(c"main"),
            vk::PipelineShaderStageCreateInfo::default()
                .stage(vk::ShaderStageFlags::FRAGMENT)
                .module(fragment.raw)
                .name(c"main"),
        ];
        let buffers = [vk::VertexInputBindingDescription::default()
            .binding(0)
            .stride(state.vertex_stride)
            .input_rate(vk::VertexInputRate::VERTEX)];
        let attributes: Vec<_> = state
            .attributes
            .iter()
            .enumerate()
            .map(|(i, a)| {
                vk::VertexInputAttributeDescription::default()
                    .location(i as u32)
                    .binding(0)
                    .format(a.format)
                    .offset(a.offset)
            })
            .collect();
        let input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&buffers)
            .vertex_attribute_descriptions(&attributes);
        let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
            .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
            .line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(blending == Blending::Nearest)
            .depth_write_enable(blending == Blending::Nearest)
            .depth_compare_op(vk::CompareOp::GREATER);
        let kept = match blending {
            Blending::Over => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
            Blending::Nearest | Blending::Sum => vk::BlendFactor::ONE,
        };
        let blends = [vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(blending != Blending::Nearest)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(kept)
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(kept)
            .alpha_blend_op(vk::BlendOp::ADD)
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
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
            .render_pass(pass.raw);
        // SAFETY: everything that `info` points to outlives the call.
        pipeline.raw = unsafe {
            device
                .raw
                .create_graphics_pipelines(vk::PipelineCache::null(), &[info], None)
        }
        .map_err(|(_, e)| device.error("creating a graphics pipeline")(e))?[0];
        device.set_name(pipeline.raw, state.name);
        Ok(pipeline)
    }

    pub fn bind(&self, name: &str, binds: &[Bind<'_>]) -> Result<DescriptorSet> {
        self.descriptors.bind(name, binds)
    }
}

impl Drop for GraphicsPipeline {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the pipeline waits for the submission before dropping it.
        unsafe {
            self.device.raw.destroy_pipeline(self.raw, None);
            self.device.raw.destroy_pipeline_layout(self.layout, None);
        }
    }
}
