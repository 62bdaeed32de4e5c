//! The `pixel` estimator, the paper's equations (1) and (2): form factors summed pixel by pixel, as
//! rows. Shaders: `bin_pixels.comp`, `pixel_rows.comp`; twin: [`crate::reference::bin_pixels`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, filled, upload};
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::{bin_pixels, pixel_rows};
use crate::error::{Error, Result};
use crate::math::hemicube::{fixed_point_tables, pixel_count};
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device, Stage};

/// Bound to the pixels' own form factors and their sums for a batch, `[slot][element]`.
pub struct BinPixels {
    bin: BoundCompute,
    rows: BoundCompute,
    element_count: u32,
    block_count: u32,
    face_size: u32,
    slot_count: u32,
    occupied: Buffer,
}

impl BinPixels {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<Self> {
        if !device.candidate().int64_atomics {
            return Err(Error::Device(format!(
                "device {} has no 64-bit integer atomics on buffers, which --estimator pixel \
                 needs; use --estimator receiver",
                device.name()
            )));
        }
        let hemicubes = batch.hemicubes();
        let tables = fixed_point_tables(hemicubes.face_size);
        let deltas = upload(device, "delta form factors", &tables, BufferUse::Storage)?;
        let bytes = 8 * u64::from(batch.slot_count) * u64::from(scene.element_count);
        let sums = filled(device, "pixel sums", bytes, 0)?;
        let bin = ComputePipeline::new(device, "bin pixels", &bin_pixels::SHADER)?;
        let pixel_rows = ComputePipeline::new(device, "pixel rows", &pixel_rows::SHADER)?;
        Ok(Self {
            bin: bin.bind(&bin_pixels::Bindings {
                slots: &batch.slots,
                sources: &scene.sources,
                deltas: &deltas,
                form_factors: &sums,
                planes: &scene.planes,
                items: hemicubes.sampled_items(),
            })?,
            rows: pixel_rows.bind(&pixel_rows::Bindings {
                slots: &batch.slots,
                sources: &scene.sources,
                sums: &sums,
                element_area: &scene.areas,
                fresh: &rows.plain,
                occupied: &rows.occupied,
            })?,
            element_count: rows.shape.plain.count,
            block_count: rows.shape.blocks(),
            face_size: hemicubes.face_size,
            slot_count: batch.slot_count,
            occupied: rows.occupied.clone(),
        })
    }

    /// After a barrier between earlier readers of the rows and transfers.
    pub fn record(&self, cmd: &Commands) {
        cmd.fill(&self.occupied, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        let element_count = self.element_count;
        let bin = bin_pixels::Parameters {
            element_count,
            face_size: self.face_size,
        };
        let pixels = pixel_count(self.face_size) as u32;
        cmd.dispatch(&self.bin, &bin, [groups(pixels), self.slot_count, 1]);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let rows = pixel_rows::Parameters {
            element_count,
            block_count: self.block_count,
        };
        let size = [groups(element_count), self.slot_count, 1];
        cmd.dispatch(&self.rows, &rows, size);
    }
}
