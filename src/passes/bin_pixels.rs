//! The `pixel` estimator, the paper's equations (1) and (2): form factors summed pixel by pixel, as
//! rows. Shaders: `bin_pixels.comp`, `pixel_rows.comp`; twin: [`crate::reference::bin_pixels`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::{bin_pixels, pixel_rows};
use crate::error::{Error, Result};
use crate::math::hemicube::{fixed_point_tables, pixel_count};
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage};

pub struct BinPixels {
    bin: ComputePipeline,
    rows: ComputePipeline,
}

/// Bound to the pixels' own form factors and their sums for a batch, `[slot][element]`.
pub struct Bound {
    bin: DescriptorSet,
    rows: DescriptorSet,
}

impl BinPixels {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        if !device.candidate().int64_atomics {
            return Err(Error::Device(format!(
                "device {} has no 64-bit integer atomics on buffers, which --estimator pixel \
                 needs; use --estimator receiver",
                device.name()
            )));
        }
        Ok(Self {
            bin: ComputePipeline::new(device, "bin pixels", &bin_pixels::SHADER)?,
            rows: ComputePipeline::new(device, "pixel rows", &pixel_rows::SHADER)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
    ) -> Result<Bound> {
        let hemicubes = batch.hemicubes();
        let tables = fixed_point_tables(hemicubes.face_size);
        let deltas = upload(device, "delta form factors", &tables, BufferUse::Storage)?;
        let bytes = 8 * u64::from(batch.slot_count) * u64::from(scene.element_count);
        let sums = Buffer::new(device, "pixel sums", bytes, BufferUse::Storage)?;
        Commands::run(device, "pixel sums", |cmd| {
            cmd.fill(&sums, 0);
            Ok(())
        })?;
        let bin = bin_pixels::Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            deltas: &deltas,
            form_factors: &sums,
            planes: &scene.planes,
            items: hemicubes.sampled_items(),
        };
        let rows = pixel_rows::Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            sums: &sums,
            element_area: &scene.areas,
            fresh: &rows.plain,
            occupied: &rows.occupied,
        };
        let bin = self.bin.bind("bin pixels", &bin)?;
        let rows = self.rows.bind("pixel rows", &rows)?;
        Ok(Bound { bin, rows })
    }

    /// After a barrier between earlier readers of the rows and transfers.
    pub fn record(&self, cmd: &Commands, bound: &Bound, batch: &Batch, rows: &FreshRows) {
        cmd.fill(&rows.occupied, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        let element_count = rows.shape.plain_count;
        let hemicubes = batch.hemicubes();
        let pixels = pixel_count(hemicubes.face_size) as u32;
        cmd.dispatch(
            &self.bin,
            &bound.bin,
            &bin_pixels::Parameters {
                element_count,
                face_size: hemicubes.face_size,
            },
            [groups(pixels), batch.slot_count, 1],
        );
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        cmd.dispatch(
            &self.rows,
            &bound.rows,
            &pixel_rows::Parameters {
                element_count,
                block_count: rows.shape.blocks(),
            },
            [groups(element_count), batch.slot_count, 1],
        );
    }
}
