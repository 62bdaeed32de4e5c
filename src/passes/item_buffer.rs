//! Draws the hemicubes of a batch: five faces a source as element IDs. Shaders: `item_buffer.vert`,
//! `.frag`; twin: [`crate::reference::item_buffer`].

use std::ops::Range;
use std::sync::Arc;

use glam::Vec2;

use super::batch::DrawLists;
use super::buffers::SceneBuffers;
use super::cull::Cull;
use super::shaders::item_buffer::{Bindings, Parameters, SHADER};
use super::types::Draw;
use crate::constants::{FACES, NONE};
use crate::error::Result;
use crate::math::hemicube::{face_rectangle, pixel_count};
use crate::vk::{
    Attachment, Blending, Commands, DescriptorSet, Device, Format, GraphicsPipeline, GraphicsState,
    RenderPass, Sides, Stage,
};

pub struct ItemBuffer {
    pub pass: RenderPass,
    /// For the parts after the first.
    further: RenderPass,
    pipeline: GraphicsPipeline,
}

/// Distance of the near plane, internal units: nearer than any two surfaces that are not one.
const NEAR: f32 = 1e-6;

/// Pixels and occluders of a part of a submission, at most: 0.1 to 0.3 s by lavapipe's two cores.
const PART: u32 = 1 << 19;

impl ItemBuffer {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let items = Attachment::read_by_shaders(Format::R32_UINT);
        let [pass, further] = RenderPass::in_parts(device, "item buffer", items)?;
        let pipeline = GraphicsPipeline::new(
            device,
            &pass,
            &GraphicsState {
                name: "item buffer",
                shaders: &SHADER,
                constants: &[],
                vertex_stride: 0,
                attributes: &[],
                blending: Blending::Nearest,
                sides: Sides::Both,
            },
        )?;
        Ok(Self {
            pass,
            further,
            pipeline,
        })
    }

    pub fn bind(&self, scene: &SceneBuffers, lists: &DrawLists) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "item buffer",
            &Bindings {
                views: &lists.views,
                drawn_items: &lists.drawn_items,
                drawn_corners: &lists.drawn_corners,
                vertices: &scene.vertices,
            },
        )
    }

    /// Culls and draws the hemicubes of a batch, in as many parts as the lists of `cull` need.
    /// `listed` is recorded when the first are full.
    pub fn record(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        cull: &Cull,
        lists: &DrawLists,
        listed: impl FnOnce(),
    ) {
        cull.record(cmd, 0);
        cmd.barrier(&[Stage::Compute], &[Stage::Draw]);
        listed();
        self.draw(cmd, set, lists, &self.pass);
        for part in 1..lists.parts {
            cmd.barrier(&[Stage::Draw], &[Stage::Compute]);
            cull.record(cmd, part);
            cmd.barrier(&[Stage::Compute], &[Stage::Draw]);
            self.draw(cmd, set, lists, &self.further);
        }
    }

    /// Draws all slots, some of them in each part of the submission.
    fn draw(&self, cmd: &Commands, set: &DescriptorSet, lists: &DrawLists, pass: &RenderPass) {
        let (slot_count, face_size) = (lists.slot_count, lists.face_size);
        let work = pixel_count(face_size) as u32 + lists.room;
        let at_once = (PART / work).max(1);
        for first in (0..slot_count).step_by(at_once as usize) {
            let slots = first..(first + at_once).min(slot_count);
            cmd.part();
            if first > 0 {
                cmd.barrier(&[Stage::Draw], &[Stage::Draw]);
            }
            // The first pass clears all slots.
            let (pass, columns) = match first {
                0 => (pass, 0..slot_count * face_size),
                _ => (
                    &self.further,
                    slots.start * face_size..slots.end * face_size,
                ),
            };
            cmd.begin_render_pass_in(pass, &lists.framebuffer, columns, [NONE; 4]);
            self.draw_slots(cmd, set, lists, slots);
            cmd.end_render_pass();
        }
    }

    fn draw_slots(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        lists: &DrawLists,
        slots: Range<u32>,
    ) {
        let face_size = lists.face_size;
        cmd.bind_graphics(&self.pipeline, set, None);
        for slot in slots {
            for face in 0..FACES {
                let [x, y, width, height] = face_rectangle(face, face_size);
                let region = slot * FACES + face;
                cmd.viewport(slot * face_size + x, y, width, height);
                cmd.push_graphics(
                    &self.pipeline,
                    &Parameters {
                        region,
                        near: NEAR,
                        half_size: Vec2::new(width as f32, height as f32) / 2.0,
                    },
                );
                cmd.draw_indirect(&lists.draws, u64::from(region) * size_of::<Draw>() as u64);
            }
        }
    }
}
