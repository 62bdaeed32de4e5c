//! The devices of a bake. Each holds the scene and makes rows; the first one keeps them.
//!
//! A batch is shared out source by source as devices become free. Who makes a row changes nothing
//! of it, and rows are kept in the order of the batch, so that devices of one kind and driver give
//! the same bytes, however many they are.

use std::collections::VecDeque;
use std::sync::Arc;

use super::makers::{Batch, Makers, RowKind, TeamParts};
use super::rows::Made;
use super::several::Several;
use crate::error::Result;
use crate::passes::kept_rows::{KeptRows, SCRATCH};
use crate::vk::Device;

/// What makes rows and keeps them.
#[allow(clippy::large_enum_variant)] // one of them lives as long as the solver
pub(super) enum Team {
    Alone {
        makers: Makers,
        /// The batches under way.
        kinds: VecDeque<RowKind>,
    },
    Several(Several),
}

impl Team {
    /// The first device holds the problem and keeps the rows.
    pub fn new(devices: &[Arc<Device>], parts: TeamParts<'_>, kept: &KeptRows) -> Result<Self> {
        if let [device] = devices {
            return Ok(Self::Alone {
                makers: Makers::new(device, parts, &parts.problem.scene, Some(kept))?,
                kinds: VecDeque::new(),
            });
        }
        Ok(Self::Several(Several::new(devices, parts, kept)?))
    }

    pub fn is_alone(&self) -> bool {
        matches!(self, Self::Alone { .. })
    }

    /// Whether rows of a kind are made other than those of all others.
    pub fn has(&self, kind: RowKind) -> bool {
        matches!(self, Self::Alone { makers, .. } if makers.has(kind))
    }

    /// Sources of a batch of one kind, at most.
    pub fn slots(&mut self, kind: RowKind) -> usize {
        match self {
            Self::Alone { makers, .. } => makers.of(kind).slots(),
            Self::Several(several) => several.slots(),
        }
    }

    /// Whether another batch can begin: two may be under way, of one kind.
    pub fn has_room(&self, kind: RowKind) -> bool {
        let under_way: Vec<RowKind> = match self {
            Self::Alone { kinds, .. } => kinds.iter().copied().collect(),
            Self::Several(several) => several.under_way().collect(),
        };
        under_way.len() < SCRATCH as usize && under_way.iter().all(|&of| of == kind)
    }

    pub fn submit(&mut self, batch: Batch) -> Result<()> {
        match self {
            Self::Alone { makers, kinds } => {
                makers.of(batch.kind).submit(&batch.sources)?;
                kinds.push_back(batch.kind);
            }
            Self::Several(several) => several.submit(batch),
        }
        Ok(())
    }

    /// The oldest batch under way, kept; none if there is none.
    pub fn take(&mut self, kept: &KeptRows) -> Result<Option<Made>> {
        match self {
            Self::Alone { makers, kinds } => match kinds.pop_front() {
                Some(kind) => makers.of(kind).take(),
                None => Ok(None),
            },
            Self::Several(several) => several.take(kept),
        }
    }

    /// The item buffers of the last batch that was drawn, `[row][slot][column]`; none of several
    /// devices.
    pub fn items(&self) -> Result<Vec<u32>> {
        match self {
            Self::Alone { makers, .. } => makers.all.items(),
            Self::Several(_) => Ok(Vec::new()),
        }
    }
}
