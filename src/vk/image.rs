//! Two-dimensional images with their memory and one view, and samplers.

use std::sync::Arc;

use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::Device;
use crate::error::{Error, Result};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageUse {
    /// Drawn into, then read by shaders or copied from.
    ColourTarget,
    /// Drawn into only.
    DepthTarget,
    /// Drawn into, then copied from.
    CopiedDepth,
    /// Filled by a copy, read by shaders.
    Texture,
}

pub struct Image {
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
        let (flags, aspect) = match usage {
            ImageUse::ColourTarget => (
                vk::ImageUsageFlags::COLOR_ATTACHMENT
                    | vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_SRC,
                vk::ImageAspectFlags::COLOR,
            ),
            ImageUse::DepthTarget => (
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT,
                vk::ImageAspectFlags::DEPTH,
            ),
            ImageUse::CopiedDepth => (
                vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC,
                vk::ImageAspectFlags::DEPTH,
            ),
            ImageUse::Texture => (
                vk::ImageUsageFlags::SAMPLED
                    | vk::ImageUsageFlags::TRANSFER_DST
                    | vk::ImageUsageFlags::TRANSFER_SRC,
                vk::ImageAspectFlags::COLOR,
            ),
        };
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
            .usage(flags);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_image(&info, None) }
            .map_err(device.error("creating an image"))?;
        let mut image = Self {
            raw,
            view: vk::ImageView::null(),
            width,
            height,
            mip_levels,
            aspect,
            allocation: None,
            device: Arc::clone(device),
        };
        device.set_name(raw, name);
        // SAFETY: the image is of this device.
        let requirements = unsafe { device.raw.get_image_memory_requirements(raw) };
        let allocation = device
            .allocator()
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location: MemoryLocation::GpuOnly,
                linear: false,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })
            .map_err(|_| Error::DeviceMemory {
                device: device.name().to_owned(),
                what: name.to_owned(),
                bytes: requirements.size,
            })?;
        // SAFETY: the allocation was made for this image's requirements and is bound once.
        unsafe {
            device
                .raw
                .bind_image_memory(raw, allocation.memory(), allocation.offset())
        }
        .map_err(device.error("binding an image's memory"))?;
        image.allocation = Some(allocation);
        let view_info = vk::ImageViewCreateInfo::default()
            .image(raw)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(aspect)
                    .level_count(mip_levels)
                    .layer_count(1),
            );
        // SAFETY: the image is bound to memory and outlives its view.
        image.view = unsafe { device.raw.create_image_view(&view_info, None) }
            .map_err(device.error("creating an image view"))?;
        device.set_name(image.view, name);
        Ok(image)
    }

    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: whoever recorded the image waits for the submission before dropping it; a null view is allowed.
        unsafe {
            self.device.raw.destroy_image_view(self.view, None);
            self.device.raw.destroy_image(self.raw, None);
        }
        if let Some(allocation) = self.allocation.take() {
            // Freeing fails for foreign allocations only.
            let _ = self.device.allocator().free(allocation);
        }
    }
}

/// A sampler that repeats, either nearest (for integer images read by texel) or linear, between levels of detail too.
pub struct Sampler {
    pub(super) raw: vk::Sampler,
    device: Arc<Device>,
}

impl Sampler {
    pub fn new(device: &Arc<Device>, name: &str, linear: bool) -> Result<Self> {
        let repeat = vk::SamplerAddressMode::REPEAT;
        Self::with_edges(device, name, linear, repeat)
    }

    /// A linear one that goes on beyond the edges as it is there.
    pub fn held(device: &Arc<Device>, name: &str) -> Result<Self> {
        let edge = vk::SamplerAddressMode::CLAMP_TO_EDGE;
        Self::with_edges(device, name, true, edge)
    }

    fn with_edges(
        device: &Arc<Device>,
        name: &str,
        linear: bool,
        edges: vk::SamplerAddressMode,
    ) -> Result<Self> {
        let filter = if linear {
            vk::Filter::LINEAR
        } else {
            vk::Filter::NEAREST
        };
        let between_levels = if linear {
            vk::SamplerMipmapMode::LINEAR
        } else {
            vk::SamplerMipmapMode::NEAREST
        };
        let info = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(between_levels)
            .max_lod(vk::LOD_CLAMP_NONE)
            .address_mode_u(edges)
            .address_mode_v(edges);
        // SAFETY: a plain creation on a live device.
        let raw = unsafe { device.raw.create_sampler(&info, None) }
            .map_err(device.error("creating a sampler"))?;
        device.set_name(raw, name);
        Ok(Self {
            raw,
            device: Arc::clone(device),
        })
    }
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: whoever bound the sampler waits for the submission before dropping it.
        unsafe { self.device.raw.destroy_sampler(self.raw, None) };
    }
}
