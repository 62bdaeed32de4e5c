//! Lists what was shot evenly, for elements with a relief to take it in by direction. Shader: `recall.comp`.

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

pub struct Recall {
    pipeline: ComputePipeline,
}

impl Recall {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(device, "recall", shaders::RECALL_COMP, 5, 16)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        relief: &ReliefBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "recall",
            &[
                &scene.sources,
                &state.kept_rows,
                &state.shot,
                &relief.recalled,
                &relief.shot_exits,
            ]
            .map(Bind::Buffer),
        )
    }

    pub fn record(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        scene: &SceneBuffers,
        relief: &ReliefBuffers,
    ) {
        let parameters = [
            scene.source_count,
            relief.first_source,
            relief.source_count,
            relief.directions.count() as u32,
        ];
        let size = [groups(scene.source_count), 1, 1];
        cmd.dispatch(&self.pipeline, set, &parameters, size);
    }
}
