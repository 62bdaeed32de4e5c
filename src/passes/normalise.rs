//! Scales form factors so that all that a source sends in an enclosed scene arrives. Shader:
//! `normalise.comp`; twin: [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::fresh_rows::FreshRows;
use super::shaders::normalise::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{Commands, ComputePipeline, DescriptorSet, Device};

pub struct Normalise {
    pipeline: ComputePipeline,
}

impl Normalise {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "normalise", &SHADER)?,
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
            &Bindings {
                slots: &batch.slots,
                sources: &scene.sources,
                element_area: &scene.areas,
                fresh: &rows.plain,
                fresh_meso: &rows.meso,
            },
        )
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, batch: &Batch, rows: &FreshRows) {
        let parameters = Parameters {
            plain_count: rows.shape.plain_count,
            meso_count: rows.shape.meso_count,
        };
        let size = [batch.slot_count, 1, 1];
        cmd.dispatch(&self.pipeline, set, &parameters, size);
    }
}
