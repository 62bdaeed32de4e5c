//! Draws one member's share of a batch's item buffers, and exchanges them with the others.

use std::ops::Range;
use std::sync::Arc;

use super::drawing::Drawing;
use super::exchange::{Exchange, Gift};
use super::makers::RowKind;
use super::packed::{Counts, pack, unpack};
use super::row_maker::SETS;
use crate::constants::NONE;
use crate::error::{Error, Result};
use crate::math::hemicube::pixel_count;
use crate::passes::batch::Batch;
use crate::passes::types::Slot;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

/// A batch that was asked for.
#[derive(Default)]
pub(super) struct Asked {
    pub sources: Vec<u32>,
    pub kind: RowKind,
    /// Of a batch that was shared out, what this member has drawn: its place in the batch and the
    /// counts.
    pub counts: Vec<(usize, Counts)>,
    /// Seconds that culling and drawing took.
    pub drawing: [f64; 2],
    /// Bytes given to the others.
    pub given: u64,
}

/// Draws a share of the item buffers, and takes in those of others.
pub(super) struct SharedItems {
    draw: Commands,
    wanted: Buffer,
    stamps: Timestamps,
    drawn: Buffer,
    counts: Buffer,
    /// All item buffers of batches that are evaluated, as they lie in the image.
    items: [Buffer; SETS],
    /// Pixels a side of a face.
    face: usize,
    slots: usize,
    /// Of what this member draws.
    drawn_slots: usize,
}

/// Slots of sources, and empty ones behind.
pub(super) fn slots_of(sources: impl Iterator<Item = u32>, count: usize) -> Vec<Slot> {
    let sources = sources.chain(std::iter::repeat(NONE));
    sources.take(count).map(Slot::of).collect()
}

impl SharedItems {
    /// For the item buffers of `batch`, of which this member's share is drawn in `share`.
    pub fn new(
        device: &Arc<Device>,
        drawing: &Drawing,
        share: &Batch,
        batch: &Batch,
    ) -> Result<Self> {
        let face_size = batch.hemicubes().face_size;
        let [slots, drawn_slots] = [batch, share].map(|of| of.slot_count as usize);
        let bytes = |slots: usize| 4 * (pixel_count(face_size) * slots) as u64;
        let slot_bytes = (drawn_slots * size_of::<Slot>()) as u64;
        let counts = drawing.lists.counts.bytes();
        let buffer = |name, bytes, usage| Buffer::new(device, name, bytes, usage);
        let wanted = buffer("sources to draw", slot_bytes, BufferUse::Upload)?;
        let drawn = buffer("drawn items", bytes(drawn_slots), BufferUse::Readback)?;
        let counted = buffer("drawn counts", counts, BufferUse::Readback)?;
        let stamps = Timestamps::new(device, "drawing timestamps", 3)?;
        let draw = Commands::record(device, "draw items", |cmd| {
            let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.reset_timestamps(&stamps);
            cmd.barrier(&used, &[Stage::Transfer]);
            cmd.copy(&wanted, 0, &share.slots, 0, slot_bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            cmd.timestamp(&stamps, 0);
            drawing.record(cmd, || cmd.timestamp(&stamps, 1));
            cmd.timestamp(&stamps, 2);
            cmd.copy_shader_image_to_buffer(&share.hemicubes().items, &drawn);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            cmd.copy(&drawing.lists.counts, 0, &counted, 0, counts);
            cmd.read_back_timestamps(&stamps);
            Ok(())
        })?;
        let all = || buffer("items of all", bytes(slots), BufferUse::Upload);
        Ok(Self {
            items: [all()?, all()?],
            draw,
            wanted,
            stamps,
            drawn,
            counts: counted,
            face: face_size as usize,
            slots,
            drawn_slots,
        })
    }

    /// Begins to draw what is one member's of a batch: every so many-th source. What was drawn
    /// before is given.
    pub fn draw(&mut self, asked: &Asked, [member, members]: [usize; 2]) -> Result<()> {
        let own = (asked.sources.iter().copied())
            .skip(member)
            .step_by(members);
        if own.len() == 0 {
            return Ok(());
        }
        self.wanted.write(0, &slots_of(own, self.drawn_slots));
        self.draw.submit()
    }

    /// Gives away the item buffers that [`Self::draw`] has begun, once they are there.
    pub fn give(&mut self, asked: &mut Asked, exchange: &mut dyn Exchange) -> Result<()> {
        let [member, members] = exchange.place();
        let own = (0..asked.sources.len()).skip(member).step_by(members);
        let mut packed = Vec::new();
        if own.len() > 0 {
            self.draw.wait()?;
            let seconds = self.stamps.intervals();
            asked.drawing = [seconds[0], seconds[1]];
            let counts: Vec<Counts> = self.counts.read(0, own.len());
            self.drawn.look_at(|items: &[u32]| {
                for (slot, counts) in counts.iter().enumerate() {
                    let rows = self.rows(slot).map(|at| &items[at]);
                    pack(counts, rows, &mut packed);
                }
            });
            asked.counts = own.zip(counts).collect();
        }
        asked.given = packed.len() as u64;
        exchange.give(Gift::Items, packed)
    }

    /// Brings the item buffers of all members to the device, for the commands of `set`: see
    /// [`Self::take_in`].
    pub fn collect(
        &mut self,
        asked: &Asked,
        set: usize,
        exchange: &mut dyn Exchange,
    ) -> Result<()> {
        let [_, members] = exchange.place();
        let all = exchange.collect(Gift::Items)?;
        let (face, wide) = (self.face, self.face * self.slots);
        let pixels = pixel_count(face as u32);
        self.items[set].change(|items: &mut [u32]| {
            for (member, given) in all.iter().enumerate() {
                let slots = (member..asked.sources.len()).step_by(members);
                let of = unpack(given, pixels, |which, run, item| {
                    let slot = member + which * members;
                    if slot >= self.slots {
                        return;
                    }
                    for row in run.start / face..=(run.end - 1) / face {
                        let columns = run.start.max(row * face)..run.end.min((row + 1) * face);
                        let shift = row * (wide - face) + slot * face;
                        items[columns.start + shift..columns.end + shift].fill(item);
                    }
                })?;
                if of != slots.len() {
                    let what = "a device of several sent other item buffers than it was asked for";
                    return Err(Error::Device(what.into()));
                }
            }
            // Slots without a source see nothing.
            for slot in asked.sources.len()..self.slots {
                for row in 0..pixels / face {
                    let first = row * wide + slot * face;
                    items[first..first + face].fill(NONE);
                }
            }
            Ok(())
        })
    }

    /// Where the rows of a slot lie in what this member draws.
    fn rows(&self, slot: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let (face, wide) = (self.face, self.face * self.drawn_slots);
        (0..3 * face).map(move |row| row * wide + slot * face..row * wide + (slot + 1) * face)
    }

    /// Puts the item buffers of all into the image.
    pub fn take_in(&self, cmd: &Commands, set: usize, batch: &Batch) {
        cmd.upload_texture(&self.items[set], &batch.hemicubes().items, 4);
    }
}
