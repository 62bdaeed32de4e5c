//! What a batch did, and how it comes back from the device.

use crate::constants::FACES;
use crate::passes::batch::{Batch, Hemicubes, Sight};
use crate::passes::buffers::State;
use crate::passes::types::Progress;
use crate::vk::{Buffer, Commands, Stage};

/// Seconds of each stage of a batch, by GPU timestamps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stages {
    /// Measuring unshot power and choosing sources.
    pub select: f64,
    pub cull: f64,
    pub item_buffer: f64,
    /// Form factors.
    pub bin: f64,
    /// Irradiance from form factors, fresh and kept, and keeping them; `receiver` alone.
    pub gather: f64,
}

/// One more than the stages.
pub(super) const STAMPS: u32 = 6;

impl Stages {
    /// From the intervals between a batch's timestamps.
    pub(super) fn new(intervals: &[f64]) -> Self {
        let &[select, cull, item_buffer, bin, gather] = intervals else {
            unreachable!("a batch has {STAMPS} timestamps");
        };
        Self {
            select,
            cull,
            item_buffer,
            bin,
            gather,
        }
    }
}

impl std::ops::AddAssign for Stages {
    fn add_assign(&mut self, other: Self) {
        self.select += other.select;
        self.cull += other.cull;
        self.item_buffer += other.item_buffer;
        self.bin += other.bin;
        self.gather += other.gather;
    }
}

/// What a batch did.
#[derive(Debug, Clone)]
pub struct BatchResult {
    pub progress: Progress,
    pub stages: Stages,
    /// `[slot][face]`: meshlets kept, triangles tested, triangles drawn. Empty where shadow rays tell what is seen.
    pub counts: Vec<[u32; 3]>,
}

/// Where a batch's results lie in its readback buffer: progress, then counts.
pub(super) struct ReadbackLayout {
    regions: usize,
    counts: u64,
    pub bytes: u64,
}

impl ReadbackLayout {
    pub fn new(batch: &Batch) -> Self {
        let regions = match batch.sight {
            Sight::Hemicubes(_) => (batch.slot_count * FACES) as usize,
            Sight::Rays(_) => 0,
        };
        let counts = size_of::<Progress>() as u64;
        Self {
            regions,
            counts,
            bytes: counts + (regions * size_of::<[u32; 3]>()) as u64,
        }
    }

    pub fn record(&self, cmd: &Commands, state: &State, batch: &Batch, to: &Buffer) {
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        cmd.copy(&state.progress, 0, to, 0, self.counts);
        if let Sight::Hemicubes(Hemicubes { counts, .. }) = &batch.sight {
            cmd.copy(counts, 0, to, self.counts, self.bytes - self.counts);
        }
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
    }

    pub fn read(&self, readback: &Buffer, stages: Stages) -> BatchResult {
        BatchResult {
            progress: readback.read::<Progress>(0, 1)[0],
            stages,
            counts: readback.read(self.counts, self.regions),
        }
    }
}
