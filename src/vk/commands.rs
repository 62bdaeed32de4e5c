//! Recording and submitting.

use std::sync::Arc;

use ash::vk;
use bytemuck::Pod;

use super::graphics::GRAPHICS_STAGES;
use super::{
    Buffer, ComputePipeline, DescriptorSet, Device, Framebuffer, GraphicsPipeline, Image,
    RenderPass, Stage, Timestamps,
};
use crate::error::Result;

/// A command buffer, recorded once and submitted any number of times, with the fence of its last submission.
///
/// Whatever was recorded must live until the last submission is done: [`Commands::wait`] says when, and dropping waits.
pub struct Commands {
    pub(super) raw: vk::CommandBuffer,
    pool: vk::CommandPool,
    fence: vk::Fence,
    under_way: bool,
    device: Arc<Device>,
}

impl Commands {
    /// Records what `record` says.
    pub fn record(
        device: &Arc<Device>,
        name: &str,
        record: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<Self> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.family);
        // SAFETY: the family is the device's own.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }
            .map_err(device.error("creating a command pool"))?;
        let mut commands = Self {
            raw: vk::CommandBuffer::null(),
            pool,
            fence: vk::Fence::null(),
            under_way: false,
            device: Arc::clone(device),
        };
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::PRIMARY)
            .command_buffer_count(1);
        // SAFETY: the pool is this object's own.
        commands.raw = unsafe { device.raw.allocate_command_buffers(&info) }
            .map_err(device.error("allocating a command buffer"))?[0];
        // SAFETY: a plain creation on a live device.
        commands.fence = unsafe {
            device
                .raw
                .create_fence(&vk::FenceCreateInfo::default(), None)
        }
        .map_err(device.error("creating a fence"))?;
        device.set_name(commands.raw, name);
        device.set_name(commands.fence, name);
        // SAFETY: the buffer is new; it is recorded here and nowhere else.
        unsafe {
            device
                .raw
                .begin_command_buffer(commands.raw, &vk::CommandBufferBeginInfo::default())
        }
        .map_err(device.error("recording"))?;
        record(&commands)?;
        // SAFETY: recording was begun above.
        unsafe { device.raw.end_command_buffer(commands.raw) }
            .map_err(device.error("recording"))?;
        Ok(commands)
    }

    /// Records, submits and waits.
    pub fn run(
        device: &Arc<Device>,
        name: &str,
        record: impl FnOnce(&Self) -> Result<()>,
    ) -> Result<()> {
        let mut commands = Self::record(device, name, record)?;
        commands.submit()?;
        commands.wait()
    }

    /// Submits; the last submission must have been waited for.
    pub fn submit(&mut self) -> Result<()> {
        self.submit_between(&[], &[])
    }

    /// Submits between semaphores: copies wait for the first ones, and the others are signalled when all is done.
    pub(super) fn submit_between(
        &mut self,
        after: &[vk::Semaphore],
        before: &[vk::Semaphore],
    ) -> Result<()> {
        assert!(!self.under_way, "commands are submitted once at a time");
        let infos = [vk::CommandBufferSubmitInfo::default().command_buffer(self.raw)];
        let at = |stage| {
            move |&semaphore: &vk::Semaphore| {
                vk::SemaphoreSubmitInfo::default()
                    .semaphore(semaphore)
                    .stage_mask(stage)
            }
        };
        let copies = at(vk::PipelineStageFlags2::ALL_TRANSFER);
        let waits: Vec<_> = after.iter().map(copies).collect();
        let all = at(vk::PipelineStageFlags2::ALL_COMMANDS);
        let signals: Vec<_> = before.iter().map(all).collect();
        let submits = [vk::SubmitInfo2::default()
            .command_buffer_infos(&infos)
            .wait_semaphore_infos(&waits)
            .signal_semaphore_infos(&signals)];
        let queue = self.device.queue.lock().unwrap_or_else(|e| e.into_inner());
        // SAFETY: the fence is unsignalled and free, the queue is locked, and the buffer is recorded to its end.
        unsafe { self.device.raw.queue_submit2(*queue, &submits, self.fence) }
            .map_err(self.device.error("submitting"))?;
        self.under_way = true;
        Ok(())
    }

    /// Waits until the device has done the last submission, if there is one.
    pub fn wait(&mut self) -> Result<()> {
        if !self.under_way {
            return Ok(());
        }
        let raw = &self.device.raw;
        // SAFETY: the fence belongs to this submission, which nothing else waits for or resets.
        unsafe {
            raw.wait_for_fences(&[self.fence], true, u64::MAX)
                .and_then(|()| raw.reset_fences(&[self.fence]))
        }
        .map_err(self.device.error("waiting for a submission"))?;
        self.under_way = false;
        Ok(())
    }

    pub fn copy(&self, from: &Buffer, from_offset: u64, to: &Buffer, to_offset: u64, bytes: u64) {
        assert!(from_offset + bytes <= from.bytes() && to_offset + bytes <= to.bytes());
        if bytes == 0 {
            return;
        }
        let regions = [vk::BufferCopy {
            src_offset: from_offset,
            dst_offset: to_offset,
            size: bytes,
        }];
        // SAFETY: the ranges lie within the buffers.
        unsafe {
            self.device
                .raw
                .cmd_copy_buffer(self.raw, from.raw, to.raw, &regions);
        }
    }

    /// Fills a whole buffer with a repeated word.
    pub fn fill(&self, buffer: &Buffer, word: u32) {
        // SAFETY: the buffer takes transfers.
        unsafe {
            self.device
                .raw
                .cmd_fill_buffer(self.raw, buffer.raw, 0, vk::WHOLE_SIZE, word);
        }
    }

    /// Everything of the kinds `before` is done and seen before anything of the kinds `after` starts.
    pub fn barrier(&self, before: &[Stage], after: &[Stage]) {
        let join = |stages: &[Stage]| {
            stages.iter().fold(
                (vk::PipelineStageFlags2::empty(), vk::AccessFlags2::empty()),
                |(s, a), stage| (s | stage.masks().0, a | stage.masks().1),
            )
        };
        let (src_stage, src_access) = join(before);
        let (dst_stage, dst_access) = join(after);
        let barriers = [vk::MemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)];
        let info = vk::DependencyInfo::default().memory_barriers(&barriers);
        // SAFETY: outside a render pass, where the callers of the passes stand.
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw, &info) };
    }

    pub fn dispatch<T: Pod>(
        &self,
        pipeline: &ComputePipeline,
        set: &DescriptorSet,
        push: &T,
        groups: [u32; 3],
    ) {
        if groups.contains(&0) {
            return;
        }
        self.bind_compute(pipeline, set, push);
        // SAFETY: a pipeline with its set and constants is bound.
        unsafe {
            self.device
                .raw
                .cmd_dispatch(self.raw, groups[0], groups[1], groups[2]);
        }
    }

    /// A dispatch of as many groups as the device has written at byte `offset` of `counts`.
    pub fn dispatch_indirect<T: Pod>(
        &self,
        pipeline: &ComputePipeline,
        set: &DescriptorSet,
        push: &T,
        (counts, offset): (&Buffer, u64),
    ) {
        self.bind_compute(pipeline, set, push);
        // SAFETY: as above; the command lies within the buffer and was written by a pass of this crate.
        unsafe {
            self.device
                .raw
                .cmd_dispatch_indirect(self.raw, counts.raw, offset);
        }
    }

    fn bind_compute<T: Pod>(&self, pipeline: &ComputePipeline, set: &DescriptorSet, push: &T) {
        let bytes = bytemuck::bytes_of(push);
        assert_eq!(
            bytes.len(),
            pipeline.push_bytes as usize,
            "push constants of the pipeline's size"
        );
        let raw = &self.device.raw;
        // SAFETY: pipeline, set and constants fit one another by construction of the pass.
        unsafe {
            raw.cmd_bind_pipeline(self.raw, vk::PipelineBindPoint::COMPUTE, pipeline.raw);
            raw.cmd_bind_descriptor_sets(
                self.raw,
                vk::PipelineBindPoint::COMPUTE,
                pipeline.layout,
                0,
                &[set.raw],
                &[],
            );
            if !bytes.is_empty() {
                raw.cmd_push_constants(
                    self.raw,
                    pipeline.layout,
                    vk::ShaderStageFlags::COMPUTE,
                    0,
                    bytes,
                );
            }
        }
    }

    /// Begins a render pass over the whole framebuffer: colour cleared to `clear` (a word a channel), depth to 0.
    pub fn begin_render_pass(&self, pass: &RenderPass, target: &Framebuffer, clear: [u32; 4]) {
        let clears = [
            vk::ClearValue {
                color: vk::ClearColorValue { uint32: clear },
            },
            vk::ClearValue {
                depth_stencil: vk::ClearDepthStencilValue {
                    depth: 0.0,
                    stencil: 0,
                },
            },
        ];
        let info = vk::RenderPassBeginInfo::default()
            .render_pass(pass.raw)
            .framebuffer(target.raw)
            .render_area(vk::Rect2D {
                offset: vk::Offset2D::default(),
                extent: vk::Extent2D {
                    width: target.width,
                    height: target.height,
                },
            })
            .clear_values(&clears);
        // SAFETY: the framebuffer was made for a pass of these attachments.
        unsafe {
            self.device
                .raw
                .cmd_begin_render_pass(self.raw, &info, vk::SubpassContents::INLINE);
        }
    }

    pub fn end_render_pass(&self) {
        // SAFETY: closes `begin_render_pass`.
        unsafe { self.device.raw.cmd_end_render_pass(self.raw) };
    }

    pub fn bind_graphics(
        &self,
        pipeline: &GraphicsPipeline,
        set: &DescriptorSet,
        vertices: &Buffer,
    ) {
        let raw = &self.device.raw;
        // SAFETY: pipeline, set and vertices fit one another by construction of the pass.
        unsafe {
            raw.cmd_bind_pipeline(self.raw, vk::PipelineBindPoint::GRAPHICS, pipeline.raw);
            raw.cmd_bind_descriptor_sets(
                self.raw,
                vk::PipelineBindPoint::GRAPHICS,
                pipeline.layout,
                0,
                &[set.raw],
                &[],
            );
            raw.cmd_bind_vertex_buffers(self.raw, 0, &[vertices.raw], &[0]);
        }
    }

    pub fn bind_indices(&self, indices: &Buffer) {
        // SAFETY: the buffer is a geometry buffer of u32.
        unsafe {
            self.device
                .raw
                .cmd_bind_index_buffer(self.raw, indices.raw, 0, vk::IndexType::UINT32);
        }
    }

    pub fn viewport(&self, x: u32, y: u32, width: u32, height: u32) {
        let viewports = [vk::Viewport {
            x: x as f32,
            y: y as f32,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        let scissors = [vk::Rect2D {
            offset: vk::Offset2D {
                x: x as i32,
                y: y as i32,
            },
            extent: vk::Extent2D { width, height },
        }];
        // SAFETY: viewport and scissor are dynamic in every pipeline of this crate.
        unsafe {
            self.device.raw.cmd_set_viewport(self.raw, 0, &viewports);
            self.device.raw.cmd_set_scissor(self.raw, 0, &scissors);
        }
    }

    /// What is drawn next is cut to this rectangle of the framebuffer.
    pub fn scissor(&self, x: u32, y: u32, width: u32, height: u32) {
        let scissors = [vk::Rect2D {
            offset: vk::Offset2D {
                x: x as i32,
                y: y as i32,
            },
            extent: vk::Extent2D { width, height },
        }];
        // SAFETY: the scissor is dynamic in every pipeline of this crate.
        unsafe { self.device.raw.cmd_set_scissor(self.raw, 0, &scissors) };
    }

    pub fn push_graphics<T: Pod>(&self, pipeline: &GraphicsPipeline, push: &T) {
        let bytes = bytemuck::bytes_of(push);
        assert_eq!(
            bytes.len(),
            pipeline.push_bytes as usize,
            "push constants of the pipeline's size"
        );
        // SAFETY: the constants fit the pipeline's range.
        unsafe {
            self.device.raw.cmd_push_constants(
                self.raw,
                pipeline.layout,
                GRAPHICS_STAGES,
                0,
                bytes,
            );
        }
    }

    /// Draws one `VkDrawIndexedIndirectCommand` read at byte `offset`.
    pub fn draw_indexed_indirect(&self, draws: &Buffer, offset: u64) {
        // SAFETY: the command lies within the buffer and was written by a pass of this crate.
        unsafe {
            self.device
                .raw
                .cmd_draw_indexed_indirect(self.raw, draws.raw, offset, 1, 20);
        }
    }

    pub fn draw_indexed(&self, first_index: u32, index_count: u32) {
        // SAFETY: the range lies within the bound indices.
        unsafe {
            self.device
                .raw
                .cmd_draw_indexed(self.raw, index_count, 1, first_index, 0, 0);
        }
    }

    /// Copies a rectangle of an image that a render pass left for copies, `bytes_per_texel` apart, rows packed.
    pub fn copy_image_to_buffer(&self, image: &Image, to: &Buffer) {
        let regions = [whole(image)];
        // SAFETY: the render pass left the image in this layout, and the buffer holds its texels.
        unsafe {
            self.device.raw.cmd_copy_image_to_buffer(
                self.raw,
                image.raw,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                to.raw,
                &regions,
            );
        }
    }

    /// Copies an image that a render pass left for shaders, and gives it back to them.
    pub fn copy_shader_image_to_buffer(&self, image: &Image, to: &Buffer) {
        use vk::ImageLayout as L;
        self.transition(image, L::SHADER_READ_ONLY_OPTIMAL, L::TRANSFER_SRC_OPTIMAL);
        self.copy_image_to_buffer(image, to);
        self.transition(image, L::TRANSFER_SRC_OPTIMAL, L::SHADER_READ_ONLY_OPTIMAL);
    }

    /// Fills a texture from tightly packed rows, its levels of detail one after another from the largest, and makes it
    /// readable by shaders.
    pub fn upload_texture(&self, from: &Buffer, image: &Image, bytes_per_texel: u64) {
        use vk::ImageLayout as L;
        self.transition(image, L::UNDEFINED, L::TRANSFER_DST_OPTIMAL);
        let mut offset = 0;
        let regions: Vec<_> = (0..image.mip_levels)
            .map(|level| {
                let mut region = whole(image).buffer_offset(offset);
                region.image_subresource.mip_level = level;
                region.image_extent.width = (image.width >> level).max(1);
                region.image_extent.height = (image.height >> level).max(1);
                let texels =
                    u64::from(region.image_extent.width) * u64::from(region.image_extent.height);
                offset += texels * bytes_per_texel;
                region
            })
            .collect();
        assert!(offset <= from.bytes(), "the buffer holds every level");
        // SAFETY: the image was just brought to this layout, and the buffer holds its texels.
        unsafe {
            self.device.raw.cmd_copy_buffer_to_image(
                self.raw,
                from.raw,
                image.raw,
                L::TRANSFER_DST_OPTIMAL,
                &regions,
            );
        }
        self.transition(image, L::TRANSFER_DST_OPTIMAL, L::SHADER_READ_ONLY_OPTIMAL);
    }

    fn transition(&self, image: &Image, old: vk::ImageLayout, new: vk::ImageLayout) {
        let barriers = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(old)
            .new_layout(new)
            .image(image.raw)
            .subresource_range(
                vk::ImageSubresourceRange::default()
                    .aspect_mask(vk::ImageAspectFlags::COLOR)
                    .level_count(image.mip_levels)
                    .layer_count(1),
            )];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barriers);
        // SAFETY: the image is in the layout `old` here, or its content may be lost (undefined).
        unsafe { self.device.raw.cmd_pipeline_barrier2(self.raw, &info) };
    }

    /// Writes timestamp `index` when everything before it is done.
    pub fn timestamp(&self, timestamps: &Timestamps, index: u32) {
        // SAFETY: the index lies within the pool, which `reset_timestamps` has reset.
        unsafe {
            self.device.raw.cmd_write_timestamp2(
                self.raw,
                vk::PipelineStageFlags2::ALL_COMMANDS,
                timestamps.raw,
                index,
            );
        }
    }

    pub fn reset_timestamps(&self, timestamps: &Timestamps) {
        // SAFETY: the range is the whole pool.
        unsafe {
            self.device
                .raw
                .cmd_reset_query_pool(self.raw, timestamps.raw, 0, timestamps.count);
        }
    }
}

fn whole(image: &Image) -> vk::BufferImageCopy {
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

impl Drop for Commands {
    fn drop(&mut self) {
        // An error on the way may leave a submission under way; nothing is freed before it is done. Its own fence is waited
        // for and not the device, which would need every other thread to keep off the queue.
        let _ = self.wait();
        // SAFETY: nothing recorded here is under way.
        unsafe {
            self.device.raw.destroy_fence(self.fence, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}
