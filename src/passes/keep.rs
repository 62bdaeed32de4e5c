//! Keeps the form factors of drawn sources, so that their further shots need no drawing. Shaders: `allocate.comp`, `keep.comp`;
//! the codes' twin: [`crate::reference::kept`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::State;
use super::factor_buffers::FactorBuffers;
use super::shaders;
use crate::constants::KEEP_BLOCKS;
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device, Stage};

pub struct Keep {
    allocate: ComputePipeline,
    keep: ComputePipeline,
}

/// Sets of [`Keep`].
pub struct Sets {
    allocate: DescriptorSet,
    keep: DescriptorSet,
}

impl Keep {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let make = |name, spirv, buffers, words: usize| {
            ComputePipeline::storage(device, name, spirv, buffers, 4 * words)
        };
        Ok(Self {
            allocate: make("allocate", shaders::ALLOCATE_COMP, 6, 5)?,
            keep: ComputePipeline::new(
                device,
                "keep",
                shaders::KEEP_COMP,
                &[Binding::Storage; 5],
                4 * 4,
                &[device.limits().subgroup_size],
                true,
            )?,
        })
    }

    pub fn bind(&self, state: &State, batch: &Batch, factors: &FactorBuffers) -> Result<Sets> {
        let allocate = [
            &batch.slots,
            &factors.occupied,
            &state.kept_rows,
            &factors.table,
            &factors.state,
            &batch.loose_command,
        ];
        let keep = [
            &batch.slots,
            &state.kept_rows,
            &factors.table,
            &factors.fresh,
            &factors.fresh_meso,
        ];
        Ok(Sets {
            allocate: self
                .allocate
                .bind("allocate", &allocate.map(Bind::Buffer))?,
            keep: self.keep.bind("keep", &keep.map(Bind::Buffer))?,
        })
    }

    pub fn record(&self, cmd: &Commands, sets: &Sets, batch: &Batch, factors: &FactorBuffers) {
        let allocate = [
            batch.slot_count,
            factors.blocks(),
            factors.meso_blocks(),
            factors.chunk_count(),
            factors.chunk_words,
        ];
        cmd.dispatch(&self.allocate, &sets.allocate, &allocate, [1, 1, 1]);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let keep = [
            factors.plain_count,
            factors.plain_blocks(),
            factors.meso_count,
            factors.blocks(),
        ];
        let size = [factors.blocks().div_ceil(KEEP_BLOCKS), batch.slot_count, 1];
        cmd.dispatch(&self.keep, &sets.keep, &keep, size);
    }
}
