//! The `pixel` estimator, the paper's equations (1) and (2): form factors summed pixel by pixel, then irradiance. Shaders:
//! `bin_pixels.comp`, `apply_pixels.comp`; twin: [`crate::reference::bin_pixels`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::{SceneBuffers, State, upload};
use super::{groups, shaders};
use crate::error::{Error, Result};
use crate::hemicube::{fixed_point_tables, pixel_count};
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage,
};

pub struct BinPixels {
    bin: ComputePipeline,
    apply: ComputePipeline,
}

/// The form factors of a batch, `[slot][element]`, and the pixels' own.
pub struct Buffers {
    deltas: Buffer,
    form_factors: Buffer,
    bin: DescriptorSet,
    apply: DescriptorSet,
}

impl Buffers {
    /// The pixels' own form factors and the sums, which live as long as the sets that bind them.
    pub fn bytes(&self) -> u64 {
        self.deltas.bytes() + self.form_factors.bytes()
    }
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    element_count: u32,
    /// Of `bin`: pixels a side of a face. Of `apply`: slots of the batch.
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
            apply: ComputePipeline::storage(
                device,
                "apply pixels",
                shaders::APPLY_PIXELS_COMP,
                8,
                push,
            )?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
    ) -> Result<Buffers> {
        let hemicubes = batch.hemicubes();
        let tables = fixed_point_tables(hemicubes.face_size);
        let deltas = upload(device, "delta form factors", &tables, BufferUse::Storage)?;
        let bytes = 8 * u64::from(batch.slot_count) * u64::from(scene.element_count);
        let form_factors = Buffer::new(device, "form factors", bytes, BufferUse::Storage)?;
        Commands::run(device, "form factors", |cmd| {
            cmd.fill(&form_factors, 0);
            Ok(())
        })?;
        let bin = self.bin.bind(
            "bin pixels",
            &[
                Bind::Buffer(&batch.slots),
                Bind::Buffer(&scene.sources),
                Bind::Buffer(&deltas),
                Bind::Buffer(&form_factors),
                Bind::Buffer(&scene.planes),
                Bind::Image(&hemicubes.items, &hemicubes.sampler),
            ],
        )?;
        let apply = self.apply.bind(
            "apply pixels",
            &[
                &batch.slots,
                &scene.sources,
                &form_factors,
                &scene.areas,
                &state.direct,
                &state.direct_error,
                &state.indirect,
                &state.indirect_error,
            ]
            .map(Bind::Buffer),
        )?;
        Ok(Buffers {
            deltas,
            form_factors,
            bin,
            apply,
        })
    }

    pub fn record(&self, cmd: &Commands, buffers: &Buffers, scene: &SceneBuffers, batch: &Batch) {
        let hemicubes = batch.hemicubes();
        let pixels = pixel_count(hemicubes.face_size) as u32;
        let parameters = |second| Parameters {
            element_count: scene.element_count,
            second,
        };
        cmd.dispatch(
            &self.bin,
            &buffers.bin,
            &parameters(hemicubes.face_size),
            [groups(pixels), batch.slot_count, 1],
        );
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        cmd.dispatch(
            &self.apply,
            &buffers.apply,
            &parameters(batch.slot_count),
            [groups(scene.element_count), 1, 1],
        );
    }
}
