//! Puts the form factors of near elements, which are found on the host, into fresh rows. Shader:
//! `near_rows.comp`.

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::near_rows::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

pub struct NearRows {
    bound: BoundCompute,
    parameters: Parameters,
    size: [u32; 3],
}

impl NearRows {
    /// None where no element is near a source.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<Option<Self>> {
        if scene.most_near == 0 {
            return Ok(None);
        }
        let bindings = Bindings {
            slots: &batch.slots,
            starts: &scene.near_starts,
            factors: &scene.near_factors,
            fresh: &rows.plain,
            occupied: &rows.occupied,
        };
        Ok(Some(Self {
            bound: ComputePipeline::new(device, "near rows", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                plain_count: rows.shape.plain_count,
                block_count: rows.shape.blocks(),
            },
            size: [groups(scene.most_near), batch.slot_count, 1],
        }))
    }

    pub fn record(&self, cmd: &Commands) {
        cmd.dispatch(&self.bound, &self.parameters, self.size);
    }
}
