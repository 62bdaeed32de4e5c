//! Couples the sources of a batch to all sources, and sums what each gives parcels of elements.
//! Shader: `couple.comp`; twins: [`crate::reference::couple`], [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::fresh_rows::FreshRows;
use super::shaders::couple::{Bindings, Parameters, SHADER};
use super::types::CouplingTarget;
use super::{by_slots, groups};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

/// Bound to the coupling rows of a batch.
pub struct Couple {
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
    fresh: FreshRows,
    /// `[slot][word]`.
    pub coupling: Buffer,
}

impl Couple {
    /// To sources.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        fresh: &FreshRows,
        targets: &[CouplingTarget],
    ) -> Result<Self> {
        Self::by(device, (scene, &scene.weights), batch, fresh, targets)
    }

    /// To parcels of elements, of which each has one word: the sum of its form factors times areas.
    /// Parcels are first element and number of elements.
    pub fn to_parcels(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        fresh: &FreshRows,
        parcels: &[[u32; 2]],
    ) -> Result<Self> {
        let target =
            |(first_word, &[first_element, element_count]): (u32, &[u32; 2])| CouplingTarget {
                first_element,
                element_count,
                first_word,
                word_count: 1,
                inverse_area: 1.0,
            };
        let targets: Vec<CouplingTarget> = (0..).zip(parcels).map(target).collect();
        Self::by(device, (scene, &scene.areas), batch, fresh, &targets)
    }

    fn by(
        device: &Arc<Device>,
        (scene, weights): (&SceneBuffers, &Buffer),
        batch: &Batch,
        fresh: &FreshRows,
        targets: &[CouplingTarget],
    ) -> Result<Self> {
        let word_count = targets.last().map_or(0, |t| t.first_word + t.word_count);
        let on_device = upload(device, "coupling targets", targets, BufferUse::Storage)?;
        let bytes = 4 * u64::from(batch.slot_count) * u64::from(word_count);
        let coupling = Buffer::new(device, "coupling", bytes, BufferUse::Storage)?;
        let bindings = Bindings {
            slots: &batch.slots,
            targets: &on_device,
            reflectance: &scene.reflectance,
            weights,
            fresh: &fresh.plain,
            fresh_meso: &fresh.meso,
            occupied: &fresh.occupied,
            coupling: &coupling,
        };
        let shape = fresh.shape;
        Ok(Self {
            bound: ComputePipeline::new(device, "couple", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                target_count: targets.len() as u32,
                word_count,
                plain_count: shape.plain.count,
                plain_blocks: shape.plain_blocks(),
                meso_count: shape.meso.count,
                block_count: shape.blocks(),
                first_plain: shape.plain.first,
                first_meso: shape.first_meso(),
            },
            slot_count: batch.slot_count,
            fresh: fresh.clone(),
            coupling,
        })
    }

    /// Words of a row.
    pub fn word_count(&self) -> u32 {
        self.parameters.word_count
    }

    pub fn record(&self, cmd: &Commands) {
        let groups = groups(self.parameters.target_count);
        by_slots(cmd, &self.fresh, self.slot_count, |first, count| {
            cmd.dispatch_from(
                &self.bound,
                &self.parameters,
                [0, first, 0],
                [groups, count, 1],
            );
        });
    }
}
