//! Makes the part of rows that is one member's: what its elements receive of a source, drawn,
//! evaluated and coupled, whatever the light.
//!
//! Where there are several members, each draws its share of a batch's item buffers, and all give
//! these to one another.

use std::collections::VecDeque;
use std::sync::Arc;

use super::coupling::CouplingRow;
use super::drawing::Drawing;
use super::estimate::Evaluate;
use super::exchange::Exchange;
use super::rows::{MadeParts, RowPart, Stages};
use super::shared_items::{Asked, SharedItems, slots_of};
use super::{EmitterShadows, Settings};
use crate::constants::{FACES, RECEIVE_LISTS};
use crate::error::Result;
use crate::passes::batch::{Batch, Sight};
use crate::passes::buffers::SceneBuffers;
use crate::passes::couple::Couple;
use crate::passes::fresh_rows::FreshRows;
use crate::passes::keep::Keep;
use crate::passes::kept_rows::KeptRows;
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
    /// Whether there are other members.
    pub shares: bool,
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

/// Makes parts of rows of the sources that it is asked for, two batches at a time.
pub(super) struct RowMaker {
    commands: [Commands; SETS],
    wanted: [Buffer; SETS],
    readback: [Buffer; SETS],
    timestamps: [Timestamps; SETS],
    /// Batches of which the item buffers are given away, oldest first.
    given: VecDeque<Asked>,
    /// Batches under way on the device, oldest first.
    asked: VecDeque<Asked>,
    /// Where there are other members that draw.
    shared: Option<SharedItems>,
    /// When the batch that was taken last ended, if another one waited for it.
    ended: Option<f64>,
    /// Which of the sets is submitted next.
    next: usize,
    layout: Layout,
    lasting_chunks: u32,
    batch: Batch,
}

/// Batches under way at once: as many as there is room for rows without room.
const SETS: usize = crate::passes::kept_rows::SCRATCH as usize;

impl RowMaker {
    pub fn new(device: &Arc<Device>, parts: &RowParts<'_>, looks: Looks) -> Result<Self> {
        let RowParts {
            settings,
            scene,
            fresh,
            kept,
            ..
        } = *parts;
        let (drawing, batch) = match looks {
            Looks::Hemicubes(face) => {
                let slots = fresh.slot_count;
                let size = Drawing::fitting(device, scene, settings, slots, face);
                let (drawing, batch) = Drawing::new(device, scene, settings.culling, &size)?;
                let batch = match parts.occluders {
                    Some(tree) => batch.with_rays(tree),
                    None => batch,
                };
                (Some(drawing), batch)
            }
            Looks::Rays | Looks::Lights { .. } => {
                let tree = parts.occluders.expect("rays have occluders").clone();
                let sight = Sight::Rays(tree);
                (None, Batch::new(device, fresh.slot_count, sight)?)
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
        let shared = match (&drawing, parts.shares) {
            (Some(drawing), true) => Some(SharedItems::new(device, scene, drawing, &batch)?),
            _ => None,
        };
        let words = |count: u32| 4 * u64::from(count);
        let counts = match &batch.sight {
            Sight::Hemicubes(hemicubes) if shared.is_none() => Some(&hemicubes.counts),
            _ => None,
        };
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
                        shared.take_in(cmd, &batch);
                        cmd.timestamp(stamps, 1);
                    }
                    (Some(drawing), None) => {
                        drawing.record(cmd, scene, &batch, || cmd.timestamp(stamps, 1));
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
                cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
                Ok(())
            })
        };
        Ok(Self {
            commands: [record(0)?, record(1)?],
            wanted,
            readback,
            timestamps,
            given: VecDeque::new(),
            asked: VecDeque::new(),
            ended: None,
            next: 0,
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

    /// Begins a batch; two may be under way. Where there are other members, this one draws its
    /// share of the item buffers and gives them away; [`Self::go_on`] does the rest.
    ///
    /// # Errors
    /// A device that fails; another member that does.
    pub fn submit(&mut self, sources: &[u32], exchange: Option<&mut dyn Exchange>) -> Result<()> {
        assert!(sources.len() <= self.slots() && self.asked.len() + self.given.len() < SETS);
        let mut asked = Asked {
            sources: sources.to_vec(),
            counts: Vec::new(),
            drawing: [0.0; 2],
            given: 0,
        };
        if let (Some(shared), Some(exchange)) = (&mut self.shared, exchange) {
            shared.draw(&mut asked, exchange)?;
            self.given.push_back(asked);
            return Ok(());
        }
        self.evaluate(asked)
    }

    /// Goes on with the oldest batch of which the item buffers are given away, once all others have
    /// given theirs. Whether there was one.
    ///
    /// # Errors
    /// As [`Self::submit`].
    pub fn go_on(&mut self, exchange: Option<&mut dyn Exchange>) -> Result<bool> {
        let (Some(shared), Some(exchange)) = (&mut self.shared, exchange) else {
            return Ok(false);
        };
        let Some(asked) = self.given.pop_front() else {
            return Ok(false);
        };
        // The item buffers of the batch before may still be read.
        self.commands[(self.next + SETS - 1) % SETS].wait()?;
        shared.collect(&asked, exchange)?;
        self.evaluate(asked)?;
        Ok(true)
    }

    fn evaluate(&mut self, asked: Asked) -> Result<()> {
        let slots = slots_of(asked.sources.iter().copied(), self.slots());
        self.wanted[self.next].write(0, &slots);
        self.commands[self.next].submit()?;
        self.asked.push_back(asked);
        self.next = (self.next + 1) % SETS;
        Ok(())
    }

    /// Waits for the oldest batch under way; none if there is none.
    ///
    /// # Errors
    /// As [`Self::submit`].
    pub fn take(&mut self, exchange: Option<&mut dyn Exchange>) -> Result<Option<MadeParts>> {
        if self.asked.is_empty() {
            self.go_on(exchange)?;
        }
        let Some(asked) = self.asked.pop_front() else {
            return Ok(None);
        };
        let i = (self.next + SETS - self.asked.len() - 1) % SETS;
        self.commands[i].wait()?;
        let row = |(slot, &source)| {
            let from = &self.readback[i];
            self.layout.read(slot, source, from, self.lasting_chunks)
        };
        let mut rows: Vec<RowPart> = (0..).zip(&asked.sources).map(row).collect();
        for (at, counts) in asked.counts {
            rows[at].counts = counts.to_vec();
        }
        let stamps = self.timestamps[i].seconds()?;
        let stage = |s: usize| (stamps[s + 1] - stamps[s]).max(0.0);
        let [cull, item_buffer, sort, rays, bin, keep] = std::array::from_fn(stage);
        let idle = self.ended.map_or(0.0, |ended| (stamps[0] - ended).max(0.0));
        self.ended = (stamps.last().copied()).filter(|_| !self.asked.is_empty());
        let [culled, drawn] = asked.drawing;
        let stages = Stages {
            cull: cull + culled,
            item_buffer: item_buffer + drawn,
            sort,
            rays,
            bin,
            keep,
            idle,
        };
        let KeptState {
            chunk,
            used,
            rows: kept,
        } = self.readback[i].read(self.layout.bytes, 1)[0];
        Ok(Some(MadeParts {
            rows,
            stages,
            state: [chunk, used, kept],
            given: asked.given,
        }))
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
