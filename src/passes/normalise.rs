//! Scales form factors so that all that a source sends in an enclosed scene arrives. Shader: `normalise.comp`; twin:
//! [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::fresh_rows::FreshRows;
use super::shaders;
use crate::error::Result;
use crate::vk::{Bind, Commands, ComputePipeline, DescriptorSet, Device};

pub struct Normalise {
    pipeline: ComputePipeline,
}

impl Normalise {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::storage(device, "normalise", shaders::NORMALISE_COMP, 5, 8)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<DescriptorSet> {
        self.pipeline.bind(
            "normalise",
            &[
                &batch.slots,
                &scene.sources,
                &scene.areas,
                &rows.plain,
                &rows.meso,
            ]
            .map(Bind::Buffer),
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, batch: &Batch, rows: &FreshRows) {
        let counts = [rows.shape.plain_count, rows.shape.meso_count];
        cmd.dispatch(&self.pipeline, set, &counts, [batch.slot_count, 1, 1]);
    }
}
