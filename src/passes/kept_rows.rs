//! Kept rows on the device: the form factors of a source in 16 bits an element (48 with relief),
//! without the blocks of GROUP elements that see nothing of it.

use std::cmp::Ordering;
use std::sync::Arc;

use super::buffers::{download, filled, upload};
use super::fresh_rows::RowShape;
use super::types::{KeptRow, KeptState};
use crate::constants::GROUP;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, TEXEL_BYTES};

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

/// Bytes of a chunk, at most, unless asked otherwise.
pub const CHUNK_BYTES: u64 = 256 << 20;

/// What the chunks are made for.
#[derive(Debug, Clone, Copy)]
pub struct KeptSize {
    /// Bytes, at most.
    pub memory: u64,
    /// Bytes of a chunk, at most.
    pub chunk: u64,
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
        let chunk = match restored {
            Some(restored) => 4 * u64::from(restored.chunk_words),
            None => Self::chunk_bytes(device, shape, size),
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

    /// Bytes of a chunk. A row lies in one, so that a chunk may end with most of a row unused.
    pub fn chunk_bytes(device: &Device, shape: RowShape, size: KeptSize) -> u64 {
        let most = size.memory.min(row_bytes(shape) * u64::from(size.sources));
        let texels = device.limits().max_texels * TEXEL_BYTES;
        most.min(size.chunk)
            .min(texels)
            .next_multiple_of(TEXEL_BYTES)
    }

    /// How far the chunks are filled by all that was submitted.
    pub fn state_now(&self, device: &Arc<Device>) -> Result<KeptState> {
        Ok(download::<KeptState>(device, &self.state, 1)?[0])
    }

    /// How far the chunks are filled, and what they hold.
    pub fn download(&self, device: &Arc<Device>) -> Result<(KeptState, Vec<Vec<u32>>)> {
        let state = self.state_now(device)?;
        let full = (0..self.lasting).map(|chunk| {
            let end = self.words_before(chunk, state);
            download(device, &self.chunks[chunk], end)
        });
        Ok((state, full.collect::<Result<_>>()?))
    }

    /// The inverse of [`Self::download`].
    pub fn restore(&self, state: KeptState, chunks: &[&[u32]]) -> Result<()> {
        self.state.set(&[state])?;
        for (buffer, words) in self.chunks[..self.lasting].iter().zip(chunks) {
            buffer.set(words)?;
        }
        Ok(())
    }

    /// Words of a chunk that were filled before the state was this.
    fn words_before(&self, chunk: usize, state: KeptState) -> usize {
        match (chunk as u32).cmp(&state.chunk) {
            Ordering::Less => self.chunk_words as usize,
            Ordering::Equal => state.used as usize,
            Ordering::Greater => 0,
        }
    }

    /// What was filled between two states: chunks, and their words.
    fn filled(
        &self,
        [from, to]: [KeptState; 2],
    ) -> impl Iterator<Item = (&Buffer, std::ops::Range<usize>)> {
        let words = move |chunk: usize| {
            let words = self.words_before(chunk, from)..self.words_before(chunk, to);
            (!words.is_empty()).then_some((&self.chunks[chunk], words))
        };
        (0..self.lasting).filter_map(words)
    }

    /// Words that were filled between two states.
    pub fn words_between(&self, states: [KeptState; 2]) -> usize {
        self.filled(states).map(|(_, words)| words.len()).sum()
    }

    /// What was filled between two states.
    pub fn download_between(
        &self,
        device: &Arc<Device>,
        states: [KeptState; 2],
    ) -> Result<Vec<u32>> {
        let bytes = 4 * self.words_between(states) as u64;
        let readback = Buffer::new(device, "kept rows", bytes.max(4), BufferUse::Readback)?;
        Commands::run(device, "download kept rows", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Transfer]);
            let mut at = 0;
            for (chunk, words) in self.filled(states) {
                let bytes = 4 * words.len() as u64;
                cmd.copy(chunk, 4 * words.start as u64, &readback, at, bytes);
                at += bytes;
            }
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok(readback.read(0, (bytes / 4) as usize))
    }

    /// Fills with `words` what [`Self::download_between`] gave, and goes on from the second state.
    pub fn restore_between(
        &self,
        device: &Arc<Device>,
        states: [KeptState; 2],
        words: &[u32],
    ) -> Result<()> {
        assert_eq!(
            words.len(),
            self.words_between(states),
            "as many as were kept"
        );
        self.state.set(&[states[1]])?;
        if words.is_empty() {
            return Ok(());
        }
        let bytes = size_of_val(words) as u64;
        let mut upload = Buffer::new(device, "restored rows", bytes, BufferUse::Upload)?;
        upload.write(0, words);
        Commands::run(device, "restore kept rows", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Transfer]);
            let mut at = 0;
            for (chunk, words) in self.filled(states) {
                let bytes = 4 * words.len() as u64;
                cmd.copy(&upload, at, chunk, 4 * words.start as u64, bytes);
                at += bytes;
            }
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute, Stage::Transfer]);
            Ok(())
        })
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
    // One texel where a member of a team has no elements.
    let table = (4 * u64::from(shape.blocks().max(1))).next_multiple_of(TEXEL_BYTES);
    table + u64::from(GROUP) * (2 * u64::from(plain) + 6 * u64::from(meso))
}
