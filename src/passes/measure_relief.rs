//! Radiosity that the sources with a relief reflect, after [`super::measure`]. Shader:
//! `measure_relief.comp`; its twin is [`crate::reference::measure`] with the reflected light in
//! place of reflectance times irradiance.

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::groups;
use super::relief_buffers::ReliefBuffers;
use super::shaders::measure_relief::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{Commands, ComputePipeline, DescriptorSet, Device};

pub struct MeasureRelief {
    pipeline: ComputePipeline,
}

impl MeasureRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "measure relief", &SHADER)?,
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
            &Bindings {
                sources: &scene.sources,
                element_area: &scene.areas,
                meso_reflected: &relief.reflected,
                source_reflected: &state.reflected,
            },
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, relief: &ReliefBuffers) {
        let parameters = Parameters {
            first_source: relief.first_source,
            source_count: relief.source_count,
            first_element: relief.first_element,
        };
        cmd.dispatch(
            &self.pipeline,
            set,
            &parameters,
            [groups(relief.source_count), 1, 1],
        );
    }
}
