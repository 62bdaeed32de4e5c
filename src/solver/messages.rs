//! Commands of the first member of a team, and the replies to them.

use glam::Vec3;
use serde::{Deserialize, Serialize};

use super::Settings;
use super::gather::LitRow;
use super::makers::{Batch, RowKind};
use super::near::ByLight;
use super::relief_light::ReliefSums;
use super::rows::MadeParts;
use super::shares::Share;
use crate::passes::near_to_relief::NearParts;
use crate::passes::occluder_tree::TreeData;
use crate::passes::relief_buffers::ReliefData;
use crate::passes::scene_data::{LitSources, SceneData};
use crate::passes::types::KeptState;
use crate::passes::words::Words;

/// What all members are made from.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct MemberData {
    pub settings: Settings,
    pub scene: SceneData,
    pub relief: Option<ReliefData>,
    /// Of a scene with relief.
    pub near: Option<NearParts>,
    /// Of the `receiver` estimator.
    pub tree: Option<TreeData>,
    /// Sources of a batch.
    pub slots: u32,
}

/// What is one member's own.
#[derive(Clone, Serialize, Deserialize)]
pub(super) struct MemberShare {
    pub share: Share,
    /// Of its elements; words of a row of their own.
    pub targets: Words,
    /// Rows to begin with.
    pub restored: Option<RestoredRows>,
}

/// What is kept of rows in a member's chunks.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct RestoredRows {
    pub chunk_words: u32,
    /// See [`KeptState`].
    pub state: [u32; 3],
    pub chunks: Vec<Words>,
    /// Source, chunk and first word.
    pub places: Vec<[u32; 3]>,
}

/// What the first member asks of another.
#[derive(Clone, Serialize, Deserialize)]
pub(super) enum Command {
    /// Makes ready to draw sources of these kinds.
    Prepare(Vec<RowKind>),
    /// Begins a batch. Not answered: the first goes on meanwhile.
    Submit(Batch),
    /// The oldest batch.
    Take,
    Gather(Vec<LitRow>),
    /// What its sources reflect.
    Measure,
    Irradiance,
    Near(ByLight<Vec<Vec3>>),
    Light,
    Relight {
        lit: LitSources,
        more_eyes: bool,
        /// Sources whose rows are not theirs any more.
        dropped: Vec<u32>,
        /// Nothing that was made to draw may be used again.
        unprepared: bool,
    },
    /// Room for kept rows, and the device.
    Room,
    /// How far the chunks are filled.
    State,
    /// Words that were filled between two states.
    Words([[u32; 3]; 2]),
    /// What [`Self::Words`] gave, up to a state, and where rows lie in it.
    Restore {
        state: [u32; 3],
        words: Words,
        places: Vec<[u32; 3]>,
    },
    /// All that is kept.
    Rows,
}

impl Command {
    /// Whether the first waits for what the others answer.
    pub fn is_answered(&self) -> bool {
        !matches!(self, Self::Submit(_))
    }
}

/// What a member answers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) enum Reply {
    Done,
    /// Slots of a batch of common sources and of those of other kinds.
    Prepared(Vec<(RowKind, usize)>),
    Made(MadeParts),
    /// `[own source]`
    Reflected(Vec<Vec3>),
    /// Direct and indirect, `[own element]`.
    Irradiance([Vec<Vec3>; 2]),
    Light([Vec<Vec3>; 2], Option<ReliefSums>),
    /// Words of a chunk, and chunks; the device and its driver.
    Room([u32; 2], [String; 2]),
    State([u32; 3]),
    Words(Words),
    Rows(RestoredRows),
}

pub(super) fn kept_state([chunk, used, rows]: [u32; 3]) -> KeptState {
    KeptState { chunk, used, rows }
}

pub(super) fn state_words(state: KeptState) -> [u32; 3] {
    [state.chunk, state.used, state.rows]
}
