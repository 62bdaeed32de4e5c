//! Chooses the sources of a batch. Shader: `select.comp`; twin: [`crate::reference::select`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::{SceneBuffers, State};
use super::shaders;
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

pub struct Select {
    pipeline: ComputePipeline,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Parameters {
    pub source_count: u32,
    /// For sources that are drawn; those for kept ones follow.
    pub fresh_slots: u32,
    pub replay_slots: u32,
    /// Shots at most, from the start.
    pub shot_limit: u32,
    /// No more shots once all emission is shot and this much reflected power is unshot, internal units.
    pub stop_power: f32,
    /// Above 0: chooses only sources whose emission is unshot and has this power, internal units, and replays none.
    pub least_emitted: f32,
}

impl Select {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(
                device,
                "select",
                shaders::SELECT_COMP,
                8,
                size_of::<Parameters>(),
            )?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "select",
            &[
                &scene.sources,
                &state.shot,
                &state.unshot,
                &batch.slots,
                &state.progress,
                &state.kept_rows,
                &batch.drawn_commands,
                &batch.emitting_commands,
            ]
            .map(Bind::Buffer),
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, parameters: &Parameters) {
        cmd.dispatch(&self.pipeline, set, parameters, [1, 1, 1]);
    }
}
