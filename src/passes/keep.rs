//! Keeps the rows of a batch. Shaders: `allocate.comp`, `keep.comp`; the codes' twin:
//! [`crate::reference::kept`].

use std::sync::Arc;

use super::fresh_rows::FreshRows;
use super::kept_rows::KeptRows;
use super::shaders::{allocate, keep};
use super::types::KeptRow;
use crate::constants::KEEP_BLOCKS;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage};

pub struct Keep {
    allocate: ComputePipeline,
    keep: ComputePipeline,
}

/// Where the rows of a batch have been put.
pub struct Bound {
    allocate: DescriptorSet,
    keep: DescriptorSet,
    /// [`KeptRow`], `[slot]`.
    pub rows: Buffer,
    slot_count: u32,
}

impl Keep {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let lanes = [device.limits().subgroup_size];
        Ok(Self {
            allocate: ComputePipeline::new(device, "allocate", &allocate::SHADER)?,
            keep: ComputePipeline::in_subgroups(device, "keep", &keep::SHADER, &lanes)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        slots: &Buffer,
        slot_count: u32,
        fresh: &FreshRows,
        kept: &KeptRows,
    ) -> Result<Bound> {
        let bytes = u64::from(slot_count) * size_of::<KeptRow>() as u64;
        let rows = Buffer::new(device, "rows of a batch", bytes, BufferUse::Storage)?;
        let allocate = allocate::Bindings {
            slots,
            occupied: &fresh.occupied,
            rows: &rows,
            chunks: &kept.table,
            state: &kept.state,
        };
        let keep = keep::Bindings {
            slots,
            rows: &rows,
            chunks: &kept.table,
            fresh: &fresh.plain,
            fresh_meso: &fresh.meso,
        };
        Ok(Bound {
            allocate: self.allocate.bind("allocate", &allocate)?,
            keep: self.keep.bind("keep", &keep)?,
            rows,
            slot_count,
        })
    }

    /// `scratch`: which of the [`super::kept_rows::SCRATCH`] chunks takes the rows without room.
    pub fn record(&self, cmd: &Commands, bound: &Bound, kept: &KeptRows, scratch: u32) {
        let shape = kept.shape;
        let allocate = allocate::Parameters {
            slot_count: bound.slot_count,
            block_count: shape.blocks(),
            meso_blocks: shape.meso_blocks(),
            chunk_count: kept.chunk_count(),
            chunk_words: kept.chunk_words,
            scratch_chunk: kept.chunk_count() + scratch,
        };
        cmd.dispatch(&self.allocate, &bound.allocate, &allocate, [1, 1, 1]);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let keep = keep::Parameters {
            plain_count: shape.plain_count,
            plain_blocks: shape.plain_blocks(),
            meso_count: shape.meso_count,
            block_count: shape.blocks(),
        };
        let size = [shape.blocks().div_ceil(KEEP_BLOCKS), bound.slot_count, 1];
        cmd.dispatch(&self.keep, &bound.keep, &keep, size);
    }
}
