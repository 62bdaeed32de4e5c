//! Kept rows on the device: the form factors of a source in 16 bits an element (48 with relief),
//! without the blocks of GROUP elements that see nothing of it.

use std::cmp::Ordering;
use std::sync::Arc;

use super::buffers::{download, filled, upload};
use super::fresh_rows::RowShape;
use super::types::{KeptRow, KeptState};
use crate::constants::GROUP;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Device, TEXEL_BYTES};

/// Chunks of device memory with rows, and how far they are filled.
pub struct KeptRows {
    pub shape: RowShape,
    /// Addresses of the chunks; the last [`SCRATCH`] are for rows that find no room.
    pub table: Buffer,
    pub state: Buffer,
    pub chunk_words: u32,
    /// All chunks; the last [`SCRATCH`] are for rows that find no room.
    pub chunks: Vec<Buffer>,
    lasting: usize,
}

/// Batches under way at once, each with a chunk of its own for rows that find no room.
pub const SCRATCH: u32 = 2;

/// Bytes of a chunk, at most.
const CHUNK: u64 = 256 << 20;

/// What the chunks are made for.
#[derive(Debug, Clone, Copy)]
pub struct KeptSize {
    /// Bytes, at most.
    pub memory: u64,
    /// Sources of the scene, and of a batch.
    pub sources: u32,
    pub slots: u32,
}

/// Chunks that are to be restored.
#[derive(Debug, Clone, Copy)]
pub struct RestoredSize {
    pub chunk_words: u32,
    pub chunks: usize,
}

impl KeptRows {
    /// Room for the rows of all sources, in `size.memory` bytes at most. A device that has less
    /// keeps fewer. Chunks that are to be restored are made whatever the memory.
    ///
    /// # Errors
    /// A device without the memory for the rows of a batch, or for those that are to be restored.
    pub fn new(
        device: &Arc<Device>,
        shape: RowShape,
        size: KeptSize,
        restored: Option<RestoredSize>,
    ) -> Result<Self> {
        let row = row_bytes(shape);
        let most = size.memory.min(row * u64::from(size.sources));
        // A row lies in one chunk, so that a chunk may end with most of a row unused.
        let chunk = match restored {
            Some(restored) => 4 * u64::from(restored.chunk_words),
            None => {
                let texels = device.limits().max_texels * TEXEL_BYTES;
                most.min(CHUNK).min(texels).next_multiple_of(TEXEL_BYTES)
            }
        };
        let count = if row > chunk { 0 } else { most.div_ceil(chunk) };
        let least = restored.map_or(0, |restored| restored.chunks as u64);
        let mut chunks = Vec::new();
        for _ in 0..count.max(least) {
            match Buffer::new(
                device,
                "kept form factors",
                chunk,
                BufferUse::AddressedTexels,
            ) {
                Ok(buffer) => chunks.push(buffer),
                Err(e) if (chunks.len() as u64) < least => return Err(e),
                Err(e) => {
                    tracing::warn!("{e}: keeping fewer form factors");
                    break;
                }
            }
        }
        let bytes = row * u64::from(size.slots);
        let scratch = (0..SCRATCH)
            .map(|_| {
                Buffer::new(
                    device,
                    "rows without room",
                    bytes,
                    BufferUse::AddressedTexels,
                )
            })
            .collect::<Result<Vec<_>>>()?;
        let addresses: Vec<u64> = chunks.iter().chain(&scratch).map(Buffer::address).collect();
        let table = upload(device, "row chunks", &addresses, BufferUse::Storage)?;
        // Shaders write them by their addresses.
        for chunk in chunks.iter().chain(&scratch) {
            table.refer_to(chunk);
        }
        let lasting = chunks.len();
        chunks.extend(scratch);
        Ok(Self {
            shape,
            table,
            state: filled(device, "kept state", size_of::<KeptState>() as u64, 0)?,
            chunk_words: (chunk / 4) as u32,
            chunks,
            lasting,
        })
    }

    /// How far the chunks are filled, and what they hold.
    pub fn download(&self, device: &Arc<Device>) -> Result<(KeptState, Vec<Vec<u32>>)> {
        let state = download::<KeptState>(device, &self.state, 1)?[0];
        let full = self.chunks[..self.lasting]
            .iter()
            .enumerate()
            .map(|(i, chunk)| {
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
    pub fn restore(&self, state: KeptState, chunks: &[Vec<u32>]) -> Result<()> {
        self.state.set(&[state])?;
        for (buffer, words) in self.chunks[..self.lasting].iter().zip(chunks) {
            buffer.set(words)?;
        }
        Ok(())
    }

    /// Forgets rows that were kept, and gives back the room of those behind all others.
    pub fn forget(&self, dropped: &[KeptRow], kept: &[KeptRow]) -> Result<()> {
        let place = |row: &KeptRow| (row.chunk, row.first);
        let last = kept.iter().map(place).max();
        let behind = |place: &(u32, u32)| last.is_none_or(|last| *place > last);
        let Some((chunk, used)) = dropped.iter().map(place).filter(behind).min() else {
            return Ok(());
        };
        let rows = kept.len() as u32;
        self.state.set(&[KeptState { chunk, used, rows }])
    }

    /// Whether anything can be kept.
    pub fn keeps(&self) -> bool {
        self.lasting > 0
    }

    /// Chunks whose rows last.
    pub fn chunk_count(&self) -> u32 {
        self.lasting as u32
    }
}

/// Bytes of a row that all elements see.
fn row_bytes(shape: RowShape) -> u64 {
    let (plain, meso) = (shape.plain_blocks(), shape.meso_blocks());
    let table = (4 * u64::from(shape.blocks())).next_multiple_of(TEXEL_BYTES);
    table + u64::from(GROUP) * (2 * u64::from(plain) + 6 * u64::from(meso))
}
