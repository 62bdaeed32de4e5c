//! A batch of sources under way, and what finds out what they see.

use std::sync::Arc;

use super::buffers::{SceneBuffers, upload};
use super::occluder_tree::OccluderTree;
use super::types::{Draw, Slot, View};
use crate::constants::{FACES, MESHLET_TRIANGLES, RECEIVE_LISTS};
use crate::error::Result;
use crate::math::hemicube::pixel_count;
use crate::vk::{
    Buffer, BufferUse, Device, Format, Framebuffer, Image, ImageUse, Limits, RenderPass, Sampled,
    Sampler,
};

/// The sources of a batch.
pub struct Batch {
    pub slot_count: u32,
    /// [`Slot`], `[slot]`; the slots after the last source hold `NONE`.
    pub slots: Buffer,
    pub sight: Sight,
}

/// How large the item buffers of a batch are.
#[derive(Debug, Clone, Copy)]
pub struct BatchSize {
    pub slots: u32,
    /// Pixels a side of a face.
    pub face: u32,
    /// Triangles that a list of a face holds, at most. None: as many as fit the largest buffer.
    pub list_room: Option<u32>,
}

/// What finds out what sources see.
#[allow(clippy::large_enum_variant)] // one or two of them live as long as the solver
pub enum Sight {
    Hemicubes(Hemicubes),
    Rays(OccluderTree),
}

/// Item buffers, one a slot.
pub struct Hemicubes {
    /// Pixels a side of a face.
    pub face_size: u32,
    /// Columns of N × 3 N texels side by side, one a slot.
    pub items: Image,
    pub sampler: Sampler,
    /// What decides where the item buffer leaves open what is seen.
    pub occluders: Option<OccluderTree>,
}

/// What item buffers are drawn with.
pub struct DrawLists {
    pub slot_count: u32,
    /// Pixels a side of a face.
    pub face_size: u32,
    pub views: Buffer,
    pub draws: Buffer,
    pub counts: Buffer,
    /// `[slot][face]`: the meshlet that the next part begins with.
    pub resume: Buffer,
    /// Triangles that a list of a face holds: all, or what fits the device's largest buffer.
    pub room: u32,
    /// In how many parts the batch is drawn. Each but the last leaves less than a meshlet of its
    /// room.
    pub parts: u32,
    /// `[slot][face][triangle]`.
    pub drawn_corners: Buffer,
    pub drawn_items: Buffer,
    pub framebuffer: Framebuffer,
}

/// Bytes of the lists of drawn triangles, for one occluder in one face of one slot.
const DRAWN_BYTES: u64 = 16;
/// Those of the corners.
const CORNER_BYTES: u64 = 12;

impl Batch {
    pub fn new(device: &Arc<Device>, slot_count: u32, sight: Sight) -> Result<Self> {
        let empty = vec![Slot::EMPTY; slot_count as usize];
        Ok(Self {
            slot_count,
            slots: upload(device, "slots", &empty, BufferUse::Storage)?,
            sight,
        })
    }

    /// A batch that sees by item buffers.
    pub fn of_hemicubes(device: &Arc<Device>, size: &BatchSize) -> Result<Self> {
        let hemicubes = Hemicubes::new(device, size)?;
        Self::new(device, size.slots, Sight::Hemicubes(hemicubes))
    }

    /// Decides by rays where its item buffers leave open what is seen.
    pub fn with_rays(mut self, tree: &OccluderTree) -> Self {
        if let Sight::Hemicubes(hemicubes) = &mut self.sight {
            hemicubes.occluders = Some(tree.clone());
        }
        self
    }

    /// Of a batch that sees by them.
    pub fn hemicubes(&self) -> &Hemicubes {
        match &self.sight {
            Sight::Hemicubes(hemicubes) => hemicubes,
            Sight::Rays(_) => unreachable!("asked of batches of hemicubes"),
        }
    }
}

impl Hemicubes {
    /// How many slots a batch may have: what fits the device's largest buffer, its widest image and
    /// an eighth of its memory, and no more than `wanted`. `counts`: of elements and occluders.
    pub fn fitting_slots(device: &Device, counts: (u32, u32), face_size: u32, wanted: u32) -> u32 {
        wanted.min(most_slots(device.limits(), counts, face_size))
    }

    /// The item buffers as shaders read them.
    pub(super) fn sampled_items(&self) -> Sampled<'_> {
        Sampled {
            image: &self.items,
            sampler: &self.sampler,
        }
    }

    fn new(device: &Arc<Device>, size: &BatchSize) -> Result<Self> {
        let BatchSize { slots, face, .. } = *size;
        let size = (slots * face, 3 * face);
        let usage = ImageUse::ColourTarget;
        Ok(Self {
            face_size: face,
            items: Image::new(device, "item buffer", size, Format::R32_UINT, usage)?,
            sampler: Sampler::new(device, "item buffer", false)?,
            occluders: None,
        })
    }
}

impl DrawLists {
    /// To draw a batch, by this pass.
    pub fn new(
        device: &Arc<Device>,
        pass: &RenderPass,
        scene: &SceneBuffers,
        batch: &Batch,
        size: &BatchSize,
    ) -> Result<Self> {
        let &BatchSize {
            slots: slot_count,
            face: face_size,
            list_room,
        } = size;
        let regions = u64::from(slot_count * FACES);
        let most = device.limits().max_storage_buffer_range / (CORNER_BYTES * regions);
        let wanted = list_room.map_or(u64::MAX, u64::from);
        let most = most.min(wanted).max(MESHLET_TRIANGLES.into());
        let occluders = scene.occluder_count;
        let room = most.min(occluders.into()) as u32;
        let filled = room.saturating_sub(MESHLET_TRIANGLES - 1).max(1);
        let drawn = regions * u64::from(room);
        let buffer = |name, bytes, usage| Buffer::new(device, name, bytes, usage);
        let size = (slot_count * face_size, 3 * face_size);
        let (format, usage) = (Format::D32_SFLOAT, ImageUse::DepthTarget);
        let depth = Image::new(device, "item depth", size, format, usage)?;
        let items = &batch.hemicubes().items;
        let views = regions * size_of::<View>() as u64;
        let draws = regions * size_of::<Draw>() as u64;
        Ok(Self {
            slot_count,
            face_size,
            room,
            parts: match occluders > room {
                true => occluders.div_ceil(filled),
                false => 1,
            },
            views: buffer("views", views, BufferUse::Storage)?,
            draws: buffer("draws", draws, BufferUse::Geometry)?,
            counts: buffer("cull counts", regions * 12, BufferUse::Storage)?,
            resume: buffer("cull resume", regions * 4, BufferUse::Storage)?,
            drawn_corners: buffer("drawn corners", CORNER_BYTES * drawn, BufferUse::Storage)?,
            drawn_items: buffer("drawn items", 4 * drawn, BufferUse::Storage)?,
            framebuffer: Framebuffer::new(device, "item buffer", pass, items, &depth)?,
        })
    }
}

/// As many slots as [`Hemicubes::fitting_slots`] may give, for so many elements and occluders; 1 at
/// least.
fn most_slots(limits: &Limits, (elements, occluders): (u32, u32), face_size: u32) -> u32 {
    let region = u64::from(FACES) * u64::from(occluders);
    // Of receivers: fresh form factors are no more. Lists of triangles may be drawn in parts.
    let lists = 4 * u64::from(RECEIVE_LISTS) * u64::from(elements);
    let by_buffer = limits.max_storage_buffer_range / lists.max(1);
    let by_memory =
        limits.heap_bytes / 8 / (DRAWN_BYTES * region + 8 * pixel_count(face_size) as u64);
    let by_width = u64::from(limits.max_image_side / face_size);
    by_buffer.min(by_memory).min(by_width).max(1) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A million elements, merged to a few occluders and not: lists of receivers fit a buffer of
    /// 128 MiB.
    #[test]
    fn no_list_outgrows_the_largest_buffer() {
        let limits = Limits {
            max_storage_buffer_range: 128 << 20,
            max_texels: 128 << 20,
            stored_texels: false,
            heap_bytes: 16 << 30,
            max_image_side: 16384,
            max_workgroups: 65_535,
            subgroup_size: 8,
            subpixel_bits: 8,
            timestamp_period: 1.0,
        };
        for (elements, occluders, expected) in [
            (1_000_000, 25_000, 4),
            (1_000_000, 1_000_000, 4),
            (10_000, 10_000, 128),
            (100_000_000, 100_000_000, 1),
        ] {
            let slots = most_slots(&limits, (elements, occluders), 128);
            assert_eq!(
                slots, expected,
                "{elements} elements, {occluders} occluders"
            );
        }
    }
}
