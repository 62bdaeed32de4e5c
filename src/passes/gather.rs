//! Gathers light from kept rows: irradiance of every element, and of elements with a relief the
//! moments of their light. Shaders: `gather.comp`, and where a scene has relief
//! `gather_from_relief.comp` and `gather_to_relief.comp`.

use std::ops::Range;
use std::sync::Arc;

use super::buffers::{SceneBuffers, State, write};
use super::groups;
use super::kept_rows::KeptRows;
use super::relief_buffers::ReliefBuffers;
use super::shaders::{gather, gather_from_relief, gather_to_relief};
use super::types::{KeptRow, Slot};
use crate::error::Result;
use crate::vk::{
    Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage, TEXEL_BYTES,
};

/// Rows and the light that their sources send; the rows of one chunk behind one another.
pub struct GatherList {
    /// `[slot]`
    pub slots: Buffer,
    /// Light times the scale of the form factors and the first word of the row,
    /// `[slot][emitted, reflected]`.
    lit: Buffer,
}

impl GatherList {
    /// For as many rows at most.
    pub fn new(device: &Arc<Device>, most: u32) -> Result<Self> {
        let most = u64::from(most);
        let slots = most * size_of::<Slot>() as u64;
        Ok(Self {
            slots: Buffer::new(device, "gathered sources", slots, BufferUse::Storage)?,
            lit: Buffer::new(
                device,
                "lit rows",
                2 * TEXEL_BYTES * most,
                BufferUse::Texels,
            )?,
        })
    }

    /// Lists these rows from the first slot on.
    pub fn write(&self, device: &Arc<Device>, slots: &[Slot], rows: &[KeptRow]) -> Result<()> {
        let lit: Vec<[u32; 4]> = (slots.iter().zip(rows))
            .flat_map(|(slot, row)| {
                [slot.emitted, slot.reflected].map(|light| {
                    let [r, g, b] = (light * slot.scale).to_array().map(f32::to_bits);
                    [r, g, b, row.first]
                })
            })
            .collect();
        write(device, &self.slots, slots)?;
        write(device, &self.lit, &lit)
    }
}

/// The light that a dispatch takes of a list: its two sums are kept apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    Emitted,
    Reflected,
}

/// Gathering to the elements without relief, and to those with one.
pub struct Gather {
    plain: ComputePipeline,
    meso: Option<ComputePipeline>,
}

/// For each chunk of rows.
pub struct Sets(Vec<ChunkSets>);

/// For emitted and for reflected light.
struct ChunkSets {
    plain: [DescriptorSet; 2],
    meso: Option<[DescriptorSet; 2]>,
}

/// Slots whose rows lie in one chunk.
#[derive(Debug, Clone)]
pub struct ChunkSlots {
    pub chunk: u32,
    pub slots: Range<u32>,
}

/// What the sets of a chunk bind for one part of the light.
#[derive(Clone, Copy)]
struct Bound<'a> {
    list: &'a GatherList,
    scene: &'a SceneBuffers,
    /// The chunk.
    words: &'a Buffer,
    irradiance: &'a Buffer,
    irradiance_error: &'a Buffer,
}

/// Slots of a dispatch: a software device ends a shader's loops after 65,535 turns of all together.
const MOST_SLOTS: u32 = 1024;

impl Gather {
    pub fn new(device: &Arc<Device>, with_relief: bool) -> Result<Self> {
        let lanes = [device.limits().subgroup_size];
        let make = |name, shader| ComputePipeline::in_subgroups(device, name, shader, &lanes);
        Ok(match with_relief {
            false => Self {
                plain: make("gather", &gather::SHADER)?,
                meso: None,
            },
            true => Self {
                plain: make("gather from relief", &gather_from_relief::SHADER)?,
                meso: Some(make("gather to relief", &gather_to_relief::SHADER)?),
            },
        })
    }

    pub fn bind(
        &self,
        scene: &SceneBuffers,
        state: &State,
        kept: &KeptRows,
        list: &GatherList,
        relief: Option<&ReliefBuffers>,
    ) -> Result<Sets> {
        let sets = |words: &Buffer| {
            let emitted = Bound {
                list,
                scene,
                words,
                irradiance: &state.direct,
                irradiance_error: &state.direct_error,
            };
            let reflected = Bound {
                irradiance: &state.indirect,
                irradiance_error: &state.indirect_error,
                ..emitted
            };
            let meso = match (&self.meso, relief) {
                (Some(pipeline), Some(relief)) => Some([
                    bind_meso(pipeline, &emitted, relief, &relief.moments_direct)?,
                    bind_meso(pipeline, &reflected, relief, &relief.moments_indirect)?,
                ]),
                _ => None,
            };
            let plain = [
                bind_plain(&self.plain, &emitted, relief)?,
                bind_plain(&self.plain, &reflected, relief)?,
            ];
            Ok(ChunkSets { plain, meso })
        };
        Ok(Sets(kept.chunks.iter().map(sets).collect::<Result<_>>()?))
    }

    /// One part of the light of `slots` of the list, in steps that software devices finish.
    pub fn record(
        &self,
        cmd: &Commands,
        sets: &Sets,
        kept: &KeptRows,
        of: &ChunkSlots,
        part: Part,
    ) {
        let shape = kept.shape;
        let slots = &of.slots;
        let set = &sets.0[of.chunk as usize].plain[part as usize];
        for first in slots.clone().step_by(MOST_SLOTS as usize) {
            let parameters = gather::Parameters {
                first_element: 0,
                element_count: shape.plain_count,
                first_slot: first,
                end_slot: slots.end.min(first + MOST_SLOTS),
                first_block: 0,
                reflected: (part == Part::Reflected).into(),
            };
            let size = [groups(shape.plain_count), 1, 1];
            cmd.dispatch(&self.plain, set, &parameters, size);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
    }

    /// As [`Self::record`] in a scene with relief, for [`ReliefBuffers::slots`] slots at most, of
    /// which [`super::send_relief`] has found what they send by direction.
    pub fn record_relief(
        &self,
        cmd: &Commands,
        sets: &Sets,
        kept: &KeptRows,
        relief: &ReliefBuffers,
        of: &ChunkSlots,
        part: Part,
    ) {
        let shape = kept.shape;
        let slots = &of.slots;
        let sets = &sets.0[of.chunk as usize];
        // Both shaders have the same.
        let plain = gather_from_relief::Parameters {
            first_element: 0,
            element_count: shape.plain_count,
            first_slot: slots.start,
            end_slot: slots.end,
            first_block: 0,
            reflected: (part == Part::Reflected).into(),
            first_relief_source: relief.first_source,
            relief_source_count: relief.source_count,
            cells: relief.cells(),
        };
        let meso = gather_from_relief::Parameters {
            first_element: shape.plain_count,
            element_count: shape.meso_count,
            first_block: shape.plain_blocks(),
            ..plain
        };
        let light = part as usize;
        if shape.plain_count > 0 {
            let size = [groups(shape.plain_count), 1, 1];
            cmd.dispatch(&self.plain, &sets.plain[light], &plain, size);
        }
        if let (Some(pipeline), Some(sets)) = (&self.meso, &sets.meso) {
            let size = [groups(shape.meso_count), 1, 1];
            cmd.dispatch(pipeline, &sets[light], &meso, size);
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}

fn bind_plain(
    pipeline: &ComputePipeline,
    on: &Bound<'_>,
    relief: Option<&ReliefBuffers>,
) -> Result<DescriptorSet> {
    let Some(relief) = relief else {
        let bindings = gather::Bindings {
            lit_rows: &on.list.lit,
            irradiance: on.irradiance,
            irradiance_error: on.irradiance_error,
            words: on.words,
        };
        return pipeline.bind("gather", &bindings);
    };
    let bindings = gather_from_relief::Bindings {
        lit_rows: &on.list.lit,
        irradiance: on.irradiance,
        irradiance_error: on.irradiance_error,
        words: on.words,
        slots: &on.list.slots,
        exits: &relief.exits,
        sources: &on.scene.sources,
        balls: &on.scene.balls,
    };
    pipeline.bind("gather from relief", &bindings)
}

fn bind_meso(
    pipeline: &ComputePipeline,
    on: &Bound<'_>,
    relief: &ReliefBuffers,
    moments: &Buffer,
) -> Result<DescriptorSet> {
    let bindings = gather_to_relief::Bindings {
        lit_rows: &on.list.lit,
        irradiance: on.irradiance,
        irradiance_error: on.irradiance_error,
        words: on.words,
        slots: &on.list.slots,
        exits: &relief.exits,
        sources: &on.scene.sources,
        balls: &on.scene.balls,
        meso_elements: &relief.elements,
        albedos: &relief.albedos,
        moments,
        meso_reflected: &relief.reflected,
    };
    pipeline.bind("gather to relief", &bindings)
}
