//! Couples the sources of a batch to all sources. Shader: `couple.comp`; twin:
//! [`crate::reference::couple`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::types::CouplingTarget;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device};

pub struct Couple {
    pipeline: ComputePipeline,
}

/// The coupling rows of a batch.
pub struct Bound {
    set: DescriptorSet,
    target_count: u32,
    /// Words of a row.
    pub word_count: u32,
    /// `[slot][word]`.
    pub coupling: Buffer,
}

impl Couple {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let spirv = shaders::COUPLE_COMP;
        Ok(Self {
            pipeline: ComputePipeline::storage(device, "couple", spirv, 8, 4 * 6)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        fresh: &FreshRows,
        targets: &[CouplingTarget],
    ) -> Result<Bound> {
        let word_count = targets.last().map_or(0, |t| t.first_word + t.word_count);
        let on_device = upload(device, "coupling targets", targets, BufferUse::Storage)?;
        let bytes = 4 * u64::from(batch.slot_count) * u64::from(word_count);
        let coupling = Buffer::new(device, "coupling", bytes, BufferUse::Storage)?;
        let set = self.pipeline.bind(
            "couple",
            &[
                &batch.slots,
                &on_device,
                &scene.reflectance,
                &scene.areas,
                &fresh.plain,
                &fresh.meso,
                &fresh.occupied,
                &coupling,
            ]
            .map(Bind::Buffer),
        )?;
        Ok(Bound {
            set,
            target_count: targets.len() as u32,
            word_count,
            coupling,
        })
    }

    pub fn record(&self, cmd: &Commands, bound: &Bound, batch: &Batch, fresh: &FreshRows) {
        let shape = fresh.shape;
        let parameters = [
            bound.target_count,
            bound.word_count,
            shape.plain_count,
            shape.plain_blocks(),
            shape.meso_count,
            shape.blocks(),
        ];
        let size = [groups(bound.target_count), batch.slot_count, 1];
        cmd.dispatch(&self.pipeline, &bound.set, &parameters, size);
    }
}
