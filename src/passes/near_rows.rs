//! Puts the form factors of near elements, which are found on the host, into fresh rows. Shaders:
//! `near_rows.comp`, `near_rows_relief.comp`: copies alone, that need no twin.

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{NearBuffers, SceneBuffers};
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::{near_rows, near_rows_relief};
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

/// To elements without relief, to those with one, or both.
pub struct NearRows {
    kinds: Vec<OfKind>,
}

struct OfKind {
    bound: BoundCompute,
    parameters: near_rows::Parameters,
    size: [u32; 3],
}

impl NearRows {
    /// Of no kind where no element is near a source.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<Self> {
        let shape = rows.shape;
        let of_kind = |near: &NearBuffers, bound, element_count, first_block| OfKind {
            bound,
            parameters: near_rows::Parameters {
                element_count,
                block_count: shape.blocks(),
                first_block,
            },
            size: [groups(near.most), batch.slot_count, 1],
        };
        let mut kinds = Vec::new();
        let near = &scene.near_rows;
        if near.most > 0 {
            let bindings = near_rows::Bindings {
                slots: &batch.slots,
                starts: &near.starts,
                factors: &near.factors,
                fresh: &rows.plain,
                occupied: &rows.occupied,
            };
            let pipeline = ComputePipeline::new(device, "near rows", &near_rows::SHADER)?;
            let bound = pipeline.bind(&bindings)?;
            kinds.push(of_kind(near, bound, shape.plain.count, 0));
        }
        let near = &scene.near_relief_rows;
        if near.most > 0 {
            let bindings = near_rows_relief::Bindings {
                slots: &batch.slots,
                starts: &near.starts,
                factors: &near.factors,
                fresh: &rows.meso,
                occupied: &rows.occupied,
            };
            let shader = &near_rows_relief::SHADER;
            let bound =
                ComputePipeline::new(device, "near rows to relief", shader)?.bind(&bindings)?;
            kinds.push(of_kind(near, bound, shape.meso.count, shape.plain_blocks()));
        }
        Ok(Self { kinds })
    }

    pub fn record(&self, cmd: &Commands) {
        for kind in &self.kinds {
            cmd.dispatch(&kind.bound, &kind.parameters, kind.size);
        }
    }
}
