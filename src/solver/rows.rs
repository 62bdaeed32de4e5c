//! Makes rows: what a source gives each element, drawn, evaluated, normalised and coupled. Any
//! device that holds the scene can, whatever the light.

use std::collections::VecDeque;
use std::ops::AddAssign;
use std::sync::Arc;

use serde::Serialize;

use super::coupling::CouplingRow;
use super::drawing::{Drawing, read_items};
use super::estimate::Evaluate;
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

/// The row of one source, and what was counted while it was made.
pub(super) struct Row {
    pub source: u32,
    /// Of all form factors.
    pub scale: f32,
    /// Share of the source that its form factors take together, before they are scaled; none of a
    /// point light, and in open scenes.
    pub share: Option<f32>,
    pub coupling: CouplingRow,
    pub factors: Factors,
    /// `[face]`: meshlets kept, triangles tested, triangles drawn. Empty where rays found what is
    /// seen.
    pub counts: Vec<[u32; 3]>,
    /// Elements that see nothing of the source, whatever stands between.
    pub facing_away: u32,
    /// Elements in each of the lists of receivers, by how their form factor is found.
    pub listed: [u64; RECEIVE_LISTS as usize],
}

/// Where the form factors of a row are.
pub(super) enum Factors {
    /// On the device that made them.
    Kept(KeptRow),
    /// In the host's memory.
    Host(FactorWords),
}

/// Form factors as they lie on the device before they are kept.
pub(super) struct FactorWords {
    pub plain: Vec<u32>,
    pub meso: Vec<u32>,
    pub occupied: Vec<u32>,
}

/// Seconds of each stage of a batch, by GPU timestamps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Stages {
    pub cull: f64,
    pub item_buffer: f64,
    /// Finding which elements see the sources by the item buffers, or by rays to strong emitters.
    pub sort: f64,
    /// Rays where that leaves open what an element sees.
    pub rays: f64,
    /// Form factors, normalised.
    pub bin: f64,
    /// Coupling the sources, and keeping the form factors.
    pub keep: f64,
    /// From the end of a batch to the beginning of the next, which was waiting.
    pub idle: f64,
}

/// One more than the stages.
const STAMPS: u32 = 7;

impl Stages {
    /// From item buffers to form factors.
    pub fn form_factors(&self) -> f64 {
        self.sort + self.rays + self.bin
    }
}

impl AddAssign for Stages {
    fn add_assign(&mut self, other: Self) {
        self.cull += other.cull;
        self.item_buffer += other.item_buffer;
        self.sort += other.sort;
        self.rays += other.rays;
        self.bin += other.bin;
        self.keep += other.keep;
        self.idle += other.idle;
    }
}

/// A batch of rows.
pub(super) struct Made {
    pub rows: Vec<Row>,
    pub stages: Stages,
    /// How far the chunks of kept rows were filled then; none where nothing is kept.
    pub state: Option<KeptState>,
}

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
    /// Where rows are kept; without it they come to the host.
    pub kept: Option<&'a KeptRows>,
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

/// Makes rows of the sources that it is asked for, two batches at a time.
pub(super) struct RowMaker {
    commands: [Commands; SETS],
    wanted: [Buffer; SETS],
    readback: [Buffer; SETS],
    timestamps: [Timestamps; SETS],
    /// The sources of the batches under way, oldest first.
    asked: VecDeque<Vec<u32>>,
    /// When the batch that was taken last ended, if another one waited for it.
    ended: Option<f64>,
    /// Which of the sets is submitted next.
    next: usize,
    layout: Layout,
    /// Whether rows stay on the device.
    keeps: bool,
    device: Arc<Device>,
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
            _ => Evaluate::new(device, settings, scene, parts.meso, &batch, fresh)?,
        };
        let couple = Couple::new(device, scene, &batch, fresh, parts.targets)?;
        let keep = (parts.kept)
            .map(|kept| Keep::new(device, &batch.slots, batch.slot_count, fresh, kept))
            .transpose()?;
        let words = |count: u32| 4 * u64::from(count);
        let counts = match &batch.sight {
            Sight::Hemicubes(hemicubes) => Some(&hemicubes.counts),
            Sight::Rays(_) => None,
        };
        let (kept, shape) = (keep.is_some(), fresh.shape);
        let to_host = |buffer| (!kept).then_some(buffer);
        let list_bytes = u64::from(RECEIVE_LISTS) * size_of::<ReceiverList>() as u64;
        let parts_of_rows = [
            (Some(&batch.slots), size_of::<Slot>() as u64),
            (keep.as_ref().map(|k| &k.rows), size_of::<KeptRow>() as u64),
            (Some(&couple.coupling), words(couple.word_count())),
            (counts, words(3 * FACES)),
            (Some(&fresh.facing_away), words(1)),
            (evaluate.shares(), words(1)),
            (Some(&fresh.plain_lists.counts), list_bytes),
            (Some(&fresh.meso_lists.counts), list_bytes),
            (to_host(&fresh.plain), words(shape.plain_count)),
            (to_host(&fresh.meso), words(3 * shape.meso_count)),
            (to_host(&fresh.occupied), words(shape.blocks())),
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
                match &drawing {
                    Some(drawing) => {
                        drawing.record(cmd, scene, &batch, || cmd.timestamp(stamps, 1));
                    }
                    None => cmd.timestamp(stamps, 1),
                }
                cmd.timestamp(stamps, 2);
                let mut stamp = 2;
                evaluate.record(cmd, || {
                    stamp += 1;
                    cmd.timestamp(stamps, stamp);
                });
                cmd.timestamp(stamps, 5);
                couple.record(cmd);
                if let Some(keep) = &keep {
                    keep.record(cmd, i as u32);
                }
                cmd.timestamp(stamps, 6);
                cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
                layout.record(cmd, &readback[i]);
                if let Some(kept) = parts.kept {
                    cmd.copy(&kept.state, 0, &readback[i], layout.bytes, state_bytes);
                }
                cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
                Ok(())
            })
        };
        Ok(Self {
            commands: [record(0)?, record(1)?],
            wanted,
            readback,
            timestamps,
            asked: VecDeque::new(),
            ended: None,
            next: 0,
            layout,
            keeps: kept,
            device: Arc::clone(device),
            batch,
        })
    }

    /// Sources of a batch, at most.
    pub fn slots(&self) -> usize {
        self.batch.slot_count as usize
    }

    /// Begins a batch; two may be under way.
    pub fn submit(&mut self, sources: &[u32]) -> Result<()> {
        assert!(sources.len() <= self.slots() && self.asked.len() < SETS);
        let mut slots = vec![Slot::EMPTY; self.slots()];
        for (slot, &source) in slots.iter_mut().zip(sources) {
            *slot = Slot::of(source);
        }
        self.wanted[self.next].write(0, &slots);
        self.commands[self.next].submit()?;
        self.asked.push_back(sources.to_vec());
        self.next = (self.next + 1) % SETS;
        Ok(())
    }

    /// Waits for the oldest batch under way; none if there is none.
    pub fn take(&mut self) -> Result<Option<Made>> {
        let Some(sources) = self.asked.pop_front() else {
            return Ok(None);
        };
        let i = (self.next + SETS - self.asked.len() - 1) % SETS;
        self.commands[i].wait()?;
        let row = |(slot, &source)| self.layout.read(slot, source, &self.readback[i]);
        let rows = (0..).zip(&sources).map(row).collect();
        let stamps = self.timestamps[i].seconds()?;
        let stage = |s: usize| (stamps[s + 1] - stamps[s]).max(0.0);
        let [cull, item_buffer, sort, rays, bin, keep] = std::array::from_fn(stage);
        let idle = self.ended.map_or(0.0, |ended| (stamps[0] - ended).max(0.0));
        self.ended = (stamps.last().copied()).filter(|_| !self.asked.is_empty());
        let stages = Stages {
            cull,
            item_buffer,
            sort,
            rays,
            bin,
            keep,
            idle,
        };
        let state = || self.readback[i].read(self.layout.bytes, 1)[0];
        Ok(Some(Made {
            rows,
            stages,
            state: self.keeps.then(state),
        }))
    }

    /// The item buffers of the last batch, `[row][slot][column]`.
    pub fn items(&self) -> Result<Vec<u32>> {
        read_items(&self.device, &self.batch)
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

const PARTS: usize = 11;
const SLOT: usize = 0;
const ROW: usize = 1;
const COUPLING: usize = 2;
const COUNTS: usize = 3;
const AWAY: usize = 4;
const SHARES: usize = 5;
const LISTS: usize = 6;
const MESO_LISTS: usize = 7;
const PLAIN: usize = 8;
const MESO: usize = 9;
const OCCUPIED: usize = 10;

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

    fn read(&self, slot: u64, source: u32, from: &Buffer) -> Row {
        let at = |part: usize| self.parts[part].at + slot * self.parts[part].bytes;
        let bytes = |part: usize| self.parts[part].bytes as usize;
        let words = |part: usize| from.read(at(part), bytes(part) / 4);
        let drawn: Slot = from.read(at(SLOT), 1)[0];
        assert_eq!(drawn.source, source, "a slot holds what was asked for");
        let coupling: Vec<f32> = from.read(at(COUPLING), bytes(COUPLING) / 4);
        Row {
            source,
            scale: drawn.scale,
            share: (self.parts[SHARES].from.is_some())
                .then(|| from.read(at(SHARES), 1)[0])
                .filter(|&share| share >= 0.0),
            coupling: CouplingRow::new(&coupling, drawn.scale),
            factors: match self.parts[ROW].from {
                Some(_) => Factors::Kept(from.read::<KeptRow>(at(ROW), 1)[0]),
                None => Factors::Host(FactorWords {
                    plain: words(PLAIN),
                    meso: words(MESO),
                    occupied: words(OCCUPIED),
                }),
            },
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
