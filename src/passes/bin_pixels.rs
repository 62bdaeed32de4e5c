//! The `pixel` estimator, the paper's equations (1) and (2): form factors summed pixel by pixel, as
//! rows. Shaders: `bin_pixels.comp`, `pixel_rows.comp`; twin: [`crate::reference::bin_pixels`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::{groups, shaders};
use crate::error::{Error, Result};
use crate::math::hemicube::{fixed_point_tables, pixel_count};
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage,
};

pub struct BinPixels {
    bin: ComputePipeline,
    rows: ComputePipeline,
}

/// Bound to the pixels' own form factors and their sums for a batch, `[slot][element]`.
pub struct Bound {
    bin: DescriptorSet,
    rows: DescriptorSet,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    element_count: u32,
    /// Of `bin`: pixels a side of a face. Of `rows`: blocks of a row.
    second: u32,
}

impl BinPixels {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        if !device.candidate().int64_atomics {
            return Err(Error::Device(format!(
                "device {} has no 64-bit integer atomics on buffers, which --estimator pixel needs; use --estimator receiver",
                device.name()
            )));
        }
        let push = size_of::<Parameters>();
        let mut bindings = [Binding::Storage; 6];
        bindings[5] = Binding::Sampled;
        Ok(Self {
            bin: ComputePipeline::new(
                device,
                "bin pixels",
                shaders::BIN_PIXELS_COMP,
                &bindings,
                push,
                &[],
                false,
            )?,
            rows: ComputePipeline::storage(
                device,
                "pixel rows",
                shaders::PIXEL_ROWS_COMP,
                6,
                push,
            )?,
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
        let bin = self.bin.bind(
            "bin pixels",
            &[
                Bind::Buffer(&batch.slots),
                Bind::Buffer(&scene.sources),
                Bind::Buffer(&deltas),
                Bind::Buffer(&sums),
                Bind::Buffer(&scene.planes),
                Bind::Image(&hemicubes.items, &hemicubes.sampler),
            ],
        )?;
        let to_rows = [
            &batch.slots,
            &scene.sources,
            &sums,
            &scene.areas,
            &rows.plain,
            &rows.occupied,
        ];
        let rows = self.rows.bind("pixel rows", &to_rows.map(Bind::Buffer))?;
        Ok(Bound { bin, rows })
    }

    /// After a barrier between earlier readers of the rows and transfers.
    pub fn record(&self, cmd: &Commands, bound: &Bound, batch: &Batch, rows: &FreshRows) {
        cmd.fill(&rows.occupied, 0);
        cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
        let element_count = rows.shape.plain_count;
        let hemicubes = batch.hemicubes();
        let pixels = pixel_count(hemicubes.face_size) as u32;
        let parameters = |second| Parameters {
            element_count,
            second,
        };
        cmd.dispatch(
            &self.bin,
            &bound.bin,
            &parameters(hemicubes.face_size),
            [groups(pixels), batch.slot_count, 1],
        );
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        cmd.dispatch(
            &self.rows,
            &bound.rows,
            &parameters(rows.shape.blocks()),
            [groups(element_count), batch.slot_count, 1],
        );
    }
}
