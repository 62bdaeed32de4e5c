//! Radiosity that every source reflects. Shader: `measure.comp`; twin: [`crate::reference::measure`].

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

pub struct Measure {
    pipeline: ComputePipeline,
}

impl Measure {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(device, "measure", shaders::MEASURE_COMP, 6, 4)?,
        })
    }

    pub fn bind(&self, scene: &SceneBuffers, state: &State) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "measure",
            &[
                &scene.sources,
                &scene.reflectance,
                &scene.areas,
                &state.direct,
                &state.indirect,
                &state.reflected,
            ]
            .map(Bind::Buffer),
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, source_count: u32) {
        cmd.dispatch(
            &self.pipeline,
            set,
            &source_count,
            [groups(source_count), 1, 1],
        );
    }
}
