//! Two-dimensional images with their memory and one view.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;

use super::Device;
use super::device::{MemoryRequest, Resource};
use crate::error::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageUse {
    /// Drawn into, then read by shaders or copied from.
    ColourTarget,
    /// Drawn into only.
    DepthTarget,
    /// Filled by a copy, read by shaders.
    Texture,
}

/// An image with its memory and a view of all of it. A clone is another handle to the same image.
///
/// Descriptor sets and framebuffers that bind it and commands that record it keep it alive.
#[derive(Clone)]
pub struct Image {
    pub(super) owner: Arc<ImageOwner>,
}

pub(super) struct ImageOwner {
    pub(super) raw: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) mip_levels: u32,
    pub(super) aspect: vk::ImageAspectFlags,
    allocation: Option<Allocation>,
    device: Arc<Device>,
}

impl Image {
    /// # Errors
    /// An image that exceeds the device's memory or its largest side.
    pub fn new(
        device: &Arc<Device>,
        name: &str,
        (width, height): (u32, u32),
        format: vk::Format,
        usage: ImageUse,
    ) -> Result<Self> {
        Self::with_levels(device, name, (width, height), format, usage, 1)
    }

    /// A texture with every level of detail from its own size down to one texel.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn mipped(
        device: &Arc<Device>,
        name: &str,
        (width, height): (u32, u32),
        format: vk::Format,
    ) -> Result<Self> {
        let levels = width.max(height).ilog2() + 1;
        Self::with_levels(
            device,
            name,
            (width, height),
            format,
            ImageUse::Texture,
            levels,
        )
    }

    fn with_levels(
        device: &Arc<Device>,
        name: &str,
        (width, height): (u32, u32),
        format: vk::Format,
        usage: ImageUse,
        mip_levels: u32,
    ) -> Result<Self> {
        let side = device.limits().max_image_side;
        if width > side || height > side {
            return Err(Error::Device(format!(
                "{}: an image of {width}×{height} ({name}) is above the device's {side}",
                device.name()
            )));
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(mip_levels)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .tiling(vk::ImageTiling::OPTIMAL)
            .usage(usage.flags());
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_image(&info, None) }
            .map_err(device.error("creating an image"))?;
        let mut owner = ImageOwner {
            raw,
            view: vk::ImageView::null(),
            width,
            height,
            mip_levels,
            aspect: usage.aspect(),
            allocation: None,
            device: Arc::clone(device),
        };
        device.set_name(raw, name);
        owner.bind_memory(name)?;
        owner.make_view(name, format)?;
        Ok(Self {
            owner: Arc::new(owner),
        })
    }

    /// Width and height in texels.
    pub fn size(&self) -> (u32, u32) {
        (self.owner.width, self.owner.height)
    }
}

impl ImageOwner {
    fn bind_memory(&mut self, name: &str) -> Result<()> {
        let device = &self.device;
        let allocation = device.allocate(&MemoryRequest {
            name,
            // SAFETY: the image is of this device.
            requirements: unsafe { device.raw.get_image_memory_requirements(self.raw) },
            location: MemoryLocation::GpuOnly,
            of: Resource::Image(self.raw),
        })?;
        // SAFETY: the allocation meets this image's requirements and is bound once.
        let bound = unsafe {
            device
                .raw
                .bind_image_memory(self.raw, allocation.memory(), allocation.offset())
        };
        // Stored before the check, so that a failure frees it.
        self.allocation = Some(allocation);
        bound.map_err(device.error("binding an image's memory"))
    }

    fn make_view(&mut self, name: &str, format: vk::Format) -> Result<()> {
        let info = vk::ImageViewCreateInfo::default()
            .image(self.raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(self.aspect)
                    .level_count(self.mip_levels)
                    .layer_count(1),
            );
        // SAFETY: the image is bound to memory and outlives its view.
        self.view = unsafe { self.device.raw.create_image_view(&info, None) }
            .map_err(self.device.error("creating an image view"))?;
        self.device.set_name(self.view, name);
        Ok(())
    }
}

impl ImageUse {
    fn flags(self) -> vk::ImageUsageFlags {
        use vk::ImageUsageFlags as F;
        match self {
            Self::ColourTarget => {
                F::COLOR_ATTACHMENT | F::SAMPLED | F::TRANSFER_SRC | F::TRANSFER_DST
            }
            Self::DepthTarget => F::DEPTH_STENCIL_ATTACHMENT,
            Self::Texture => F::SAMPLED | F::TRANSFER_DST | F::TRANSFER_SRC,
        }
    }

    fn aspect(self) -> vk::ImageAspectFlags {
        match self {
            Self::ColourTarget | Self::Texture => vk::ImageAspectFlags::COLOR,
            Self::DepthTarget => vk::ImageAspectFlags::DEPTH,
        }
    }
}

impl Drop for ImageOwner {
    fn drop(&mut self) {
        // SAFETY: sets, framebuffers and commands that use the image hold its owner, so none is
        // left; a null view is allowed.
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            self.device.free(allocation);
        }
    }
}
