//! Keeps the rows of a batch. Shaders: `allocate.comp`, `keep.comp`; the codes' twin:
//! [`crate::math::kept`].

use std::sync::Arc;

use super::by_slots;
use super::fresh_rows::FreshRows;
use super::kept_rows::KeptRows;
use super::shaders::{allocate, keep};
use super::types::{KeptRow, Slot};
use crate::constants::KEEP_BLOCKS;
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device, Stage};

pub struct Keep {
    allocate: BoundCompute,
    keep: BoundCompute,
    fresh: FreshRows,
    first: allocate::Parameters,
    then: keep::Parameters,
    /// Where the rows of a batch have been put: [`KeptRow`], `[slot]`.
    pub rows: Buffer,
}

impl Keep {
    /// For the rows of the first `slot_count` slots.
    pub fn new(
        device: &Arc<Device>,
        slots: &Buffer,
        slot_count: u32,
        fresh: &FreshRows,
        kept: &KeptRows,
    ) -> Result<Self> {
        let slot_bytes = u64::from(slot_count) * size_of::<Slot>() as u64;
        assert!(
            slots.bytes() >= slot_bytes && slot_count <= fresh.slot_count,
            "each slot is there and has a fresh row"
        );
        let bytes = u64::from(slot_count) * size_of::<KeptRow>() as u64;
        let rows = Buffer::new(device, "rows of a batch", bytes, BufferUse::Storage)?;
        let lanes = [device.limits().subgroup_size];
        let allocate = ComputePipeline::new(device, "allocate", &allocate::SHADER)?;
        let keep = ComputePipeline::in_subgroups(device, "keep", &keep::SHADER, &lanes)?;
        let shape = kept.shape;
        Ok(Self {
            allocate: allocate.bind(&allocate::Bindings {
                slots,
                occupied: &fresh.occupied,
                rows: &rows,
                chunks: &kept.table,
                state: &kept.state,
            })?,
            keep: keep.bind(&keep::Bindings {
                slots,
                rows: &rows,
                chunks: &kept.table,
                fresh: &fresh.plain,
                fresh_meso: &fresh.meso,
            })?,
            fresh: fresh.clone(),
            first: allocate::Parameters {
                slot_count,
                block_count: shape.blocks(),
                meso_blocks: shape.meso_blocks(),
                chunk_count: kept.chunk_count(),
                chunk_words: kept.chunk_words,
                scratch_chunk: kept.chunk_count(),
            },
            then: keep::Parameters {
                plain_count: shape.plain.count,
                plain_blocks: shape.plain_blocks(),
                meso_count: shape.meso.count,
                block_count: shape.blocks(),
            },
            rows,
        })
    }

    /// `scratch`: which of the [`super::kept_rows::SCRATCH`] chunks takes the rows without room.
    pub fn record(&self, cmd: &Commands, scratch: u32) {
        let mut first = self.first;
        first.scratch_chunk += scratch;
        cmd.dispatch(&self.allocate, &first, [1, 1, 1]);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let groups = self.then.block_count.div_ceil(KEEP_BLOCKS);
        by_slots(cmd, &self.fresh, first.slot_count, |first, count| {
            cmd.dispatch_from(&self.keep, &self.then, [0, first, 0], [groups, count, 1]);
        });
    }
}
