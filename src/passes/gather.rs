//! Irradiance of every element from form factors, fresh and kept. Shaders: `gather.comp`, and where a scene has relief
//! `gather_from_relief.comp` and `gather_to_relief.comp`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{Batch, SceneBuffers, State, write};
use super::factor_buffers::FactorBuffers;
use super::relief_buffers::ReliefBuffers;
use super::types::ReceiverList;
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{Bind, Binding, Buffer, Commands, ComputePipeline, DescriptorSet, Device, Stage};

/// Gathering in a scene without relief.
pub struct Gather {
    pipeline: ComputePipeline,
}

/// Gathering in a scene with relief: the elements without, and those with one.
pub struct GatherRelief {
    from: ComputePipeline,
    to: ComputePipeline,
}

/// For emitted light, which few batches have, and for reflected light.
pub type Sets = [DescriptorSet; 2];

/// Sets of [`GatherRelief`].
pub struct ReliefSets {
    from: Sets,
    to: Sets,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    fresh_slots: u32,
    slot_count: u32,
    first_block: u32,
    /// 0: emitted light, 1: reflected.
    reflected: u32,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ReliefParameters {
    common: Parameters,
    first_source: u32,
    source_count: u32,
    cells: [u32; 2],
}

/// How many bindings each shader has.
const PLAIN: usize = 6;
const FROM_RELIEF: usize = PLAIN + 3;
const TO_RELIEF: usize = FROM_RELIEF + 4;

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

/// What all bind, for emitted and for reflected light.
fn binds<'a>(
    state: &'a State,
    batch: &'a Batch,
    factors: &'a FactorBuffers,
    fresh: &'a Buffer,
) -> [Vec<&'a Buffer>; 2] {
    let lights = [
        (&state.direct, &state.direct_error),
        (&state.indirect, &state.indirect_error),
    ];
    lights.map(|(irradiance, error)| {
        let rows = (&state.kept_rows, &factors.table);
        vec![&batch.slots, irradiance, error, fresh, rows.0, rows.1]
    })
}

fn sets(pipeline: &ComputePipeline, name: &str, binds: &[Vec<&Buffer>; 2]) -> Result<Sets> {
    let set = |buffers: &Vec<&Buffer>| {
        let binds: Vec<_> = buffers.iter().map(|b| Bind::Buffer(b)).collect();
        pipeline.bind(name, &binds)
    };
    Ok([set(&binds[0])?, set(&binds[1])?])
}

/// Has the elements without and with relief gather emitted light in the batches that have some.
fn command_emitting(device: &Arc<Device>, batch: &Batch, elements: [u32; 2]) -> Result<()> {
    let commands = elements.map(|count| ReceiverList::idle(groups(count)));
    write(device, &batch.emitting_commands, &commands)
}

impl Gather {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: pipeline::<Parameters>(device, "gather", shaders::GATHER_COMP, PLAIN)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        batch: &Batch,
        factors: &FactorBuffers,
    ) -> Result<Sets> {
        command_emitting(device, batch, [scene.element_count, 0])?;
        let binds = binds(state, batch, factors, &factors.fresh);
        sets(&self.pipeline, "gather", &binds)
    }

    pub fn record(&self, cmd: &Commands, sets: &Sets, scene: &SceneBuffers, batch: &Batch) {
        let count = scene.element_count;
        let parameters = |reflected| Parameters {
            first_element: 0,
            element_count: count,
            fresh_slots: batch.slot_count,
            slot_count: batch.all_slots(),
            first_block: 0,
            reflected,
        };
        let emitting = (&batch.emitting_commands, 0);
        cmd.dispatch_indirect(&self.pipeline, &sets[0], &parameters(0), emitting);
        let size = [groups(count), 1, 1];
        cmd.dispatch(&self.pipeline, &sets[1], &parameters(1), size);
    }
}

impl GatherRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let make =
            |name, spirv, bindings| pipeline::<ReliefParameters>(device, name, spirv, bindings);
        let from = shaders::GATHER_FROM_RELIEF_COMP;
        let to = shaders::GATHER_TO_RELIEF_COMP;
        Ok(Self {
            from: make("gather from relief", from, FROM_RELIEF)?,
            to: make("gather to relief", to, TO_RELIEF)?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        (scene, state): (&SceneBuffers, &State),
        batch: &Batch,
        factors: &FactorBuffers,
        relief: &ReliefBuffers,
    ) -> Result<ReliefSets> {
        command_emitting(device, batch, [factors.plain_count, factors.meso_count])?;
        let sending = [&relief.exits, &scene.sources, &scene.balls];
        let mut from = binds(state, batch, factors, &factors.fresh);
        let mut to = binds(state, batch, factors, &factors.fresh_meso);
        let moments = [&relief.moments_direct, &relief.moments_indirect];
        for i in 0..2 {
            from[i].extend(sending);
            to[i].extend(sending);
            let receiving = [&relief.elements, &relief.albedos];
            to[i].extend(receiving.into_iter().chain([moments[i], &relief.reflected]));
        }
        Ok(ReliefSets {
            from: sets(&self.from, "gather from relief", &from)?,
            to: sets(&self.to, "gather to relief", &to)?,
        })
    }

    /// Elements without and with relief are written to at once.
    pub fn record(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        relief: &ReliefBuffers,
        batch: &Batch,
        factors: &FactorBuffers,
    ) {
        let (plain, meso) = (factors.plain_count, factors.meso_count);
        let parameters = |meso_elements: bool, reflected| ReliefParameters {
            common: Parameters {
                first_element: if meso_elements { plain } else { 0 },
                element_count: if meso_elements { meso } else { plain },
                fresh_slots: batch.slot_count,
                slot_count: batch.all_slots(),
                first_block: if meso_elements {
                    factors.plain_blocks()
                } else {
                    0
                },
                reflected,
            },
            first_source: relief.first_source,
            source_count: relief.source_count,
            cells: relief.cells(),
        };
        let (from, to) = (parameters(false, 0), parameters(true, 0));
        let second = size_of::<ReceiverList>() as u64;
        cmd.dispatch_indirect(
            &self.from,
            &sets.from[0],
            &from,
            (&batch.emitting_commands, 0),
        );
        cmd.dispatch_indirect(
            &self.to,
            &sets.to[0],
            &to,
            (&batch.emitting_commands, second),
        );
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let (from, to) = (parameters(false, 1), parameters(true, 1));
        if plain > 0 {
            cmd.dispatch(&self.from, &sets.from[1], &from, [groups(plain), 1, 1]);
        }
        cmd.dispatch(&self.to, &sets.to[1], &to, [groups(meso), 1, 1]);
    }
}
