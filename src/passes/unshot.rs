//! The power that each patch has reflected and not sent yet. Shader: `unshot.comp`; twin:
//! [`crate::reference::paper`].

use std::sync::Arc;

use super::buffers::{SceneBuffers, filled};
use super::groups;
use super::shaders::unshot::{Bindings, Parameters, SHADER};
use super::shot_light::ShotLight;
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, Commands, ComputePipeline, Device};

pub struct Unshot {
    bound: BoundCompute,
    parameters: Parameters,
    /// RGB, internal units, `[source]`; none of lights without elements.
    pub powers: Buffer,
}

impl Unshot {
    pub fn new(device: &Arc<Device>, scene: &SceneBuffers, light: &ShotLight) -> Result<Self> {
        let powers = filled(device, "unshot", 12 * u64::from(scene.source_count), 0)?;
        let bindings = Bindings {
            sources: &scene.sources,
            reflectance: &scene.reflectance,
            received: &light.received,
            reflected: &light.reflected,
            sent: &light.sent,
            unshot: &powers,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "unshot", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                source_count: scene.source_count,
                first_relief: light.first_relief,
                unit: light.unit,
            },
            powers,
        })
    }

    pub fn record(&self, cmd: &Commands) {
        let size = [groups(self.parameters.source_count), 1, 1];
        cmd.dispatch(&self.bound, &self.parameters, size);
    }
}
