//! What the form factors of a source take of it together, in scenes that are enclosed. Shader:
//! `sum_factors.comp`; twin: [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::sum_factors::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

/// Bound to a batch.
pub struct SumFactors {
    /// Form factors times areas of the elements, `[slot][parcel]`.
    pub sums: Buffer,
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
}

impl SumFactors {
    /// `parcels`: first element and number of elements of each, all of these rows.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
        parcels: &[[u32; 2]],
    ) -> Result<Self> {
        let parcel_count = parcels.len() as u32;
        let bytes = 4 * u64::from(batch.slot_count) * u64::from(parcel_count);
        let sums = Buffer::new(device, "form factor sums", bytes, BufferUse::Storage)?;
        let parcels = upload(device, "parcels", parcels, BufferUse::Storage)?;
        let bindings = Bindings {
            slots: &batch.slots,
            parcels: &parcels,
            element_area: &scene.areas,
            fresh: &rows.plain,
            fresh_meso: &rows.meso,
            occupied: &rows.occupied,
            sums: &sums,
        };
        let shape = rows.shape;
        Ok(Self {
            bound: ComputePipeline::new(device, "sum factors", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                parcel_count,
                plain_count: shape.plain.count,
                plain_blocks: shape.plain_blocks(),
                meso_count: shape.meso.count,
                block_count: shape.blocks(),
                first_plain: shape.plain.first,
                first_meso: shape.first_meso(),
            },
            sums,
            slot_count: batch.slot_count,
        })
    }

    /// Of a slot.
    pub fn parcel_count(&self) -> u32 {
        self.parameters.parcel_count
    }

    pub fn record(&self, cmd: &Commands) {
        let size = [groups(self.parameters.parcel_count), self.slot_count, 1];
        cmd.dispatch(&self.bound, &self.parameters, size);
    }
}
