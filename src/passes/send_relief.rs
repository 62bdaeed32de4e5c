//! What the chosen sources with a relief send by direction: the paper's equation (3). Shader:
//! `send_relief.comp`; twin: [`crate::reference::send_relief`].

use std::ops::Range;
use std::sync::Arc;

use super::buffers::SceneBuffers;
use super::relief_buffers::ReliefBuffers;
use super::shaders::send_relief::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, Commands, ComputePipeline, Device};

pub struct SendRelief {
    bound: BoundCompute,
    parameters: Parameters,
}

impl SendRelief {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        slots: &Buffer,
        relief: &ReliefBuffers,
    ) -> Result<Self> {
        let bindings = Bindings {
            slots,
            sources: &scene.sources,
            planes: &scene.planes,
            element_area: &scene.areas,
            meso_elements: &relief.elements,
            matrices: &relief.matrices,
            emissions: &relief.emissions,
            direction_list: &relief.directions_list,
            coefficients: &relief.coefficients,
            shot_exits: &relief.shot_exits,
            member_exits: &relief.member_exits,
            exits: &relief.exits,
        };
        let directions = [relief.shape.directions.count() as u32];
        Ok(Self {
            bound: ComputePipeline::with_constants(device, "send relief", &SHADER, &directions)?
                .bind(&bindings)?,
            parameters: Parameters {
                first_source: relief.shape.first_source,
                source_count: relief.shape.source_count,
                first_element: relief.shape.first_element,
                most_members: relief.shape.most_members,
                cells: relief.shape.cells(),
                first_slot: 0,
            },
        })
    }

    /// For `slots`, no more than `relief.slots`; what they send is indexed from the first of them.
    pub fn record(&self, cmd: &Commands, slots: Range<u32>) {
        let parameters = Parameters {
            first_slot: slots.start,
            ..self.parameters
        };
        let size = [slots.end - slots.start, 1, 1];
        cmd.dispatch(&self.bound, &parameters, size);
    }
}
