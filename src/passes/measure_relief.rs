//! Radiosity that the sources with a relief reflect, after [`super::measure`]. Shader:
//! `measure_relief.comp`; its twin is [`crate::reference::measure`] with the reflected light in
//! place of reflectance times irradiance.

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::groups;
use super::relief_buffers::ReliefBuffers;
use super::shaders::measure_relief::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

pub struct MeasureRelief {
    bound: BoundCompute,
    parameters: Parameters,
}

impl MeasureRelief {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        relief: &ReliefBuffers,
    ) -> Result<Self> {
        let bindings = Bindings {
            sources: &scene.sources,
            element_area: &scene.areas,
            meso_reflected: &relief.reflected,
            source_reflected: &state.reflected,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "measure relief", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                first_source: relief.shape.first_source,
                source_count: relief.shape.source_count,
                first_element: relief.shape.first_element,
            },
        })
    }

    pub fn record(&self, cmd: &Commands) {
        let size = [groups(self.parameters.source_count), 1, 1];
        cmd.dispatch(&self.bound, &self.parameters, size);
    }
}
