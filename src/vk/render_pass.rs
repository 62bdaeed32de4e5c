//! Render passes with every dependency written out, and framebuffers.

use std::sync::Arc;

use ash::vk;

use super::held::Held;
use super::{Device, Image};
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

/// What of a target's content a render pass goes on with; the rest is cleared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Before {
    Nothing,
    Depths,
    All,
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

    fn final_layout(self) -> vk::ImageLayout {
        match self.then {
            AfterPass::Shaders => vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
            AfterPass::Copy => vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
        }
    }

    /// The stages that read it next, and how.
    fn readers(self) -> (vk::PipelineStageFlags, vk::AccessFlags) {
        use vk::{AccessFlags as A, PipelineStageFlags as S};
        match self.then {
            AfterPass::Shaders => (S::COMPUTE_SHADER | S::FRAGMENT_SHADER, A::SHADER_READ),
            AfterPass::Copy => (S::TRANSFER, A::TRANSFER_READ),
        }
    }
}

/// A render pass of one subpass: a colour and a depth attachment, both stored. They are cleared at
/// the start but where it is said. A clone is another handle to the same render pass.
///
/// Commands that record it keep it alive.
#[derive(Clone)]
pub struct RenderPass {
    pub(super) owner: Arc<RenderPassOwner>,
}

pub(super) struct RenderPassOwner {
    pub(super) raw: vk::RenderPass,
    /// Render passes of equal ones are compatible.
    pub(super) colour: Attachment,
    device: Arc<Device>,
}

const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;
const DEPTH_LAYOUT: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;

impl RenderPass {
    /// A render pass that goes on with the depths of another one.
    ///
    /// # Errors
    /// A device that fails.
    pub fn over_depths(device: &Arc<Device>, name: &str, colour: Attachment) -> Result<Self> {
        Self::from_attachments(device, name, colour, Before::Depths)
    }

    /// Two render passes: the first clears the targets, the second adds to them and may be
    /// repeated.
    ///
    /// # Errors
    /// A device that fails.
    pub fn in_parts(device: &Arc<Device>, name: &str, colour: Attachment) -> Result<[Self; 2]> {
        let part = |before| Self::from_attachments(device, name, colour, before);
        Ok([part(Before::Nothing)?, part(Before::All)?])
    }

    fn from_attachments(
        device: &Arc<Device>,
        name: &str,
        colour: Attachment,
        before: Before,
    ) -> Result<Self> {
        let attachments = descriptions(colour, before);
        let colours = [vk::AttachmentReference::default()
            .attachment(0)
            .layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)];
        let depth = vk::AttachmentReference::default()
            .attachment(1)
            .layout(DEPTH_LAYOUT);
        let subpasses = [vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&colours)
            .depth_stencil_attachment(&depth)];
        let dependencies = dependencies(colour);
        let info = vk::RenderPassCreateInfo::default()
            .attachments(&attachments)
            .subpasses(&subpasses)
            .dependencies(&dependencies);
        // SAFETY: `info` outlives the call.
        let raw = unsafe { device.raw.create_render_pass(&info, None) }
            .map_err(device.error("creating a render pass"))?;
        device.set_name(raw, name);
        let device = Arc::clone(device);
        Ok(Self {
            owner: Arc::new(RenderPassOwner {
                raw,
                colour,
                device,
            }),
        })
    }
}

/// The colour attachment, then the depth attachment.
fn descriptions(colour: Attachment, before: Before) -> [vk::AttachmentDescription; 2] {
    let description = |format, loaded: Option<vk::ImageLayout>, layout| {
        let (load, initial_layout) = match loaded {
            Some(layout) => (vk::AttachmentLoadOp::LOAD, layout),
            None => (vk::AttachmentLoadOp::CLEAR, vk::ImageLayout::UNDEFINED),
        };
        vk::AttachmentDescription::default()
            .format(format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(load)
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(initial_layout)
            .final_layout(layout)
    };
    let of_colour = (before == Before::All).then(|| colour.final_layout());
    let of_depths = (before != Before::Nothing).then_some(DEPTH_LAYOUT);
    [
        description(colour.format, of_colour, colour.final_layout()),
        description(DEPTH_FORMAT, of_depths, DEPTH_LAYOUT),
    ]
}

/// What comes before the render pass, then what comes after it.
fn dependencies(colour: Attachment) -> [vk::SubpassDependency; 2] {
    use vk::{AccessFlags as A, PipelineStageFlags as S};
    let (stage, access) = colour.readers();
    let targets = S::COLOR_ATTACHMENT_OUTPUT | S::EARLY_FRAGMENT_TESTS | S::LATE_FRAGMENT_TESTS;
    let writes = A::COLOR_ATTACHMENT_WRITE | A::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let reads = A::COLOR_ATTACHMENT_READ | A::DEPTH_STENCIL_ATTACHMENT_READ;
    [
        // All readers of the last content of the targets are done before they are cleared.
        vk::SubpassDependency::default()
            .src_subpass(vk::SUBPASS_EXTERNAL)
            .dst_subpass(0)
            .src_stage_mask(stage | targets)
            .src_access_mask(writes)
            .dst_stage_mask(targets)
            .dst_access_mask(reads | writes),
        // What was drawn is visible to the next reader.
        vk::SubpassDependency::default()
            .src_subpass(0)
            .dst_subpass(vk::SUBPASS_EXTERNAL)
            .src_stage_mask(targets)
            .src_access_mask(writes)
            .dst_stage_mask(stage)
            .dst_access_mask(access),
    ]
}

impl Drop for RenderPassOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the render pass hold its owner, so none is left.
        unsafe { self.device.raw.destroy_render_pass(self.raw, None) };
    }
}

/// A colour and a depth image to draw into. A clone is another handle to the same framebuffer.
///
/// It keeps its images alive; commands that record it keep it alive.
#[derive(Clone)]
pub struct Framebuffer {
    pub(super) owner: Arc<FramebufferOwner>,
}

pub(super) struct FramebufferOwner {
    pub(super) raw: vk::Framebuffer,
    pub(super) width: u32,
    pub(super) height: u32,
    /// The images, until the framebuffer is destroyed.
    _images: Held,
    device: Arc<Device>,
}

impl Framebuffer {
    /// # Errors
    /// A device that fails.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        pass: &RenderPass,
        colour: &Image,
        depth: &Image,
    ) -> Result<Self> {
        let views = [colour.owner.view, depth.owner.view];
        let (width, height) = colour.size();
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass.owner.raw)
            .attachments(&views)
            .width(width)
            .height(height)
            .layers(1);
        // SAFETY: render pass and images are alive; the framebuffer holds the images below.
        let raw = unsafe { device.raw.create_framebuffer(&info, None) }
            .map_err(device.error("creating a framebuffer"))?;
        device.set_name(raw, name);
        let mut images = Held::default();
        images.hold(&colour.owner);
        images.hold(&depth.owner);
        Ok(Self {
            owner: Arc::new(FramebufferOwner {
                raw,
                width,
                height,
                _images: images,
                device: Arc::clone(device),
            }),
        })
    }
}

impl Drop for FramebufferOwner {
    fn drop(&mut self) {
        // SAFETY: commands that record the framebuffer hold its owner, so none is left.
        unsafe { self.device.raw.destroy_framebuffer(self.raw, None) };
    }
}
