//! Form factors on the device: those of the batch, and those that are kept so that a source is drawn once.

use std::cmp::Ordering;
use std::sync::Arc;

use super::buffers::{SceneBuffers, download, filled, upload, write};
use super::groups;
use super::types::{KeptState, ReceiverList};
use crate::constants::{GROUP, RECEIVE_KINDS};
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Device};

/// Form factors of the batch, and the memory for kept ones: a row for each source, in 16 bits an element (48 with relief),
/// without the blocks of GROUP elements that see nothing of it.
pub struct FactorBuffers {
    pub plain_count: u32,
    pub meso_count: u32,
    /// `[slot][element]`, of elements without relief.
    pub fresh: Buffer,
    /// `[slot][meso element]`, vectors in its frame.
    pub fresh_meso: Buffer,
    /// Elements that see each source of the batch, by how their form factor is found.
    pub plain_lists: ReceiverLists,
    pub meso_lists: ReceiverLists,
    /// Whether a block sees anything, `[slot][block]`.
    pub occupied: Buffer,
    /// Addresses of the chunks.
    pub table: Buffer,
    pub state: Buffer,
    pub chunk_words: u32,
    chunks: Vec<Buffer>,
}

/// Lists of elements, `[slot][kind]`.
pub struct ReceiverLists {
    /// [`ReceiverList`], `[slot][kind]`.
    pub counts: Buffer,
    /// `[slot][kind][element]`.
    pub listed: Buffer,
    /// What `counts` starts from.
    pub empty: Buffer,
}

impl ReceiverLists {
    fn new(device: &Arc<Device>, slots: u32, elements: u32) -> Result<Self> {
        let lists = slots * RECEIVE_KINDS;
        let empty = vec![
            ReceiverList {
                groups_x: 0,
                groups_y: 1,
                groups_z: 1,
                count: 0,
            };
            lists as usize
        ];
        let bytes = 4 * u64::from(lists) * u64::from(elements);
        Ok(Self {
            counts: upload(device, "receiver counts", &empty, BufferUse::Geometry)?,
            listed: Buffer::new(device, "listed receivers", bytes, BufferUse::Storage)?,
            empty: upload(device, "empty receiver counts", &empty, BufferUse::Storage)?,
        })
    }
}

/// Bytes of a chunk at most.
const CHUNK: u64 = 256 << 20;

impl FactorBuffers {
    /// Keeps rows in `memory` bytes at most, and no more than all sources need. A device that has less keeps fewer. Where form factors
    /// are to be restored, the words of a chunk and how many chunks there were come with the memory, and are made anyway. `meso_count`
    /// elements have a relief.
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        meso_count: u32,
        slots: u32,
        (memory, chunks_of): (u64, Option<(u32, usize)>),
    ) -> Result<Self> {
        let plain_count = scene.element_count - meso_count;
        let blocks = u64::from(groups(plain_count) + groups(meso_count));
        let row = 4 * blocks
            + u64::from(GROUP)
                * (2 * u64::from(groups(plain_count)) + 6 * u64::from(groups(meso_count)));
        let most = memory.min(row * u64::from(scene.source_count));
        // Rows lie in one chunk each, so that a chunk may end with most of a row unused.
        let chunk = match chunks_of {
            Some((words, _)) => 4 * u64::from(words),
            None => most.min(CHUNK).next_multiple_of(4),
        };
        let count = if row > chunk { 0 } else { most.div_ceil(chunk) };
        let least = chunks_of.map_or(0, |(_, count)| count as u64);
        let count = count.max(least);
        let mut chunks = Vec::new();
        for _ in 0..count {
            match Buffer::new(device, "kept form factors", chunk, BufferUse::Addressed) {
                Ok(buffer) => chunks.push(buffer),
                Err(e) if (chunks.len() as u64) < least => return Err(e),
                Err(e) => {
                    tracing::warn!("{e}: keeping fewer form factors");
                    break;
                }
            }
        }
        let addresses: Vec<u64> = chunks.iter().map(Buffer::address).collect();
        let lists = |elements| ReceiverLists::new(device, slots, elements);
        let (plain_lists, meso_lists) = (lists(plain_count)?, lists(meso_count)?);
        let slots = u64::from(slots);
        let storage = |name, bytes| Buffer::new(device, name, bytes, BufferUse::Storage);
        Ok(Self {
            plain_count,
            meso_count,
            plain_lists,
            meso_lists,
            fresh: storage("form factors", 4 * slots * u64::from(plain_count))?,
            fresh_meso: storage("form factors to relief", 12 * slots * u64::from(meso_count))?,
            occupied: filled(device, "occupied blocks", 4 * slots * blocks, 0)?,
            table: upload(
                device,
                "chunks of form factors",
                &addresses,
                BufferUse::Storage,
            )?,
            state: filled(device, "kept state", size_of::<KeptState>() as u64, 0)?,
            chunk_words: (chunk / 4) as u32,
            chunks,
        })
    }

    /// How far the chunks are filled, and what they hold.
    pub fn download(&self, device: &Arc<Device>) -> Result<(KeptState, Vec<Vec<u32>>)> {
        let state = download::<KeptState>(device, &self.state, 1)?[0];
        let full = self.chunks.iter().enumerate().map(|(i, chunk)| {
            let words = match (i as u32).cmp(&state.chunk) {
                Ordering::Less => self.chunk_words,
                Ordering::Equal => state.used,
                Ordering::Greater => 0,
            };
            download(device, chunk, words as usize)
        });
        Ok((state, full.collect::<Result<_>>()?))
    }

    /// The inverse of [`Self::download`].
    pub fn restore(
        &self,
        device: &Arc<Device>,
        chunks: &[Vec<u32>],
        [chunk, used, rows]: [u32; 3],
    ) -> Result<()> {
        write(device, &self.state, &[KeptState { chunk, used, rows }])?;
        for (buffer, words) in self.chunks.iter().zip(chunks) {
            write(device, buffer, words)?;
        }
        Ok(())
    }

    pub fn plain_blocks(&self) -> u32 {
        groups(self.plain_count)
    }

    pub fn meso_blocks(&self) -> u32 {
        groups(self.meso_count)
    }

    /// Blocks of all elements, those with relief last.
    pub fn blocks(&self) -> u32 {
        self.plain_blocks() + self.meso_blocks()
    }

    /// Whether there is room for the form factors of as many sources, if each is seen by half of the elements.
    pub fn has_room_for(&self, sources: u32) -> bool {
        let group = u64::from(GROUP);
        let plain = u64::from(self.plain_blocks()) * group / 2;
        let meso = u64::from(self.meso_blocks()) * (group / 2 + group);
        let row = u64::from(self.blocks()) + (plain + meso) / 2;
        u64::from(sources) * row <= u64::from(self.chunk_count()) * u64::from(self.chunk_words)
    }

    /// Whether anything can be kept.
    pub fn keeps(&self) -> bool {
        !self.chunks.is_empty()
    }

    pub fn chunk_count(&self) -> u32 {
        self.chunks.len() as u32
    }
}
