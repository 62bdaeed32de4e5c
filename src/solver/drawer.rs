//! Draws sources that the host names and finds their form factors: what any device can do that holds the scene, whatever the light.

use std::sync::Arc;

use glam::Vec3;

use super::Settings;
use super::readback::Stages;
use crate::constants::{FACES, NONE};
use crate::error::Result;
use crate::passes::batch::{Batch, Hemicubes};
use crate::passes::buffers::{SceneBuffers, filled, upload, write};
use crate::passes::cull::{Cull, Culling};
use crate::passes::factor_buffers::FactorBuffers;
use crate::passes::form_factors::{self, FacingAway, FormFactors, SeenBy, Sorting};
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::normalise::Normalise;
use crate::passes::types::{MesoElement, ReceiverList, Slot};
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Stage, Timestamps};

/// Sources drawn at once, at most: few, so that what is asked for next does not wait long.
const SLOTS: u32 = 8;

const STAMPS: u32 = 4;

/// The form factors from all elements to one source, with what is counted of them.
pub(super) struct Row {
    /// Of elements without relief, vectors of those with one, and whether each block sees anything: words as they lie on the device.
    pub plain: Vec<u32>,
    pub meso: Vec<u32>,
    pub occupied: Vec<u32>,
    /// Of all form factors.
    pub scale: f32,
    /// `[face]`, as in [`super::BatchResult`].
    pub counts: Vec<[u32; 3]>,
    /// Elements that see nothing of the source, whatever stands between.
    pub facing_away: u32,
}

/// Words of a [`Row`]'s lists.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowWords {
    pub plain: u64,
    pub meso: u64,
    pub occupied: u64,
}

impl RowWords {
    pub fn new(factors: &FactorBuffers) -> Self {
        Self {
            plain: factors.plain_count.into(),
            meso: 3 * u64::from(factors.meso_count),
            occupied: factors.blocks().into(),
        }
    }

    pub fn bytes(self) -> u64 {
        4 * (self.plain + self.meso + self.occupied)
    }
}

type Sets = (
    DescriptorSet,
    DescriptorSet,
    form_factors::Sets,
    Option<DescriptorSet>,
);

/// See [`Drawer::draw`].
pub(super) type Drawn = (Vec<Row>, Stages);

pub(super) struct Drawer {
    // First: dropping them waits until the device is done with the rest.
    commands: Commands,
    wanted: Buffer,
    readback: Buffer,
    timestamps: Timestamps,
    words: RowWords,
    slots: u32,
    _sets: Sets,
    _passes: (Cull, ItemBuffer, FormFactors, Option<Normalise>),
    _buffers: (Batch, FactorBuffers, Buffer, Option<Buffer>),
    /// On a device that holds nothing else.
    _scene: Option<SceneBuffers>,
}

impl Drawer {
    /// For a device that is to hold the scene for this alone.
    pub fn with_scene(
        device: &Arc<Device>,
        settings: &Settings,
        scene: SceneBuffers,
        meso: &[MesoElement],
    ) -> Result<Self> {
        let drawer = Self::new(device, settings, &scene, meso)?;
        Ok(Self {
            _scene: Some(scene),
            ..drawer
        })
    }

    /// `scene` must outlive this; `meso` are the elements with a relief.
    pub fn new(
        device: &Arc<Device>,
        settings: &Settings,
        scene: &SceneBuffers,
        meso: &[MesoElement],
    ) -> Result<Self> {
        let item_buffer = ItemBuffer::new(device)?;
        let face = settings.hemicube;
        let wanted = SLOTS
            .min(settings.batch)
            .clamp(1, scene.source_count.max(1));
        let slots = Hemicubes::fitting_slots(device, scene, face, wanted);
        let batch = Batch::drawing(
            device,
            &item_buffer.pass,
            scene,
            (face, settings.list_room),
            (slots, 0),
        )?;
        let factors = FactorBuffers::new(device, scene, meso.len() as u32, slots, (0, None))?;
        let meso = match meso {
            [] => None,
            meso => Some(upload(device, "meso elements", meso, BufferUse::Storage)?),
        };
        let facing_away = filled(device, "facing away", 4 * u64::from(slots), 0)?;
        let cull = Cull::new(device, settings.culling)?;
        let sorting = Sorting {
            seen_by: SeenBy::ItemBuffer,
            facing_away: FacingAway::BySlot,
            culls: settings.culling != Culling::Off,
        };
        let form_factors = FormFactors::new(device, meso.is_some(), sorting)?;
        let normalise = (scene.enclosed.then(|| Normalise::new(device))).transpose()?;
        let sets = (
            cull.bind(scene, &batch)?,
            item_buffer.bind(&batch)?,
            form_factors.bind(
                device,
                (scene, &facing_away),
                &batch,
                &factors,
                meso.as_ref(),
            )?,
            (normalise.as_ref().map(|n| n.bind(scene, &batch, &factors))).transpose()?,
        );
        // Something is always drawn.
        let sort = form_factors.sort_groups(&factors);
        let sort = sort.map(|groups_x| ReceiverList {
            groups_y: 1,
            ..ReceiverList::idle(groups_x)
        });
        write(device, &batch.drawn_commands, &sort)?;

        let words = RowWords::new(&factors);
        let layout = Layout::new(slots, words);
        let bytes = u64::from(slots) * size_of::<Slot>() as u64;
        let wanted = Buffer::new(device, "wanted sources", bytes, BufferUse::Upload)?;
        let readback = Buffer::new(device, "drawn rows", layout.bytes, BufferUse::Readback)?;
        let timestamps = Timestamps::new(device, "drawer timestamps", STAMPS)?;
        let commands = Commands::record(device, "draw rows", |cmd| {
            cmd.reset_timestamps(&timestamps);
            let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.barrier(&used, &[Stage::Transfer]);
            cmd.copy(&wanted, 0, &batch.slots, 0, bytes);
            cmd.fill(&factors.occupied, 0);
            cmd.fill(&facing_away, 0);
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            cmd.timestamp(&timestamps, 0);
            let listed = || cmd.timestamp(&timestamps, 1);
            item_buffer.record(cmd, &sets.1, (&cull, &sets.0), (scene, &batch), listed);
            cmd.timestamp(&timestamps, 2);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            form_factors.record(cmd, &sets.2, &batch, &factors);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            if let (Some(normalise), Some(set)) = (&normalise, &sets.3) {
                normalise.record(cmd, set, &batch, &factors);
            }
            cmd.timestamp(&timestamps, 3);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            layout.record(cmd, &batch, &factors, &facing_away, &readback);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok(Self {
            commands,
            wanted,
            readback,
            timestamps,
            words,
            slots,
            _sets: sets,
            _passes: (cull, item_buffer, form_factors, normalise),
            _buffers: (batch, factors, facing_away, meso),
            _scene: None,
        })
    }

    /// Sources of one [`Self::draw`], at most.
    pub fn slots(&self) -> usize {
        self.slots as usize
    }

    /// The rows of a few sources, in their order, and how long the device took.
    pub fn draw(&mut self, sources: &[u32]) -> Result<Drawn> {
        assert!(sources.len() <= self.slots(), "no more than fit");
        let slot = |i: usize| Slot {
            emitted: Vec3::ZERO,
            source: sources.get(i).copied().unwrap_or(NONE),
            reflected: Vec3::ZERO,
            scale: 1.0,
        };
        let slots: Vec<Slot> = (0..self.slots()).map(slot).collect();
        self.wanted.write(0, &slots);
        self.commands.submit()?;
        self.commands.wait()?;
        let layout = Layout::new(self.slots, self.words);
        let rows = (0..sources.len() as u64).map(|i| layout.read(i, self.words, &self.readback));
        let rows = rows.collect();
        let [cull, item_buffer, bin] = self.timestamps.intervals()?[..] else {
            panic!("a drawer has {STAMPS} timestamps");
        };
        let stages = Stages {
            cull,
            item_buffer,
            bin,
            ..Stages::default()
        };
        Ok((rows, stages))
    }
}

/// Where the parts of rows lie in a readback buffer: each part of all slots before the next.
struct Layout {
    slots: u64,
    meso: u64,
    occupied: u64,
    chosen: u64,
    counts: u64,
    facing_away: u64,
    bytes: u64,
}

impl Layout {
    fn new(slots: u32, words: RowWords) -> Self {
        let slots = u64::from(slots);
        let faces = slots * u64::from(FACES);
        let meso = 4 * slots * words.plain;
        let occupied = meso + 4 * slots * words.meso;
        let chosen = occupied + 4 * slots * words.occupied;
        let counts = chosen + slots * size_of::<Slot>() as u64;
        let facing_away = counts + faces * size_of::<[u32; 3]>() as u64;
        Self {
            slots,
            meso,
            occupied,
            chosen,
            counts,
            facing_away,
            bytes: facing_away + 4 * slots,
        }
    }

    fn record(
        &self,
        cmd: &Commands,
        batch: &Batch,
        factors: &FactorBuffers,
        facing_away: &Buffer,
        to: &Buffer,
    ) {
        for (from, at, end) in [
            (&factors.fresh, 0, self.meso),
            (&factors.fresh_meso, self.meso, self.occupied),
            (&factors.occupied, self.occupied, self.chosen),
            (&batch.slots, self.chosen, self.counts),
            (&batch.hemicubes().counts, self.counts, self.facing_away),
            (facing_away, self.facing_away, self.bytes),
        ] {
            cmd.copy(from, 0, to, at, end - at);
        }
    }

    fn read(&self, i: u64, words: RowWords, from: &Buffer) -> Row {
        assert!(i < self.slots);
        let list = |at: u64, words: u64| from.read(at + 4 * i * words, words as usize);
        let faces = u64::from(FACES);
        let slot = from.read::<Slot>(self.chosen + i * size_of::<Slot>() as u64, 1)[0];
        let counts = self.counts + i * faces * size_of::<[u32; 3]>() as u64;
        Row {
            plain: list(0, words.plain),
            meso: list(self.meso, words.meso),
            occupied: list(self.occupied, words.occupied),
            scale: slot.scale,
            counts: from.read(counts, faces as usize),
            facing_away: from.read(self.facing_away + 4 * i, 1)[0],
        }
    }
}
