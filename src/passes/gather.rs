//! Irradiance of every element from form factors, fresh and kept, and of elements with a relief the moments of their light. Shaders:
//! `gather.comp`, and where a scene has relief `gather_from_relief.comp`, `gather_to_relief.comp` and `gather_evenly.comp`.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::{SceneBuffers, State, write};
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
    /// The same as long as all sources send evenly.
    plain: ComputePipeline,
    evenly: ComputePipeline,
}

/// For emitted light, which few batches have, and for reflected light.
pub type Sets = [DescriptorSet; 2];

/// Sets of [`GatherRelief`].
pub struct ReliefSets {
    from: Sets,
    to: Sets,
    plain: Sets,
    evenly: Sets,
    recalled: Sets,
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

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ToReliefParameters {
    common: ReliefParameters,
    first_slot: u32,
    part: u32,
}

/// What a dispatch to elements with a relief takes: irradiance and moments, or of moments alone those by form factors that found no
/// room or those by kept ones.
const EVERYTHING: u32 = 0;
const LOOSE_FACTORS: u32 = 1;
const KEPT_FACTORS: u32 = 2;

/// Recalled sources of one dispatch: a software device ends a shader's loops after 65,535 turns of all together.
const RECALLED_SLOTS: usize = 256;

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
fn command_emitting(device: &Arc<Device>, batch: &Batch, factors: &FactorBuffers) -> Result<()> {
    let commands = kinds(factors).map(|kind| ReceiverList::idle(groups(kind.elements)));
    write(device, &batch.emitting_commands, &commands)
}

/// Of [`Parameters::reflected`].
const EMITTED: u32 = 0;
const REFLECTED: u32 = 1;

/// Fresh slots, and all.
type Slots = (u32, u32);

fn slots_of(batch: &Batch) -> Slots {
    (batch.slot_count, batch.all_slots())
}

/// Over the elements without relief.
fn plain((fresh_slots, slot_count): Slots, factors: &FactorBuffers, reflected: u32) -> Parameters {
    Parameters {
        first_element: 0,
        element_count: factors.plain_count,
        fresh_slots,
        slot_count,
        first_block: 0,
        reflected,
    }
}

/// Over the elements with a relief.
fn meso(slots: Slots, factors: &FactorBuffers, reflected: u32) -> Parameters {
    Parameters {
        first_element: factors.plain_count,
        element_count: factors.meso_count,
        first_block: factors.plain_blocks(),
        ..plain(slots, factors, reflected)
    }
}

fn by_direction(relief: &ReliefBuffers, common: Parameters) -> ReliefParameters {
    ReliefParameters {
        common,
        first_source: relief.first_source,
        source_count: relief.source_count,
        cells: relief.cells(),
    }
}

/// No source sends by direction.
fn evenly(relief: &ReliefBuffers, common: Parameters) -> ReliefParameters {
    ReliefParameters {
        source_count: 0,
        ..by_direction(relief, common)
    }
}

/// One light to `elements` of one kind; emitted light only where the batch has some.
fn gather_light<P: Pod>(
    cmd: &Commands,
    (pipeline, sets): (&ComputePipeline, &Sets),
    parameters: &P,
    batch: &Batch,
    (light, kind): (u32, Kind),
) {
    let set = &sets[light as usize];
    match (light, kind) {
        (EMITTED, kind) => {
            let at = kind.command * size_of::<ReceiverList>() as u64;
            cmd.dispatch_indirect(pipeline, set, parameters, (&batch.emitting_commands, at));
        }
        (_, Kind { elements: 0, .. }) => {}
        (_, Kind { elements, .. }) => {
            cmd.dispatch(pipeline, set, parameters, [groups(elements), 1, 1]);
        }
    }
}

fn kinds(factors: &FactorBuffers) -> [Kind; 2] {
    let counts = [factors.plain_count, factors.meso_count];
    [0, 1].map(|i| Kind {
        elements: counts[i],
        command: i as u64,
    })
}

/// Elements without or with relief, and the place of their command among those of a batch.
#[derive(Clone, Copy)]
struct Kind {
    elements: u32,
    command: u64,
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
        state: &State,
        batch: &Batch,
        factors: &FactorBuffers,
    ) -> Result<Sets> {
        command_emitting(device, batch, factors)?;
        let binds = binds(state, batch, factors, &factors.fresh);
        sets(&self.pipeline, "gather", &binds)
    }

    pub fn record(&self, cmd: &Commands, sets: &Sets, batch: &Batch, factors: &FactorBuffers) {
        let [all, _] = kinds(factors);
        for light in [EMITTED, REFLECTED] {
            let parameters = plain(slots_of(batch), factors, light);
            let (gather, light) = ((&self.pipeline, sets), (light, all));
            gather_light(cmd, gather, &parameters, batch, light);
        }
    }
}

impl GatherRelief {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        let from = shaders::GATHER_FROM_RELIEF_COMP;
        let to = shaders::GATHER_TO_RELIEF_COMP;
        let evenly = shaders::GATHER_EVENLY_COMP;
        let plain = shaders::GATHER_COMP;
        Ok(Self {
            from: pipeline::<ReliefParameters>(device, "gather from relief", from, FROM_RELIEF)?,
            to: pipeline::<ToReliefParameters>(device, "gather to relief", to, TO_RELIEF)?,
            plain: pipeline::<Parameters>(device, "gather", plain, PLAIN)?,
            evenly: pipeline::<Parameters>(device, "gather evenly", evenly, PLAIN)?,
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
        command_emitting(device, batch, factors)?;
        let loose = ReceiverList::idle(groups(factors.meso_count));
        write(device, &batch.loose_command, &[loose])?;
        let sending = [&relief.exits, &scene.sources, &scene.balls];
        let plain = binds(state, batch, factors, &factors.fresh);
        let evenly = binds(state, batch, factors, &factors.fresh_meso);
        let (mut from, mut to) = (plain.clone(), evenly.clone());
        let moments = [&relief.moments_direct, &relief.moments_indirect];
        for i in 0..2 {
            from[i].extend(sending);
            to[i].extend(sending);
            let receiving = [&relief.elements, &relief.albedos];
            to[i].extend(receiving.into_iter().chain([moments[i], &relief.reflected]));
        }
        let mut recalled = to.clone();
        recalled
            .iter_mut()
            .for_each(|binds| binds[0] = &relief.recalled);
        Ok(ReliefSets {
            from: sets(&self.from, "gather from relief", &from)?,
            to: sets(&self.to, "gather to relief", &to)?,
            plain: sets(&self.plain, "gather", &plain)?,
            evenly: sets(&self.evenly, "gather evenly", &evenly)?,
            recalled: sets(&self.to, "gather recalled", &recalled)?,
        })
    }

    /// Sources with a relief send by direction. Elements without and with relief are written to at once.
    pub fn record(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        relief: &ReliefBuffers,
        batch: &Batch,
        factors: &FactorBuffers,
    ) {
        let [without, with] = kinds(factors);
        for light in [EMITTED, REFLECTED] {
            let from = by_direction(relief, plain(slots_of(batch), factors, light));
            let to = ToReliefParameters {
                common: by_direction(relief, meso(slots_of(batch), factors, light)),
                first_slot: 0,
                part: EVERYTHING,
            };
            gather_light(
                cmd,
                (&self.from, &sets.from),
                &from,
                batch,
                (light, without),
            );
            gather_light(cmd, (&self.to, &sets.to), &to, batch, (light, with));
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
    }

    /// All sources send evenly. Elements with a relief take their irradiance alone, and moments by form factors that are not kept.
    pub fn record_evenly(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        relief: &ReliefBuffers,
        batch: &Batch,
        factors: &FactorBuffers,
    ) {
        let [without, with] = kinds(factors);
        for light in [EMITTED, REFLECTED] {
            let from = plain(slots_of(batch), factors, light);
            let to = meso(slots_of(batch), factors, light);
            let moments = ToReliefParameters {
                common: evenly(relief, to),
                first_slot: 0,
                part: LOOSE_FACTORS,
            };
            gather_light(
                cmd,
                (&self.plain, &sets.plain),
                &from,
                batch,
                (light, without),
            );
            gather_light(cmd, (&self.evenly, &sets.evenly), &to, batch, (light, with));
            let set = &sets.to[light as usize];
            cmd.dispatch_indirect(&self.to, set, &moments, (&batch.loose_command, 0));
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
    }

    /// Elements with a relief take in by direction what was shot evenly.
    pub fn record_recalled(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        (relief, source_count): (&ReliefBuffers, u32),
        factors: &FactorBuffers,
    ) {
        let size = [groups(factors.meso_count), 1, 1];
        for light in [EMITTED, REFLECTED] {
            for first_slot in (0..source_count).step_by(RECALLED_SLOTS) {
                let end = source_count.min(first_slot + RECALLED_SLOTS as u32);
                let common = meso((0, end), factors, light);
                let parameters = ToReliefParameters {
                    common: evenly(relief, common),
                    first_slot,
                    part: KEPT_FACTORS,
                };
                cmd.dispatch(&self.to, &sets.recalled[light as usize], &parameters, size);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            }
        }
    }
}
