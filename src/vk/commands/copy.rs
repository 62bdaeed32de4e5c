//! Copies and fills of buffers and images.

use ash::vk;
use ash::vk::ImageLayout as L;

use super::Commands;
use crate::vk::image::ImageOwner;
use crate::vk::{Buffer, Image};

impl Commands {
    /// Copies `bytes` bytes between buffers, from and to byte offsets.
    pub fn copy(&self, from: &Buffer, from_offset: u64, to: &Buffer, to_offset: u64, bytes: u64) {
        assert!(from_offset + bytes <= from.bytes() && to_offset + bytes <= to.bytes());
        if bytes == 0 {
            return;
        }
        self.hold(&from.owner);
        self.hold(&to.owner);
        let regions = [vk::BufferCopy {
            src_offset: from_offset,
            dst_offset: to_offset,
            size: bytes,
        }];
        // SAFETY: the ranges lie within the buffers.
        unsafe {
            self.device
                .raw
                .cmd_copy_buffer(self.raw(), from.owner.raw, to.owner.raw, &regions);
        }
    }

    /// Fills a whole buffer with a repeated word.
    pub fn fill(&self, buffer: &Buffer, word: u32) {
        self.hold(&buffer.owner);
        // SAFETY: every buffer is created as a target of transfers.
        unsafe {
            self.device
                .raw
                .cmd_fill_buffer(self.raw(), buffer.owner.raw, 0, vk::WHOLE_SIZE, word);
        }
    }

    /// Copies an image that a render pass left for copies, its rows tightly packed.
    pub fn copy_image_to_buffer(&self, image: &Image, to: &Buffer) {
        self.hold(&image.owner);
        self.hold(&to.owner);
        let regions = [largest_level(&image.owner)];
        // SAFETY: the render pass left the image in this layout, and the buffer holds its texels.
        unsafe {
            self.device.raw.cmd_copy_image_to_buffer(
                self.raw(),
                image.owner.raw,
                L::TRANSFER_SRC_OPTIMAL,
                to.owner.raw,
                &regions,
            );
        }
    }

    /// Copies an image that a render pass left for shaders, and makes it readable by them again.
    pub fn copy_shader_image_to_buffer(&self, image: &Image, to: &Buffer) {
        self.transition(image, L::SHADER_READ_ONLY_OPTIMAL, L::TRANSFER_SRC_OPTIMAL);
        self.copy_image_to_buffer(image, to);
        self.transition(image, L::TRANSFER_SRC_OPTIMAL, L::SHADER_READ_ONLY_OPTIMAL);
    }

    /// Fills a texture from tightly packed rows, its levels of detail one after another from the
    /// largest, and makes it readable by shaders.
    pub fn upload_texture(&self, from: &Buffer, image: &Image, bytes_per_texel: u64) {
        self.transition(image, L::UNDEFINED, L::TRANSFER_DST_OPTIMAL);
        self.hold(&from.owner);
        let owner = &image.owner;
        let mut offset = 0;
        let regions: Vec<_> = (0..owner.mip_levels)
            .map(|level| {
                let mut region = largest_level(owner).buffer_offset(offset);
                region.image_subresource.mip_level = level;
                region.image_extent.width = (owner.width >> level).max(1);
                region.image_extent.height = (owner.height >> level).max(1);
                let texels =
                    u64::from(region.image_extent.width) * u64::from(region.image_extent.height);
                offset += texels * bytes_per_texel;
                region
            })
            .collect();
        assert!(offset <= from.bytes(), "the buffer holds every level");
        // SAFETY: the transition leaves the image in this layout, and the buffer holds its texels.
        unsafe {
            self.device.raw.cmd_copy_buffer_to_image(
                self.raw(),
                from.owner.raw,
                owner.raw,
                L::TRANSFER_DST_OPTIMAL,
                &regions,
            );
        }
        self.transition(image, L::TRANSFER_DST_OPTIMAL, L::SHADER_READ_ONLY_OPTIMAL);
    }

    fn transition(&self, image: &Image, old: L, new: L) {
        self.hold(&image.owner);
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(old)
            .new_layout(new)
            .image(image.owner.raw)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(image.owner.mip_levels)
                    .layer_count(1),
            )];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the image is in the layout `old`, or its content may be lost (undefined).
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw(), &info) };
    }
}

/// All of an image's largest level of detail.
fn largest_level(image: &ImageOwner) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .image_subresource(
            vk::ImageSubresourceLayers::default()
                .aspect_mask(image.aspect)
                .layer_count(1),
        )
        .image_extent(vk::Extent3D {
            width: image.width,
            height: image.height,
            depth: 1,
        })
}
