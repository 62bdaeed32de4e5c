//! Draws the item buffers of a batch: culling, then five faces a source.

use std::sync::Arc;

use super::Settings;
use crate::error::Result;
use crate::passes::batch::{Batch, BatchSize, DrawLists, Hemicubes};
use crate::passes::buffers::SceneBuffers;
use crate::passes::cull::{Cull, Culling};
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::types::Slot;
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Stage};

/// The passes that draw, bound to a batch.
pub(super) struct Drawing {
    pub lists: DrawLists,
    cull: Cull,
    item_buffer: ItemBuffer,
    item_set: DescriptorSet,
}

impl Drawing {
    /// With a batch of `size`, which must fit the device: see [`Self::fitting`].
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        culling: Culling,
        size: &BatchSize,
    ) -> Result<(Self, Batch)> {
        let item_buffer = ItemBuffer::new(device)?;
        let batch = Batch::of_hemicubes(device, size)?;
        let lists = DrawLists::new(device, &item_buffer.pass, scene, &batch, size)?;
        let drawing = Self {
            cull: Cull::new(device, culling, scene, &batch, &lists)?,
            item_set: item_buffer.bind(scene, &lists)?,
            item_buffer,
            lists,
        };
        Ok((drawing, batch))
    }

    /// `slots` and faces of `face` pixels a side, or as many slots as fit.
    pub fn fitting(
        device: &Device,
        scene: &SceneBuffers,
        settings: &Settings,
        slots: u32,
        face: u32,
    ) -> BatchSize {
        BatchSize {
            slots: {
                let counts = (scene.element_count, scene.occluder_count);
                Hemicubes::fitting_slots(device, counts, face, slots)
            },
            face,
            list_room: settings.list_room,
        }
    }

    /// `listed` is recorded between culling and drawing.
    pub fn record(&self, cmd: &Commands, listed: impl FnOnce()) {
        (self.item_buffer).record(cmd, &self.item_set, &self.cull, &self.lists, listed);
    }
}

impl Drawing {
    /// The item buffer of one source, in the first slot of the batch.
    pub fn draw(&self, device: &Arc<Device>, batch: &Batch, source: u32) -> Result<Vec<u32>> {
        batch.slots.set(&[Slot::of(source)])?;
        Commands::run(device, "item buffer", |cmd| {
            self.record(cmd, || {});
            Ok(())
        })?;
        read_items(device, batch)
    }
}

/// The item buffers of a batch as they were drawn last, `[row][slot][column]`.
pub(super) fn read_items(device: &Arc<Device>, batch: &Batch) -> Result<Vec<u32>> {
    let hemicubes = batch.hemicubes();
    let pixels = crate::math::hemicube::pixel_count(hemicubes.face_size);
    let texels = pixels * batch.slot_count as usize;
    let bytes = 4 * texels as u64;
    let readback = Buffer::new(device, "item readback", bytes, BufferUse::Readback)?;
    Commands::run(device, "item readback", |cmd| {
        cmd.copy_shader_image_to_buffer(&hemicubes.items, &readback);
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
        Ok(())
    })?;
    Ok(readback.read(0, texels))
}
