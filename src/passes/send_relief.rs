//! What the chosen sources with a relief send by direction: the paper's equation (3). Shader: `send_relief.comp`; twin:
//! [`crate::reference::send_relief`].

use std::ops::Range;
use std::sync::Arc;

use super::buffers::SceneBuffers;
use super::relief_buffers::ReliefBuffers;
use super::shaders;
use crate::error::Result;
use crate::vk::{Bind, Buffer, Commands, ComputePipeline, DescriptorSet, Device};

pub struct SendRelief {
    pipeline: ComputePipeline,
}

impl SendRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(
                device,
                "send relief",
                shaders::SEND_RELIEF_COMP,
                15,
                32,
            )?,
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
            &[
                slots,
                &scene.sources,
                &scene.planes,
                &scene.areas,
                &relief.elements,
                &relief.matrices,
                &relief.emissions,
                &relief.shares,
                &relief.moments_direct,
                &relief.moments_indirect,
                &relief.shot_exits,
                &relief.member_exits,
                &relief.exits,
                &relief.dark_slots,
                &relief.outgoing,
            ]
            .map(Bind::Buffer),
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
        let [columns, rows] = relief.cells();
        let parameters = [
            relief.first_source,
            relief.source_count,
            relief.first_element,
            relief.most_members,
            columns,
            rows,
            u32::from(relief.by_pixel),
            slots.start,
        ];
        let size = [slots.end - slots.start, 1, 1];
        cmd.dispatch(&self.pipeline, set, &parameters, size);
    }
}
