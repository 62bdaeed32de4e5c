//! Makes the part of rows that is one member's: what its elements receive of a source, drawn,
//! evaluated and coupled, whatever the light.
//!
//! Where there are several members, each draws its share of a batch's item buffers, and all give
//! these to one another.

use std::sync::Arc;

use super::coupling::CouplingRow;
use super::drawing::Drawing;
use super::estimate::Evaluate;
use super::exchange::Lent;
use super::rows::{MadeParts, RowPart, Stages};
use super::shared_items::{Asked, SharedItems, slots_of};
use super::{EmitterShadows, Settings};
use crate::constants::{FACES, RECEIVE_LISTS};
use crate::error::Result;
use crate::passes::batch::{Batch, BatchSize, Sight};
use crate::passes::buffers::SceneBuffers;
use crate::passes::couple::Couple;
use crate::passes::fresh_rows::FreshRows;
use crate::passes::keep::Keep;
use crate::passes::kept_rows::{KeptRows, SCRATCH};
use crate::passes::light_rows::LightRows;
use crate::passes::occluder_tree::OccluderTree;
use crate::passes::types::{CouplingTarget, KeptRow, KeptState, ReceiverList, Slot};
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

/// One more than the stages.
const STAMPS: u32 = 7;

/// What row makers of one device share.
pub(super) struct RowParts<'a> {
    pub settings: &'a Settings,
    pub scene: &'a SceneBuffers,
    pub targets: &'a [CouplingTarget],
    /// Elements with a relief.
    pub meso: Option<&'a Buffer>,
    pub fresh: &'a FreshRows,
    /// What hides places, for rays; the `pixel` estimator follows none.
    pub occluders: Option<&'a OccluderTree>,
    pub kept: &'a KeptRows,
    /// See [`super::shares::Share::parcels`].
    pub parcels: &'a [[u32; 2]],
    /// How many members there are.
    pub members: usize,
}

/// How a row maker finds what its sources see.
pub(super) enum Looks {
    /// Hemicubes of so many pixels a side.
    Hemicubes(u32),
    Rays,
    /// Rays to lights without surfaces.
    Lights {
        beams: bool,
    },
}

/// Makes parts of rows of the sources that it is asked for, [`SETS`] batches at a time.
pub(super) struct RowMaker {
    commands: [Commands; SETS],
    wanted: [Buffer; SETS],
    readback: [Buffer; SETS],
    timestamps: [Timestamps; SETS],
    /// Where there are other members that draw.
    shared: Option<SharedItems>,
    layout: Layout,
    lasting_chunks: u32,
    batch: Batch,
}

/// Batches that are evaluated at once: as many as there is room for rows without room.
pub(super) const SETS: usize = SCRATCH as usize;

impl RowMaker {
    pub fn new(device: &Arc<Device>, parts: &RowParts<'_>, looks: Looks) -> Result<Self> {
        let RowParts {
            settings,
            scene,
            fresh,
            kept,
            ..
        } = *parts;
        let (drawing, shared, batch) = match looks {
            Looks::Hemicubes(face) => {
                let slots = fresh.slot_count;
                let size = Drawing::fitting(device, scene, settings, slots, face);
                let drawn = BatchSize {
                    slots: size.slots.div_ceil(parts.members as u32),
                    ..size
                };
                let (drawing, drawn) = Drawing::new(device, scene, settings.culling, &drawn)?;
                let (shared, batch) = match parts.members {
                    1 => (None, drawn),
                    _ => {
                        let batch = Batch::of_hemicubes(device, &size)?;
                        let shared = SharedItems::new(device, &drawing, &drawn, &batch)?;
                        (Some(shared), batch)
                    }
                };
                let batch = match parts.occluders {
                    Some(tree) => batch.with_rays(tree),
                    None => batch,
                };
                (Some(drawing), shared, batch)
            }
            Looks::Rays | Looks::Lights { .. } => {
                let tree = parts.occluders.expect("rays have occluders").clone();
                let sight = Sight::Rays(tree);
                (None, None, Batch::new(device, fresh.slot_count, sight)?)
            }
        };
        let evaluate = match looks {
            Looks::Lights { beams } => {
                let rows = LightRows::new(device, scene, &batch, fresh, parts.meso, beams)?;
                Evaluate::Lights(rows)
            }
            _ => Evaluate::new(device, parts, &batch)?,
        };
        let couple = Couple::new(device, scene, &batch, fresh, parts.targets)?;
        let keep = Keep::new(device, &batch.slots, batch.slot_count, fresh, kept)?;
        let words = |count: u32| 4 * u64::from(count);
        let alone = drawing.as_ref().filter(|_| shared.is_none());
        let counts = alone.map(|drawing| &drawing.lists.counts);
        let list_bytes = u64::from(RECEIVE_LISTS) * size_of::<ReceiverList>() as u64;
        let parts_of_rows = [
            (Some(&batch.slots), size_of::<Slot>() as u64),
            (Some(&keep.rows), size_of::<KeptRow>() as u64),
            (Some(&couple.coupling), words(couple.word_count())),
            (counts, words(3 * FACES)),
            (Some(&fresh.facing_away), words(1)),
            (
                evaluate.sums().map(|of| &of.coupling),
                words(evaluate.sums().map_or(0, Couple::word_count)),
            ),
            (Some(&fresh.plain_lists.counts), list_bytes),
            (Some(&fresh.meso_lists.counts), list_bytes),
        ];
        let layout = Layout::new(batch.slot_count.into(), parts_of_rows);
        let make = |name, bytes, usage| {
            let buffer = || Buffer::new(device, name, bytes, usage);
            Ok::<_, crate::error::Error>([buffer()?, buffer()?])
        };
        let slot_bytes = u64::from(batch.slot_count) * size_of::<Slot>() as u64;
        let wanted = make("wanted sources", slot_bytes, BufferUse::Upload)?;
        let state_bytes = size_of::<KeptState>() as u64;
        let readback_bytes = layout.bytes + state_bytes;
        let readback = make("made rows", readback_bytes, BufferUse::Readback)?;
        let stamps = || Timestamps::new(device, "row timestamps", STAMPS);
        let timestamps = [stamps()?, stamps()?];
        let record = |i: usize| {
            Commands::record(device, "make rows", |cmd| {
                let stamps = &timestamps[i];
                let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
                cmd.reset_timestamps(stamps);
                cmd.barrier(&used, &[Stage::Transfer]);
                cmd.copy(&wanted[i], 0, &batch.slots, 0, slot_bytes);
                cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
                cmd.timestamp(stamps, 0);
                match (&drawing, &shared) {
                    (_, Some(shared)) => {
                        shared.take_in(cmd, i, &batch);
                        cmd.timestamp(stamps, 1);
                    }
                    (Some(drawing), None) => {
                        drawing.record(cmd, || cmd.timestamp(stamps, 1));
                    }
                    (None, None) => cmd.timestamp(stamps, 1),
                }
                cmd.timestamp(stamps, 2);
                let mut stamp = 2;
                evaluate.record(cmd, || {
                    stamp += 1;
                    cmd.timestamp(stamps, stamp);
                });
                cmd.timestamp(stamps, 5);
                couple.record(cmd);
                keep.record(cmd, i as u32);
                cmd.timestamp(stamps, 6);
                cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
                layout.record(cmd, &readback[i]);
                cmd.copy(&kept.state, 0, &readback[i], layout.bytes, state_bytes);
                cmd.read_back_timestamps(stamps);
                Ok(())
            })
        };
        Ok(Self {
            commands: [record(0)?, record(1)?],
            wanted,
            readback,
            timestamps,
            layout,
            lasting_chunks: kept.chunk_count(),
            shared,
            batch,
        })
    }

    /// Sources of a batch, at most.
    pub fn slots(&self) -> usize {
        self.batch.slot_count as usize
    }

    /// Whether item buffers are shared out.
    pub fn shares(&self) -> bool {
        self.shared.is_some()
    }

    /// Begins to draw this member's share of the item buffers, where they are shared out.
    ///
    /// # Errors
    /// A device that fails.
    pub fn draw(&mut self, asked: &Asked, exchange: Lent<'_>) -> Result<()> {
        match (&mut self.shared, exchange) {
            (Some(shared), Some(exchange)) => shared.draw(asked, exchange.place()),
            _ => Ok(()),
        }
    }

    /// Gives away what [`Self::draw`] has begun, once it is there.
    ///
    /// # Errors
    /// As [`Self::draw`]; another member that fails.
    pub fn give(&mut self, asked: &mut Asked, exchange: Lent<'_>) -> Result<()> {
        match (&mut self.shared, exchange) {
            (Some(shared), Some(exchange)) => shared.give(asked, exchange),
            _ => Ok(()),
        }
    }

    /// Begins to evaluate a batch as one of [`SETS`], with the item buffers of all members; where
    /// they are not shared out, it draws them first.
    ///
    /// # Errors
    /// As [`Self::give`].
    pub fn evaluate(&mut self, set: usize, asked: &Asked, exchange: Lent<'_>) -> Result<()> {
        if let (Some(shared), Some(exchange)) = (&mut self.shared, exchange) {
            shared.collect(asked, set, exchange)?;
        }
        let slots = slots_of(asked.sources.iter().copied(), self.slots());
        self.wanted[set].write(0, &slots);
        self.commands[set].submit()
    }

    /// Waits for the batch that was evaluated as this set. Returns what it made, and when on the
    /// device it began and ended.
    ///
    /// # Errors
    /// A device that fails.
    pub fn take(&mut self, set: usize, asked: Asked) -> Result<(MadeParts, [f64; 2])> {
        self.commands[set].wait()?;
        let row = |(slot, &source)| {
            let from = &self.readback[set];
            self.layout.read(slot, source, from, self.lasting_chunks)
        };
        let mut rows: Vec<RowPart> = (0..).zip(&asked.sources).map(row).collect();
        for (at, counts) in asked.counts {
            rows[at].counts = counts.to_vec();
        }
        let stamps = self.timestamps[set].seconds();
        let stage = |s: usize| (stamps[s + 1] - stamps[s]).max(0.0);
        let [cull, item_buffer, sort, rays, bin, keep] = std::array::from_fn(stage);
        let [culled, drawn] = asked.drawing;
        let stages = Stages {
            cull: cull + culled,
            item_buffer: item_buffer + drawn,
            sort,
            rays,
            bin,
            keep,
            idle: 0.0,
        };
        let KeptState {
            chunk,
            used,
            rows: kept,
        } = self.readback[set].read(self.layout.bytes, 1)[0];
        let made = MadeParts {
            rows,
            stages,
            state: [chunk, used, kept],
            given: asked.given,
        };
        Ok((made, [stamps[0], stamps[STAMPS as usize - 1]]))
    }

    /// The last batch.
    pub fn batch(&self) -> &Batch {
        &self.batch
    }
}

/// Where the parts of rows lie in a readback buffer: each part of all slots before the next.
struct Layout {
    slots: u64,
    parts: [Part; PARTS],
    bytes: u64,
}

struct Part {
    /// None of a part that is not read.
    from: Option<Buffer>,
    /// Of a slot.
    bytes: u64,
    at: u64,
}

const PARTS: usize = 8;
const SLOT: usize = 0;
const ROW: usize = 1;
const COUPLING: usize = 2;
const COUNTS: usize = 3;
const AWAY: usize = 4;
const SUMS: usize = 5;
const LISTS: usize = 6;
const MESO_LISTS: usize = 7;

impl Layout {
    /// Of these buffers, with the bytes of a slot.
    fn new(slots: u64, parts: [(Option<&Buffer>, u64); PARTS]) -> Self {
        let mut end = 0;
        let parts = parts.map(|(from, bytes)| {
            let (bytes, at) = (if from.is_some() { bytes } else { 0 }, end);
            end += slots * bytes;
            let from = from.cloned();
            Part { from, bytes, at }
        });
        Self {
            slots,
            parts,
            bytes: end,
        }
    }

    fn record(&self, cmd: &Commands, to: &Buffer) {
        for Part { from, bytes, at } in &self.parts {
            if let Some(from) = from {
                cmd.copy(from, 0, to, *at, bytes * self.slots);
            }
        }
    }

    fn read(&self, slot: u64, source: u32, from: &Buffer, lasting_chunks: u32) -> RowPart {
        let at = |part: usize| self.parts[part].at + slot * self.parts[part].bytes;
        let bytes = |part: usize| self.parts[part].bytes as usize;
        let drawn: Slot = from.read(at(SLOT), 1)[0];
        assert_eq!(drawn.source, source, "a slot holds what was asked for");
        let coupling: Vec<f32> = from.read(at(COUPLING), bytes(COUPLING) / 4);
        let place: KeptRow = from.read(at(ROW), 1)[0];
        RowPart {
            source,
            sums: from.read(at(SUMS), bytes(SUMS) / 4),
            coupling: CouplingRow::new(&coupling, 1.0),
            place: [place.chunk, place.first],
            has_room: place.chunk < lasting_chunks,
            counts: from.read(at(COUNTS), bytes(COUNTS) / size_of::<[u32; 3]>()),
            facing_away: from.read(at(AWAY), 1)[0],
            listed: std::array::from_fn(|list| {
                let of = |part| {
                    let lists: Vec<ReceiverList> = from.read(at(part), RECEIVE_LISTS as usize);
                    u64::from(lists[list].count)
                };
                of(LISTS) + of(MESO_LISTS)
            }),
        }
    }
}

/// Whether strong emitters are looked at with more care than all others.
pub(super) fn looks_closer(device: &Device, settings: &Settings) -> bool {
    emitter_looks(device, settings).is_some()
}

/// Pixels a side of the hemicubes of strong emitters, if they are drawn by hemicubes.
pub(super) fn emitter_face(device: &Device, settings: &Settings) -> u32 {
    match emitter_looks(device, settings) {
        Some(Looks::Hemicubes(face)) => face,
        _ => settings.hemicube,
    }
}

/// What strong emitters are looked at with, if not as all others are.
pub(super) fn emitter_looks(device: &Device, settings: &Settings) -> Option<Looks> {
    match settings.emitter_shadows() {
        EmitterShadows::Rays => Some(Looks::Rays),
        EmitterShadows::Hemicubes(face) => {
            let face = face.min(device.limits().max_image_side / 6 * 2);
            (face > settings.hemicube).then_some(Looks::Hemicubes(face))
        }
    }
}
