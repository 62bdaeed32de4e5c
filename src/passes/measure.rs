//! Radiosity that every source reflects. Shader: `measure.comp`; twin:
//! [`crate::reference::measure`].

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::groups;
use super::shaders::measure::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{Commands, ComputePipeline, DescriptorSet, Device};

pub struct Measure {
    pipeline: ComputePipeline,
}

impl Measure {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "measure", &SHADER)?,
        })
    }

    pub fn bind(&self, scene: &SceneBuffers, state: &State) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "measure",
            &Bindings {
                sources: &scene.sources,
                reflectance: &scene.reflectance,
                element_area: &scene.areas,
                direct: &state.direct,
                indirect: &state.indirect,
                source_reflected: &state.reflected,
            },
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, source_count: u32) {
        cmd.dispatch(
            &self.pipeline,
            set,
            &Parameters { source_count },
            [groups(source_count), 1, 1],
        );
    }
}
