//! Scales form factors so that all that a source sends in an enclosed scene arrives. Shader:
//! `normalise.comp`; twin: [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::fresh_rows::FreshRows;
use super::shaders::normalise::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

pub struct Normalise {
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
}

impl Normalise {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<Self> {
        let bindings = Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            element_area: &scene.areas,
            fresh: &rows.plain,
            fresh_meso: &rows.meso,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "normalise", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                plain_count: rows.shape.plain_count,
                meso_count: rows.shape.meso_count,
            },
            slot_count: batch.slot_count,
        })
    }

    pub fn record(&self, cmd: &Commands) {
        cmd.dispatch(&self.bound, &self.parameters, [self.slot_count, 1, 1]);
    }
}
