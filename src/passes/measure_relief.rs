//! Radiosity that the sources with a relief reflect, after [`super::measure`]. Shader: `measure_relief.comp`; its twin is
//! [`crate::reference::measure`] with the reflected light for reflectance times irradiance.

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

pub struct MeasureRelief {
    pipeline: ComputePipeline,
}

impl MeasureRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(
                device,
                "measure relief",
                shaders::MEASURE_RELIEF_COMP,
                4,
                12,
            )?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        relief: &ReliefBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "measure relief",
            &[
                &scene.sources,
                &scene.areas,
                &relief.reflected,
                &state.reflected,
            ]
            .map(Bind::Buffer),
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, relief: &ReliefBuffers) {
        let parameters = [
            relief.first_source,
            relief.source_count,
            relief.first_element,
        ];
        cmd.dispatch(
            &self.pipeline,
            set,
            &parameters,
            [groups(relief.source_count), 1, 1],
        );
    }
}
