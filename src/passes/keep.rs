//! Keeps the rows of a batch. Shaders: `allocate.comp`, `keep.comp`; the codes' twin:
//! [`crate::reference::kept`].

use std::sync::Arc;

use super::fresh_rows::FreshRows;
use super::kept_rows::KeptRows;
use super::shaders;
use super::types::KeptRow;
use crate::constants::KEEP_BLOCKS;
use crate::error::Result;
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage,
};

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
        let allocate = shaders::ALLOCATE_COMP;
        Ok(Self {
            allocate: ComputePipeline::storage(device, "allocate", allocate, 5, 4 * 6)?,
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
        let allocate = [slots, &fresh.occupied, &rows, &kept.table, &kept.state];
        let keep = [slots, &rows, &kept.table, &fresh.plain, &fresh.meso];
        Ok(Bound {
            allocate: (self.allocate).bind("allocate", &allocate.map(Bind::Buffer))?,
            keep: self.keep.bind("keep", &keep.map(Bind::Buffer))?,
            rows,
            slot_count,
        })
    }

    /// `scratch`: which of the [`super::kept_rows::SCRATCH`] chunks takes the rows without room.
    pub fn record(&self, cmd: &Commands, bound: &Bound, kept: &KeptRows, scratch: u32) {
        let shape = kept.shape;
        let allocate = [
            bound.slot_count,
            shape.blocks(),
            shape.meso_blocks(),
            kept.chunk_count(),
            kept.chunk_words,
            kept.chunk_count() + scratch,
        ];
        cmd.dispatch(&self.allocate, &bound.allocate, &allocate, [1, 1, 1]);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let keep = [
            shape.plain_count,
            shape.plain_blocks(),
            shape.meso_count,
            shape.blocks(),
        ];
        let size = [shape.blocks().div_ceil(KEEP_BLOCKS), bound.slot_count, 1];
        cmd.dispatch(&self.keep, &bound.keep, &keep, size);
    }
}
