//! The `receiver` estimator: every element gathers from the batch's sources. Shader: `bin_receivers.comp`; twin:
//! [`crate::reference::bin_receivers`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{Batch, SceneBuffers, State};
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device};

pub struct BinReceivers {
    pipeline: ComputePipeline,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    element_count: u32,
    slot_count: u32,
    face_size: u32,
}

impl BinReceivers {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let mut bindings = [Binding::Storage; 14];
        bindings[13] = Binding::Sampled;
        Ok(Self {
            pipeline: ComputePipeline::new(
                device,
                "bin receivers",
                shaders::BIN_RECEIVERS_COMP,
                &bindings,
                size_of::<Parameters>(),
                &[],
                false,
            )?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
    ) -> Result<DescriptorSet> {
        let mut binds: Vec<_> = [
            &batch.slots,
            &scene.sources,
            &scene.contours,
            &scene.corners,
            &scene.vertices,
            &scene.planes,
            &scene.balls,
            &state.direct,
            &state.direct_error,
            &state.indirect,
            &state.indirect_error,
            &state.behind,
            &scene.areas,
        ]
        .map(Bind::Buffer)
        .to_vec();
        binds.push(Bind::Image(&batch.items, &batch.sampler));
        self.pipeline.bind("bin receivers", &binds)
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, scene: &SceneBuffers, batch: &Batch) {
        let parameters = Parameters {
            element_count: scene.element_count,
            slot_count: batch.slot_count,
            face_size: batch.face_size,
        };
        cmd.dispatch(
            &self.pipeline,
            set,
            &parameters,
            [groups(scene.element_count), 1, 1],
        );
    }
}
