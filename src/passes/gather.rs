//! Gathers light from kept rows: irradiance of every element, and of elements with a relief the
//! moments of their light. Shaders: `gather.comp`, and where a scene has relief
//! `gather_from_relief.comp` and `gather_to_relief.comp`.

use std::ops::Range;
use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::buffers::{SceneBuffers, State, write};
use super::kept_rows::KeptRows;
use super::relief_buffers::ReliefBuffers;
use super::types::{KeptRow, Slot};
use super::{groups, shaders};
use crate::error::Result;
use crate::vk::{
    Bind, Binding, Buffer, BufferUse, Commands, ComputePipeline, DescriptorSet, Device, Stage,
    TEXEL_BYTES,
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

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    first_element: u32,
    element_count: u32,
    first_slot: u32,
    end_slot: u32,
    first_block: u32,
    /// 0: emitted light, 1: reflected.
    reflected: u32,
    /// Of scenes with relief alone.
    first_relief_source: u32,
    relief_source_count: u32,
    cells: [u32; 2],
}

/// Bytes of [`Parameters`] in a scene without relief.
const PLAIN_BYTES: usize = 24;
/// How many bindings each shader has, and those that are texels.
const PLAIN: usize = 4;
const FROM_RELIEF: usize = PLAIN + 4;
const LIT_ROWS: usize = 0;
const WORDS: usize = 3;
const SOURCES: usize = 6;
const TO_RELIEF: usize = FROM_RELIEF + 4;

/// Slots of a dispatch: a software device ends a shader's loops after 65,535 turns of all together.
const MOST_SLOTS: u32 = 1024;

impl Gather {
    pub fn new(device: &Arc<Device>, with_relief: bool) -> Result<Self> {
        let lanes = [device.limits().subgroup_size];
        let make = |name, spirv, bindings: usize, bytes| {
            let mut kinds = vec![Binding::Storage; bindings];
            kinds[LIT_ROWS] = Binding::Texels;
            kinds[WORDS] = Binding::Texels;
            if bindings > PLAIN {
                kinds[SOURCES] = Binding::Texels;
            }
            ComputePipeline::new(device, name, spirv, &kinds, bytes, &lanes, true)
        };
        if !with_relief {
            let plain = make("gather", shaders::GATHER_COMP, PLAIN, PLAIN_BYTES)?;
            return Ok(Self { plain, meso: None });
        }
        let bytes = size_of::<Parameters>();
        let from = shaders::GATHER_FROM_RELIEF_COMP;
        let to = shaders::GATHER_TO_RELIEF_COMP;
        Ok(Self {
            plain: make("gather from relief", from, FROM_RELIEF, bytes)?,
            meso: Some(make("gather to relief", to, TO_RELIEF, bytes)?),
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
        let sets = |chunk: &Buffer| {
            let light = |irradiance, error| {
                let mut binds = vec![Bind::Texels(&list.lit)];
                binds.extend([irradiance, error].map(Bind::Buffer));
                binds.push(Bind::Texels(chunk));
                if let Some(relief) = relief {
                    binds.extend([&list.slots, &relief.exits].map(Bind::Buffer));
                    binds.push(Bind::Texels(&scene.sources));
                    binds.push(Bind::Buffer(&scene.balls));
                }
                binds
            };
            let plain = [
                light(&state.direct, &state.direct_error),
                light(&state.indirect, &state.indirect_error),
            ];
            let meso = match (&self.meso, relief) {
                (Some(pipeline), Some(relief)) => {
                    let mut meso = plain.clone();
                    let moments = [&relief.moments_direct, &relief.moments_indirect];
                    for (binds, moments) in meso.iter_mut().zip(moments) {
                        let receiving = [&relief.elements, &relief.albedos, moments];
                        binds.extend(receiving.map(Bind::Buffer));
                        binds.push(Bind::Buffer(&relief.reflected));
                    }
                    Some(both(pipeline, "gather to relief", &meso)?)
                }
                _ => None,
            };
            Ok(ChunkSets {
                plain: both(&self.plain, "gather", &plain)?,
                meso,
            })
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
            let parameters = Parameters {
                first_element: 0,
                element_count: shape.plain_count,
                first_slot: first,
                end_slot: slots.end.min(first + MOST_SLOTS),
                first_block: 0,
                reflected: (part == Part::Reflected).into(),
                first_relief_source: 0,
                relief_source_count: 0,
                cells: [0, 0],
            };
            let bytes = &bytemuck::bytes_of(&parameters)[..PLAIN_BYTES];
            let push: [u8; PLAIN_BYTES] = bytes.try_into().expect("as many bytes");
            let size = [groups(shape.plain_count), 1, 1];
            cmd.dispatch(&self.plain, set, &push, size);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
    }

    /// As [`Self::record`] in a scene with relief, for [`ReliefBuffers::slots`] slots at most, of which
    /// [`super::send_relief`] has found what they send by direction.
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
        let plain = Parameters {
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
        let meso = Parameters {
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

/// For emitted and for reflected light.
fn both(
    pipeline: &ComputePipeline,
    name: &str,
    binds: &[Vec<Bind<'_>>; 2],
) -> Result<[DescriptorSet; 2]> {
    Ok([
        pipeline.bind(name, &binds[0])?,
        pipeline.bind(name, &binds[1])?,
    ])
}
