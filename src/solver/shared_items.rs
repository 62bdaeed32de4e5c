//! Draws one member's share of a batch's item buffers, and exchanges them with the others.

use std::ops::Range;
use std::sync::Arc;

use super::drawing::Drawing;
use super::exchange::{Exchange, Gift};
use super::packed::{Drawn, pack, unpack};
use crate::constants::{FACES, NONE};
use crate::error::{Error, Result};
use crate::math::hemicube::pixel_count;
use crate::passes::batch::Batch;
use crate::passes::buffers::SceneBuffers;
use crate::passes::types::Slot;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

/// A batch that was asked for.
pub(super) struct Asked {
    pub sources: Vec<u32>,
    /// Of a batch that was shared out, what this member has drawn: its place in the batch and the
    /// counts.
    pub counts: Vec<(usize, [[u32; 3]; FACES as usize])>,
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
    /// All item buffers of a batch, as they lie in the image.
    items: Buffer,
    /// Pixels a side of a face.
    face: usize,
    slots: usize,
}

/// Slots of sources, and empty ones behind.
pub(super) fn slots_of(sources: impl Iterator<Item = u32>, count: usize) -> Vec<Slot> {
    let sources = sources.chain(std::iter::repeat(NONE));
    sources.take(count).map(Slot::of).collect()
}

impl SharedItems {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        drawing: &Drawing,
        batch: &Batch,
    ) -> Result<Self> {
        let hemicubes = batch.hemicubes();
        let slots = batch.slot_count as usize;
        let items = 4 * (pixel_count(hemicubes.face_size) * slots) as u64;
        let slot_bytes = (slots * size_of::<Slot>()) as u64;
        let counts = hemicubes.counts.bytes();
        let buffer = |name, bytes, usage| Buffer::new(device, name, bytes, usage);
        let wanted = buffer("sources to draw", slot_bytes, BufferUse::Upload)?;
        let drawn = buffer("drawn items", items, BufferUse::Readback)?;
        let counted = buffer("drawn counts", counts, BufferUse::Readback)?;
        let stamps = Timestamps::new(device, "drawing timestamps", 3)?;
        let draw = Commands::record(device, "draw items", |cmd| {
            let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.reset_timestamps(&stamps);
            cmd.barrier(&used, &[Stage::Transfer]);
            cmd.copy(&wanted, 0, &batch.slots, 0, slot_bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            cmd.timestamp(&stamps, 0);
            drawing.record(cmd, scene, batch, || cmd.timestamp(&stamps, 1));
            cmd.timestamp(&stamps, 2);
            cmd.copy_shader_image_to_buffer(&hemicubes.items, &drawn);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            cmd.copy(&hemicubes.counts, 0, &counted, 0, counts);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok(Self {
            items: buffer("items of all", items, BufferUse::Upload)?,
            draw,
            wanted,
            stamps,
            drawn,
            counts: counted,
            face: hemicubes.face_size as usize,
            slots,
        })
    }

    /// Draws every so many-th source of a batch, and gives the item buffers away.
    pub fn draw(&mut self, asked: &mut Asked, exchange: &mut dyn Exchange) -> Result<()> {
        let [member, members] = exchange.place();
        let own = (asked.sources.iter().copied().enumerate())
            .skip(member)
            .step_by(members);
        let own: Vec<(usize, u32)> = own.collect();
        let mut drawn = Vec::new();
        if !own.is_empty() {
            let sources = own.iter().map(|(_, source)| *source);
            self.wanted.write(0, &slots_of(sources, self.slots));
            self.draw.submit()?;
            self.draw.wait()?;
            let seconds = self.stamps.intervals()?;
            asked.drawing = [seconds[0], seconds[1]];
            let pixels = pixel_count(self.face as u32);
            let items: Vec<u32> = self.drawn.read(0, pixels * self.slots);
            let counts: Vec<[[u32; 3]; FACES as usize]> = self.counts.read(0, own.len());
            let one = |(slot, &counts)| {
                let mut column = Vec::with_capacity(pixels);
                (self.columns(slot)).for_each(|at| column.extend_from_slice(&items[at]));
                Drawn {
                    counts,
                    items: column,
                }
            };
            drawn = counts.iter().enumerate().map(one).collect();
            asked.counts = own.iter().map(|(at, _)| *at).zip(counts).collect();
        }
        let given = pack(drawn.iter(), self.face);
        asked.given = given.len() as u64;
        exchange.give(Gift::Items, given)
    }

    /// Brings the item buffers of all to the device.
    pub fn collect(&mut self, asked: &Asked, exchange: &mut dyn Exchange) -> Result<()> {
        let [_, members] = exchange.place();
        let all = exchange.collect(Gift::Items)?;
        let pixels = pixel_count(self.face as u32);
        let mut items = vec![NONE; pixels * self.slots];
        for (member, given) in all.iter().enumerate() {
            let of = unpack(given, pixels, self.face)?;
            let slots = (member..asked.sources.len()).step_by(members);
            if of.len() != slots.len() {
                let what = "a device of several sent other item buffers than it was asked for";
                return Err(Error::Device(what.into()));
            }
            for (slot, one) in slots.zip(of) {
                for (at, row) in self.columns(slot).zip(one.items.chunks(self.face)) {
                    items[at].copy_from_slice(row);
                }
            }
        }
        self.items.write(0, &items);
        Ok(())
    }

    /// Where the rows of a slot lie in an image.
    fn columns(&self, slot: usize) -> impl Iterator<Item = Range<usize>> + use<> {
        let (face, wide) = (self.face, self.face * self.slots);
        (0..3 * face).map(move |row| row * wide + slot * face..row * wide + (slot + 1) * face)
    }

    /// Puts the item buffers of all into the image.
    pub fn take_in(&self, cmd: &Commands, batch: &Batch) {
        cmd.upload_texture(&self.items, &batch.hemicubes().items, 4);
    }
}
