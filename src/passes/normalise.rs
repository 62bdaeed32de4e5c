//! Scales form factors so that all that a source sends in an enclosed scene arrives. Shader:
//! `normalise.comp`; twin: [`crate::reference::normalise`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::fresh_rows::FreshRows;
use super::shaders::normalise::{Bindings, Parameters, SHADER};
use crate::error::Result;
use crate::vk::{BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device};

pub struct Normalise {
    /// Share of each source that its form factors take together, `[slot]`; negative of a point
    /// light.
    pub shares: Buffer,
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
}

impl Normalise {
    /// `scales`: whether the form factors are scaled, or their sums found alone.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        rows: &FreshRows,
        scales: bool,
    ) -> Result<Self> {
        let bytes = 4 * u64::from(batch.slot_count);
        let shares = Buffer::new(device, "form factor sums", bytes, BufferUse::Storage)?;
        let bindings = Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            element_area: &scene.areas,
            fresh: &rows.plain,
            fresh_meso: &rows.meso,
            shares: &shares,
        };
        Ok(Self {
            bound: ComputePipeline::new(device, "normalise", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                plain_count: rows.shape.plain_count,
                meso_count: rows.shape.meso_count,
                scales: scales.into(),
            },
            shares,
            slot_count: batch.slot_count,
        })
    }

    pub fn record(&self, cmd: &Commands) {
        cmd.dispatch(&self.bound, &self.parameters, [self.slot_count, 1, 1]);
    }
}
