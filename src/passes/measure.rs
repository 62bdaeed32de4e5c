//! Radiosity that every source reflects. Shader: `measure.comp`; twin:
//! [`crate::reference::measure`].

use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::groups;
use super::shaders::measure::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

pub struct Measure {
    bound: BoundCompute,
    parameters: Parameters,
}

impl Measure {
    pub fn new(device: &Arc<Device>, scene: &SceneBuffers, state: &State) -> Result<Self> {
        let bindings = Bindings {
            sources: &scene.sources,
            reflectance: &scene.reflectance,
            weights: &scene.weights,
            direct: &state.direct,
            indirect: &state.indirect,
            source_reflected: &state.reflected,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "measure", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                source_count: scene.source_count,
            },
        })
    }

    pub fn record(&self, cmd: &Commands) {
        let size = [groups(self.parameters.source_count), 1, 1];
        cmd.dispatch(&self.bound, &self.parameters, size);
    }
}
