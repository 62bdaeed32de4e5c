//! Rows: what a source gives each element. Each member of a team makes the part of a row to its own
//! elements; here the parts become rows.

use std::ops::AddAssign;

use serde::{Deserialize, Serialize};

use super::coupling::CouplingRow;
use crate::constants::RECEIVE_LISTS;
use crate::passes::types::{KeptRow, KeptState};

/// The row of one source, and what was counted while it was made.
pub(super) struct Row {
    pub source: u32,
    /// Of all form factors.
    pub scale: f32,
    /// Share of the source that its form factors take together, before they are scaled; none of a
    /// light without a surface, and in open scenes.
    pub share: Option<f32>,
    pub coupling: CouplingRow,
    /// Where each member keeps its part; none if one of them had no room.
    pub places: Option<Vec<KeptRow>>,
    /// `[face]`: meshlets kept, triangles tested, triangles drawn. Empty where rays found what is
    /// seen.
    pub counts: Vec<[u32; 3]>,
    /// Elements that see nothing of the source, whatever stands between.
    pub facing_away: u32,
    /// Elements in each of the lists of receivers, by how their form factor is found.
    pub listed: [u64; RECEIVE_LISTS as usize],
}

/// The part of a row that one member makes, as in [`Row`].
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct RowPart {
    pub source: u32,
    /// Form factors times areas, summed over each of the member's parcels; none in open scenes.
    pub sums: Vec<f32>,
    /// To the member's targets, and before form factors are scaled.
    pub coupling: CouplingRow,
    /// Chunk and first word.
    pub place: [u32; 2],
    /// Whether that lasts.
    pub has_room: bool,
    /// None of one that another member has drawn.
    pub counts: Vec<[u32; 3]>,
    pub facing_away: u32,
    pub listed: [u64; RECEIVE_LISTS as usize],
}

impl RowPart {
    /// What it takes to send it.
    pub fn bytes(&self) -> u64 {
        let rest = size_of_val(&self.sums[..]) + size_of_val(&self.counts[..]);
        self.coupling.bytes() + (rest + size_of_val(&self.listed) + 20) as u64
    }
}

/// A sum of form factors further off than this is no error of sampling: the source stands inside
/// another body.
const MOST_OFF: f64 = 0.05;

/// By what the form factors of a surface are multiplied that take so much of it together, so that
/// all that it sends arrives.
pub(super) fn scale_of(share: f64) -> f32 {
    match (share - 1.0).abs() <= MOST_OFF {
        true => (1.0 / share) as f32,
        false => 1.0,
    }
}

/// Seconds of each stage of a batch, by GPU timestamps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
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

/// A batch of parts of rows.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct MadeParts {
    pub rows: Vec<RowPart>,
    pub stages: Stages,
    /// How far the member's chunks were filled then.
    pub state: [u32; 3],
    /// Bytes that it gave to all others.
    pub given: u64,
}

/// A batch of rows.
pub(super) struct Made {
    pub rows: Vec<Row>,
    pub stages: Stages,
    /// How far each member's chunks were filled then; none where nothing was drawn.
    pub states: Option<Vec<KeptState>>,
    /// Bytes that the members gave to one another and to the first.
    pub sent: u64,
}
