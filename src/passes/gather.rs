//! Gathers light from kept rows: irradiance of every element, and of elements with a relief the
//! moments and coefficients of their light. Shaders: `gather.comp`, and where a scene has relief
//! `gather_from_relief.comp` and `gather_to_relief.comp`.

use std::ops::Range;
use std::sync::Arc;

use super::buffers::{SceneBuffers, State};
use super::fresh_rows::RowShape;
use super::groups;
use super::kept_rows::KeptRows;
use super::relief_buffers::ReliefBuffers;
use super::shaders::{gather, gather_from_relief, gather_to_relief};
use super::types::{KeptRow, Slot};
use crate::constants::GROUP;
use crate::error::Result;
use crate::meso::RANK;
use crate::vk::{
    BoundCompute, Buffer, BufferUse, Commands, ComputePipeline, Device, Stage, TEXEL_BYTES,
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
    pub fn write(&self, slots: &[Slot], rows: &[KeptRow]) -> Result<()> {
        let lit: Vec<[u32; 4]> = (slots.iter().zip(rows))
            .flat_map(|(slot, row)| {
                [slot.emitted, slot.reflected].map(|light| {
                    let [r, g, b] = (light * slot.scale).to_array().map(f32::to_bits);
                    [r, g, b, row.first]
                })
            })
            .collect();
        self.slots.set(slots)?;
        self.lit.set(&lit)
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
    shape: RowShape,
    /// Of a subgroup.
    lanes: u32,
    /// For the elements without relief, and what is the same for all.
    parameters: gather::Parameters,
    /// Of the elements with a relief, the first.
    first_meso: u32,
    /// For each chunk of rows.
    chunks: Vec<OfChunk>,
}

/// Bound to a chunk, for emitted and for reflected light.
struct OfChunk {
    plain: [BoundCompute; 2],
    meso: Option<[BoundCompute; 2]>,
}

/// Slots whose rows lie in one chunk, of those that are added up together.
#[derive(Debug, Clone)]
pub struct ChunkSlots {
    pub chunk: u32,
    pub slots: Range<u32>,
    /// All that are added up together: other chunks hold the others.
    pub of: Range<u32>,
}

/// What is bound for one part of the light.
#[derive(Clone, Copy)]
struct On<'a> {
    list: &'a GatherList,
    scene: &'a SceneBuffers,
    /// The chunk.
    words: &'a Buffer,
    irradiance: &'a Buffer,
    irradiance_error: &'a Buffer,
    /// Sums so far, to elements without and with a relief.
    partial: [&'a Buffer; 2],
}

/// Slots of a dispatch: a software device ends a shader's loops after 65,535 turns of all together.
const MOST_SLOTS: u32 = 1024;

/// Elements times rows of a part of a submission, at most, and where some have a relief: 0.1 to
/// 0.3 s by lavapipe's two cores.
const PART_PAIRS: u32 = 1 << 26;
const RELIEF_PAIRS: u32 = 1 << 21;

/// Rows that are gathered at once, at most.
pub fn most_rows(elements: u32, relief: Option<&ReliefBuffers>) -> u32 {
    let most = match relief {
        None => PART_PAIRS / elements.max(1),
        Some(relief) => relief.slots.min(RELIEF_PAIRS / elements.max(1)),
    };
    most.clamp(1, MOST_SLOTS)
}

impl Gather {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        state: &State,
        kept: &KeptRows,
        list: &GatherList,
        relief: Option<&ReliefBuffers>,
    ) -> Result<Self> {
        let lanes = [device.limits().subgroup_size];
        let make = |name, shader| ComputePipeline::in_subgroups(device, name, shader, &lanes);
        let plain = match relief {
            None => make("gather", &gather::SHADER)?,
            Some(_) => make("gather from relief", &gather_from_relief::SHADER)?,
        };
        let meso = match relief {
            None => None,
            Some(relief) => Some((make("gather to relief", &gather_to_relief::SHADER)?, relief)),
        };
        let shape = kept.shape;
        let meso_sums = 1 + RANK as u64;
        let partial = [
            ("partial light", u64::from(shape.plain.count)),
            (
                "partial light of relief",
                meso_sums * u64::from(shape.meso.count),
            ),
        ];
        let [plain_partial, meso_partial] =
            partial.map(|(name, sums)| Buffer::new(device, name, 12 * sums, BufferUse::Storage));
        let (plain_partial, meso_partial) = (plain_partial?, meso_partial?);
        let bind = |words: &Buffer| {
            let emitted = On {
                list,
                scene,
                words,
                irradiance: &state.direct,
                irradiance_error: &state.direct_error,
                partial: [&plain_partial, &meso_partial],
            };
            let reflected = On {
                irradiance: &state.indirect,
                irradiance_error: &state.indirect_error,
                ..emitted
            };
            let meso = match &meso {
                Some((pipeline, relief)) => Some([
                    bind_meso(pipeline, &emitted, relief, &relief.moments_direct)?,
                    bind_meso(pipeline, &reflected, relief, &relief.moments_indirect)?,
                ]),
                None => None,
            };
            let plain = [
                bind_plain(&plain, &emitted, relief)?,
                bind_plain(&plain, &reflected, relief)?,
            ];
            Ok(OfChunk { plain, meso })
        };
        let none = (0, 0, [[0; 2]; 2]);
        let (first_relief_source, relief_source_count, [cells, kept_cells]) =
            relief.map_or(none, |r| {
                (
                    r.shape.first_source,
                    r.shape.source_count,
                    [r.shape.cells(), r.shape.kept_cells()],
                )
            });
        Ok(Self {
            shape,
            lanes: lanes[0],
            parameters: gather::Parameters {
                first_element: shape.plain.first,
                element_count: shape.plain.count,
                first_slot: 0,
                end_slot: 0,
                first_exit: 0,
                first_block: 0,
                reflected: 0,
                first_relief_source,
                relief_source_count,
                cells,
                kept_cells,
                continues: 0,
                is_continued: 0,
                first_meso: 0,
            },
            first_meso: relief.map_or(0, |relief| shape.meso.first - relief.shape.first_element),
            chunks: kept.chunks.iter().map(bind).collect::<Result<_>>()?,
        })
    }

    /// One part of the light of these slots of the list, no more than [`most_rows`]. With relief
    /// [`super::send_relief`] has found what they send by direction.
    pub fn record(&self, cmd: &Commands, of: &ChunkSlots, part: Part) {
        let shape = self.shape;
        let light = part as usize;
        let bound = &self.chunks[of.chunk as usize];
        let plain = gather::Parameters {
            first_slot: of.slots.start,
            end_slot: of.slots.end,
            first_exit: of.of.start,
            continues: (of.slots.start > of.of.start).into(),
            is_continued: (of.slots.end < of.of.end).into(),
            reflected: (part == Part::Reflected).into(),
            ..self.parameters
        };
        let size = [groups(shape.plain.count), 1, 1];
        cmd.dispatch(&bound.plain[light], &plain, size);
        if let Some(bound) = &bound.meso {
            let meso = gather::Parameters {
                first_element: shape.meso.first,
                element_count: shape.meso.count,
                first_block: shape.plain_blocks(),
                first_meso: self.first_meso,
                ..plain
            };
            let parts = GROUP.div_ceil(self.lanes);
            let size = [groups(shape.meso.count), parts, 1];
            cmd.dispatch(&bound[light], &meso, size);
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}

fn bind_plain(
    pipeline: &ComputePipeline,
    on: &On<'_>,
    relief: Option<&ReliefBuffers>,
) -> Result<BoundCompute> {
    let Some(relief) = relief else {
        let bindings = gather::Bindings {
            lit_rows: &on.list.lit,
            irradiance: on.irradiance,
            irradiance_error: on.irradiance_error,
            words: on.words,
            partial_sums: on.partial[0],
        };
        return pipeline.bind(&bindings);
    };
    let bindings = gather_from_relief::Bindings {
        lit_rows: &on.list.lit,
        irradiance: on.irradiance,
        irradiance_error: on.irradiance_error,
        words: on.words,
        partial_sums: on.partial[0],
        slots: &on.list.slots,
        exits: &relief.exits,
        sources: &on.scene.sources,
        balls: &on.scene.balls,
    };
    pipeline.bind(&bindings)
}

fn bind_meso(
    pipeline: &ComputePipeline,
    on: &On<'_>,
    relief: &ReliefBuffers,
    moments: &Buffer,
) -> Result<BoundCompute> {
    let bindings = gather_to_relief::Bindings {
        lit_rows: &on.list.lit,
        irradiance: on.irradiance,
        irradiance_error: on.irradiance_error,
        words: on.words,
        partial_sums: on.partial[1],
        slots: &on.list.slots,
        exits: &relief.exits,
        sources: &on.scene.sources,
        balls: &on.scene.balls,
        meso_elements: &relief.elements,
        albedos: &relief.albedos,
        moments,
        meso_reflected: &relief.reflected,
        bases: &relief.bases,
        coefficients: &relief.coefficients,
    };
    pipeline.bind(&bindings)
}
