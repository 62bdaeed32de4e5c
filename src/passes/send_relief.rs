//! What the chosen sources with a relief send by direction: the paper's equation (3). Shader: `send_relief.comp`; twin:
//! [`crate::reference::send_relief`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::relief_buffers::ReliefBuffers;
use super::shaders;
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

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
                28,
            )?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        batch: &Batch,
        relief: &ReliefBuffers,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "send relief",
            &[
                &batch.slots,
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

    pub fn record(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        relief: &ReliefBuffers,
        batch: &Batch,
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
        ];
        cmd.dispatch(&self.pipeline, set, &parameters, [batch.all_slots(), 1, 1]);
    }
}
