//! Couples the sources of a batch to all sources. Shader: `couple.comp`; twin:
//! [`crate::reference::couple`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::groups;
use super::shaders::couple::{Bindings, Parameters, SHADER};
use super::types::CouplingTarget;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device};

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
        Ok(Self {
            pipeline: ComputePipeline::new(device, "couple", &SHADER)?,
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
            &Bindings {
                slots: &batch.slots,
                targets: &on_device,
                reflectance: &scene.reflectance,
                element_area: &scene.areas,
                fresh: &fresh.plain,
                fresh_meso: &fresh.meso,
                occupied: &fresh.occupied,
                coupling: &coupling,
            },
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
        let parameters = Parameters {
            target_count: bound.target_count,
            word_count: bound.word_count,
            plain_count: shape.plain_count,
            plain_blocks: shape.plain_blocks(),
            meso_count: shape.meso_count,
            block_count: shape.blocks(),
        };
        let size = [groups(bound.target_count), batch.slot_count, 1];
        cmd.dispatch(&self.pipeline, &bound.set, &parameters, size);
    }
}
