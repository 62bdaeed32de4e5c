//! What the chosen patches shoot, by direction where they have a relief. Shader: `shoot.comp`;
//! twin: [`crate::reference::paper`].

use std::sync::Arc;

use super::buffers::SceneBuffers;
use super::shaders::shoot::{Bindings, Parameters, SHADER};
use super::shot_light::ShotLight;
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, Commands, ComputePipeline, Device};

pub struct Shoot {
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
}

impl Shoot {
    /// From `slots`, [`super::types::Slot`].
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        light: &ShotLight,
        slots: &Buffer,
        slot_count: u32,
    ) -> Result<Self> {
        let bindings = Bindings {
            slots,
            sources: &scene.sources,
            reflectance: &scene.reflectance,
            received: &light.received,
            reflected: &light.reflected,
            hidden: &light.hidden,
            patches: &light.patches,
            sent: &light.sent,
            sent_by: &light.sent_by,
            shots: &light.shots,
            exits: &light.exits,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "shoot", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                first_relief: light.first_relief,
                directions: light.directions.count() as u32,
                unit: light.unit,
            },
            slot_count,
        })
    }

    pub fn record(&self, cmd: &Commands) {
        cmd.dispatch(&self.bound, &self.parameters, [self.slot_count, 1, 1]);
    }
}
