//! The `receiver` estimator: every element gathers from the batch's sources. Shaders: `bin_receivers.comp`, and where a scene
//! has relief `bin_from_relief.comp` and `bin_to_relief.comp`; twin: [`crate::reference::bin_receivers`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{Batch, SceneBuffers, State};
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device};

/// Gathering in a scene without relief.
pub struct BinReceivers {
    pipeline: ComputePipeline,
}

/// Gathering in a scene with relief: first the elements without, then those with one.
pub struct BinRelief {
    from: ComputePipeline,
    to: ComputePipeline,
}

/// Sets of [`BinRelief`].
pub struct ReliefSets {
    from: DescriptorSet,
    to: DescriptorSet,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    slot_count: u32,
    face_size: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ReliefParameters {
    common: Parameters,
    first_source: u32,
    source_count: u32,
    cells: [u32; 2],
}

/// Place of the item buffer among the bindings; buffers of the relief follow it.
const ITEMS: usize = 13;

fn pipeline<P>(
    device: &Arc<Device>,
    name: &str,
    spirv: &[u32],
    bindings: usize,
) -> Result<ComputePipeline> {
    let mut kinds = vec![Binding::Storage; bindings];
    kinds[ITEMS] = Binding::Sampled;
    ComputePipeline::new(device, name, spirv, &kinds, size_of::<P>(), &[], false)
}

fn binds<'a>(scene: &'a SceneBuffers, state: &'a State, batch: &'a Batch) -> Vec<Bind<'a>> {
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
    binds
}

impl BinReceivers {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let spirv = shaders::BIN_RECEIVERS_COMP;
        Ok(Self {
            pipeline: pipeline::<Parameters>(device, "bin receivers", spirv, ITEMS + 1)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
    ) -> Result<DescriptorSet> {
        self.pipeline
            .bind("bin receivers", &binds(scene, state, batch))
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, scene: &SceneBuffers, batch: &Batch) {
        let parameters = Parameters {
            first_element: 0,
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

impl BinRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let make =
            |name, spirv, bindings| pipeline::<ReliefParameters>(device, name, spirv, bindings);
        Ok(Self {
            from: make("bin from relief", shaders::BIN_FROM_RELIEF_COMP, ITEMS + 2)?,
            to: make("bin to relief", shaders::BIN_TO_RELIEF_COMP, ITEMS + 7)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        relief: &ReliefBuffers,
    ) -> Result<ReliefSets> {
        let mut binds = binds(scene, state, batch);
        binds.push(Bind::Buffer(&relief.exits));
        let from = self.from.bind("bin from relief", &binds)?;
        binds.extend(
            [
                &relief.elements,
                &relief.albedos,
                &relief.moments_direct,
                &relief.moments_indirect,
                &relief.reflected,
            ]
            .map(Bind::Buffer),
        );
        let to = self.to.bind("bin to relief", &binds)?;
        Ok(ReliefSets { from, to })
    }

    /// The two dispatches write to different elements.
    pub fn record(&self, cmd: &Commands, sets: &ReliefSets, relief: &ReliefBuffers, batch: &Batch) {
        let parameters = |first_element, element_count| ReliefParameters {
            common: Parameters {
                first_element,
                element_count,
                slot_count: batch.slot_count,
                face_size: batch.face_size,
            },
            first_source: relief.first_source,
            source_count: relief.source_count,
            cells: relief.cells(),
        };
        let plain = parameters(0, relief.first_element);
        if plain.common.element_count > 0 {
            cmd.dispatch(
                &self.from,
                &sets.from,
                &plain,
                [groups(relief.first_element), 1, 1],
            );
        }
        let meso = parameters(relief.first_element, relief.element_count);
        cmd.dispatch(
            &self.to,
            &sets.to,
            &meso,
            [groups(relief.element_count), 1, 1],
        );
    }
}
