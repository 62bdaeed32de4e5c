//! Render passes and draws.

use std::ops::Range;

use ash::vk;

use super::Commands;
use crate::vk::graphics::GRAPHICS_STAGES;
use crate::vk::{
    Buffer, DescriptorSet, Framebuffer, GraphicsPipeline, RenderPass, ShaderParameters,
};

impl Commands {
    /// Begins a render pass over the whole framebuffer: colour cleared to `clear` (one word a
    /// channel), depth to 0.
    pub fn begin_render_pass(&self, pass: &RenderPass, target: &Framebuffer, clear: [u32; 4]) {
        let columns = 0..target.owner.width;
        self.begin_render_pass_in(pass, target, columns, clear);
    }

    /// The same over some columns of the framebuffer; nothing else may be drawn to.
    pub fn begin_render_pass_in(
        &self,
        pass: &RenderPass,
        target: &Framebuffer,
        columns: Range<u32>,
        clear: [u32; 4],
    ) {
        assert!(
            columns.end <= target.owner.width,
            "columns of the framebuffer"
        );
        let width = columns.end - columns.start;
        self.hold(&pass.owner);
        self.hold(&target.owner);
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
            .render_pass(pass.owner.raw)
            .framebuffer(target.owner.raw)
            .render_area(rectangle(columns.start, 0, width, target.owner.height))
            .clear_values(&clears);
        // SAFETY: the framebuffer was made for a render pass with these attachments.
        unsafe {
            self.device
                .raw
                .cmd_begin_render_pass(self.raw(), &info, vk::SubpassContents::INLINE);
        }
    }

    pub fn end_render_pass(&self) {
        // SAFETY: closes `begin_render_pass`.
        unsafe { self.device.raw.cmd_end_render_pass(self.raw()) };
    }

    pub fn bind_graphics(
        &self,
        pipeline: &GraphicsPipeline,
        set: &DescriptorSet,
        vertices: Option<&Buffer>,
    ) {
        let pipeline = &pipeline.owner;
        pipeline.check_set(&set.owner);
        self.hold(&set.owner);
        let raw = &self.device.raw;
        // SAFETY: the set is one of the pipeline, as checked; vertices match by construction of
        // the pass.
        unsafe {
            raw.cmd_bind_pipeline(self.raw(), vk::PipelineBindPoint::GRAPHICS, pipeline.raw);
            raw.cmd_bind_descriptor_sets(
                self.raw(),
                vk::PipelineBindPoint::GRAPHICS,
                pipeline.layout,
                0,
                &[set.owner.raw],
                &[],
            );
        }
        if let Some(vertices) = vertices {
            self.hold(&vertices.owner);
            // SAFETY: the buffer feeds vertices.
            unsafe { raw.cmd_bind_vertex_buffers(self.raw(), 0, &[vertices.owner.raw], &[0]) };
        }
    }

    pub fn bind_indices(&self, indices: &Buffer) {
        self.hold(&indices.owner);
        // SAFETY: the buffer feeds indices, of 32 bits each.
        unsafe {
            self.device.raw.cmd_bind_index_buffer(
                self.raw(),
                indices.owner.raw,
                0,
                vk::IndexType::UINT32,
            );
        }
    }

    /// Sets the viewport to a rectangle of the framebuffer, to which draws are clipped.
    pub fn viewport(&self, x: u32, y: u32, width: u32, height: u32) {
        let viewports = [vk::Viewport {
            x: x as f32,
            y: y as f32,
            width: width as f32,
            height: height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        // SAFETY: the viewport is dynamic in every pipeline of this crate.
        unsafe { self.device.raw.cmd_set_viewport(self.raw(), 0, &viewports) };
        self.scissor(x, y, width, height);
    }

    /// Clips the draws that follow to a rectangle of the framebuffer.
    pub fn scissor(&self, x: u32, y: u32, width: u32, height: u32) {
        let scissors = [rectangle(x, y, width, height)];
        // SAFETY: the scissor is dynamic in every pipeline of this crate.
        unsafe { self.device.raw.cmd_set_scissor(self.raw(), 0, &scissors) };
    }

    pub fn push_graphics<P: ShaderParameters>(&self, pipeline: &GraphicsPipeline, push: &P) {
        let pipeline = &pipeline.owner;
        let bytes = pipeline.push_constants(push);
        // SAFETY: the constants fit the pipeline's range; only its layout is used, while recording.
        unsafe {
            self.device.raw.cmd_push_constants(
                self.raw(),
                pipeline.layout,
                GRAPHICS_STAGES,
                0,
                bytes,
            );
        }
    }

    /// Draws one `VkDrawIndirectCommand` read at byte `offset`.
    pub fn draw_indirect(&self, draws: &Buffer, offset: u64) {
        self.hold(&draws.owner);
        // SAFETY: the command lies within the buffer and was written by a pass.
        unsafe {
            self.device
                .raw
                .cmd_draw_indirect(self.raw(), draws.owner.raw, offset, 1, 16);
        }
    }

    /// Draws without vertex and index buffers.
    pub fn draw(&self, vertex_count: u32) {
        // SAFETY: the bound pipeline reads no vertices.
        unsafe { self.device.raw.cmd_draw(self.raw(), vertex_count, 1, 0, 0) };
    }

    pub fn draw_indexed(&self, first_index: u32, index_count: u32) {
        // SAFETY: the range lies within the bound indices.
        unsafe {
            self.device
                .raw
                .cmd_draw_indexed(self.raw(), index_count, 1, first_index, 0, 0);
        }
    }
}

fn rectangle(x: u32, y: u32, width: u32, height: u32) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D {
            x: x as i32,
            y: y as i32,
        },
        extent: vk::Extent2D { width, height },
    }
}
