//! Irradiance of every element from form factors, fresh and kept. Shaders: `gather.comp`, and where a scene has relief
//! `gather_from_relief.comp` and `gather_to_relief.comp`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{Batch, SceneBuffers, State};
use super::factor_buffers::FactorBuffers;
use super::relief_buffers::ReliefBuffers;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device};

/// Gathering in a scene without relief.
pub struct Gather {
    pipeline: ComputePipeline,
}

/// Gathering in a scene with relief: the elements without, and those with one.
pub struct GatherRelief {
    from: ComputePipeline,
    to: ComputePipeline,
}

/// Sets of [`GatherRelief`].
pub struct ReliefSets {
    from: DescriptorSet,
    to: DescriptorSet,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    fresh_slots: u32,
    slot_count: u32,
    first_block: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ReliefParameters {
    common: Parameters,
    first_source: u32,
    source_count: u32,
    cells: [u32; 2],
}

/// Bindings that all have.
const COMMON: usize = 12;

fn pipeline<P>(
    device: &Arc<Device>,
    name: &str,
    spirv: &[u32],
    bindings: usize,
) -> Result<ComputePipeline> {
    let kinds = vec![Binding::Storage; bindings];
    let lanes = [device.limits().subgroup_size];
    ComputePipeline::new(device, name, spirv, &kinds, size_of::<P>(), &lanes, true)
}

fn binds<'a>(
    scene: &'a SceneBuffers,
    state: &'a State,
    batch: &'a Batch,
    factors: &'a FactorBuffers,
    fresh: &'a crate::vk::Buffer,
) -> Vec<Bind<'a>> {
    [
        &batch.slots,
        &scene.sources,
        &scene.planes,
        &scene.balls,
        &state.direct,
        &state.direct_error,
        &state.indirect,
        &state.indirect_error,
        &state.behind,
        fresh,
        &state.kept_rows,
        &factors.table,
    ]
    .map(Bind::Buffer)
    .to_vec()
}

fn parameters(
    batch: &Batch,
    first_element: u32,
    element_count: u32,
    first_block: u32,
) -> Parameters {
    Parameters {
        first_element,
        element_count,
        fresh_slots: batch.slot_count,
        slot_count: batch.all_slots(),
        first_block,
    }
}

impl Gather {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: pipeline::<Parameters>(device, "gather", shaders::GATHER_COMP, COMMON)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        factors: &FactorBuffers,
    ) -> Result<DescriptorSet> {
        let binds = binds(scene, state, batch, factors, &factors.fresh);
        self.pipeline.bind("gather", &binds)
    }

    pub fn record(&self, cmd: &Commands, set: &DescriptorSet, scene: &SceneBuffers, batch: &Batch) {
        let count = scene.element_count;
        let parameters = parameters(batch, 0, count, 0);
        cmd.dispatch(&self.pipeline, set, &parameters, [groups(count), 1, 1]);
    }
}

impl GatherRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let make =
            |name, spirv, bindings| pipeline::<ReliefParameters>(device, name, spirv, bindings);
        let from = shaders::GATHER_FROM_RELIEF_COMP;
        let to = shaders::GATHER_TO_RELIEF_COMP;
        Ok(Self {
            from: make("gather from relief", from, COMMON + 1)?,
            to: make("gather to relief", to, COMMON + 6)?,
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        factors: &FactorBuffers,
        relief: &ReliefBuffers,
    ) -> Result<ReliefSets> {
        let binds = |fresh| {
            let mut binds = binds(scene, state, batch, factors, fresh);
            binds.push(Bind::Buffer(&relief.exits));
            binds
        };
        let from = binds(&factors.fresh);
        let mut to = binds(&factors.fresh_meso);
        to.extend(
            [
                &relief.elements,
                &relief.albedos,
                &relief.moments_direct,
                &relief.moments_indirect,
                &relief.reflected,
            ]
            .map(Bind::Buffer),
        );
        Ok(ReliefSets {
            from: self.from.bind("gather from relief", &from)?,
            to: self.to.bind("gather to relief", &to)?,
        })
    }

    /// The two dispatches write to different elements.
    pub fn record(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        relief: &ReliefBuffers,
        batch: &Batch,
        factors: &FactorBuffers,
    ) {
        let parameters = |first_element, element_count, first_block| ReliefParameters {
            common: parameters(batch, first_element, element_count, first_block),
            first_source: relief.first_source,
            source_count: relief.source_count,
            cells: relief.cells(),
        };
        let (plain, meso) = (factors.plain_count, factors.meso_count);
        if plain > 0 {
            let from = parameters(0, plain, 0);
            cmd.dispatch(&self.from, &sets.from, &from, [groups(plain), 1, 1]);
        }
        let to = parameters(plain, meso, factors.plain_blocks());
        cmd.dispatch(&self.to, &sets.to, &to, [groups(meso), 1, 1]);
    }
}
