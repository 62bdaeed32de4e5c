//! What the chosen sources with a relief send by direction: the paper's equation (3). Shader:
//! `send_relief.comp`; twin: [`crate::reference::send_relief`].

use std::ops::Range;
use std::sync::Arc;

use super::buffers::SceneBuffers;
use super::relief_buffers::ReliefBuffers;
use super::shaders::send_relief::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{Buffer, Commands, ComputePipeline, DescriptorSet, Device};

pub struct SendRelief {
    pipeline: ComputePipeline,
}

impl SendRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "send relief", &SHADER)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        slots: &Buffer,
        relief: &ReliefBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "send relief",
            &Bindings {
                slots,
                sources: &scene.sources,
                planes: &scene.planes,
                element_area: &scene.areas,
                meso_elements: &relief.elements,
                matrices: &relief.matrices,
                emissions: &relief.emissions,
                shares: &relief.shares,
                moments_direct: &relief.moments_direct,
                moments_indirect: &relief.moments_indirect,
                shot_exits: &relief.shot_exits,
                member_exits: &relief.member_exits,
                exits: &relief.exits,
                dark_slots: &relief.dark_slots,
                outgoing: &relief.outgoing,
            },
        )
    }

    /// For `slots`, no more than `relief.slots`; what they send is indexed from the first of them.
    pub fn record(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        relief: &ReliefBuffers,
        slots: Range<u32>,
    ) {
        let parameters = Parameters {
            first_source: relief.first_source,
            source_count: relief.source_count,
            first_element: relief.first_element,
            most_members: relief.most_members,
            cells: relief.cells(),
            by_pixel: relief.by_pixel.into(),
            first_slot: slots.start,
        };
        let size = [slots.end - slots.start, 1, 1];
        cmd.dispatch(&self.pipeline, set, &parameters, size);
    }
}
