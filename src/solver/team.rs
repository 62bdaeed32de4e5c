//! The devices of a bake. Each holds the scene and makes rows; the first one keeps them.
//!
//! A batch is shared out source by source as devices become free. Who makes a row changes nothing
//! of it, and rows are kept in the order of the batch, so that devices of one kind and driver give
//! the same bytes, however many they are.

use std::collections::VecDeque;
use std::sync::Arc;

use super::makers::{Batch, Makers, RowKind, TeamParts};
use super::rows::{Factors, Made, Row, Stages};
use super::several::Several;
use crate::error::Result;
use crate::passes::kept_rows::{KeptRows, SCRATCH};
use crate::vk::Device;

/// What makes rows and keeps them.
pub(super) struct Team {
    members: Members,
    /// Oldest first.
    under_way: VecDeque<UnderWay>,
}

#[allow(clippy::large_enum_variant)] // one of them lives as long as the solver
enum Members {
    Alone(Makers),
    Several(Several),
}

struct UnderWay {
    kind: RowKind,
    /// Rows that were made before; those of them without room are drawn again.
    recorded: Option<Vec<Row>>,
    is_drawn: bool,
}

/// A batch that was taken in.
pub(super) struct Taken {
    pub kind: RowKind,
    pub made: Made,
    /// Whether it was made before.
    pub recorded: bool,
}

impl Team {
    /// The first device holds the problem and keeps the rows.
    pub fn new(devices: &[Arc<Device>], parts: TeamParts<'_>, kept: &KeptRows) -> Result<Self> {
        let members = match devices {
            [device] => {
                let makers = Makers::new(device, parts, &parts.problem.scene, Some(kept))?;
                Members::Alone(makers)
            }
            _ => Members::Several(Several::new(devices, parts, kept)?),
        };
        Ok(Self {
            members,
            under_way: VecDeque::new(),
        })
    }

    pub fn is_alone(&self) -> bool {
        matches!(self.members, Members::Alone(_))
    }

    /// Whether rows of a kind are made other than those of all others.
    pub fn has(&self, kind: RowKind) -> bool {
        matches!(&self.members, Members::Alone(makers) if makers.has(kind))
    }

    /// Sources of a batch of one kind, at most.
    pub fn slots(&mut self, kind: RowKind) -> usize {
        match &mut self.members {
            Members::Alone(makers) => makers.of(kind).slots(),
            Members::Several(several) => several.slots(),
        }
    }

    /// Whether another batch can begin: two may be under way, of one kind.
    pub fn has_room(&self, kind: RowKind) -> bool {
        let under_way = &self.under_way;
        under_way.len() < SCRATCH as usize && under_way.iter().all(|batch| batch.kind == kind)
    }

    /// Whether a batch is under way.
    pub fn is_drawing(&self) -> bool {
        !self.under_way.is_empty()
    }

    /// Begins a batch, of which rows may be `recorded`.
    pub fn submit(
        &mut self,
        batch: Batch,
        recorded: Option<Vec<Row>>,
        kept: &KeptRows,
    ) -> Result<()> {
        let kind = batch.kind;
        let sources: Vec<u32> = match &recorded {
            None => batch.sources,
            Some(rows) => {
                let loose = rows.iter().filter(|row| !has_place(row, kept));
                loose.map(|row| row.source).collect()
            }
        };
        let is_drawn = !sources.is_empty();
        if is_drawn {
            let batch = Batch { sources, kind };
            match &mut self.members {
                Members::Alone(makers) => makers.of(kind).submit(&batch.sources)?,
                Members::Several(several) => several.submit(batch),
            }
        }
        self.under_way.push_back(UnderWay {
            kind,
            recorded,
            is_drawn,
        });
        Ok(())
    }

    /// The oldest batch under way, kept; none if there is none.
    pub fn take(&mut self, kept: &KeptRows) -> Result<Option<Taken>> {
        let Some(batch) = self.under_way.pop_front() else {
            return Ok(None);
        };
        let kind = batch.kind;
        let drawn = match &mut self.members {
            _ if !batch.is_drawn => None,
            Members::Alone(makers) => makers.of(kind).take()?,
            Members::Several(several) => several.take(kept)?,
        };
        let mut made = drawn.unwrap_or(Made {
            rows: Vec::new(),
            stages: Stages::default(),
            state: None,
        });
        let recorded = batch.recorded.is_some();
        if let Some(rows) = batch.recorded {
            let mut drawn = made.rows.into_iter();
            let known = |row: Row| match has_place(&row, kept) {
                true => Some(row),
                false => drawn.next(),
            };
            made.rows = rows.into_iter().filter_map(known).collect();
        }
        Ok(Some(Taken {
            kind,
            made,
            recorded,
        }))
    }

    /// The item buffers of the last batch that was drawn, `[row][slot][column]`; none of several
    /// devices.
    pub fn items(&self) -> Result<Vec<u32>> {
        match &self.members {
            Members::Alone(makers) => makers.all.items(),
            Members::Several(_) => Ok(Vec::new()),
        }
    }
}

fn has_place(row: &Row, kept: &KeptRows) -> bool {
    matches!(row.factors, Factors::Kept(place) if place.chunk < kept.chunk_count())
}
