//! The row makers of one member, and the batches that they have under way.
//!
//! Members give away the item buffers that they draw a batch before these are needed: a device that
//! is slower in one batch and faster in another keeps nobody waiting.

use std::collections::VecDeque;
use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Estimator;
use super::exchange::Lent;
use super::row_maker::{Looks, RowMaker, RowParts, SETS, emitter_looks};
use super::rows::MadeParts;
use super::shared_items::Asked;
use crate::constants::KIND_BEAM;
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::passes::batch::Batch as DrawnBatch;
use crate::vk::Device;

/// How the rows of a source are made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub(super) enum RowKind {
    /// It emits strongly, and is looked at with more care.
    Strong,
    /// It is a sun or a part of the sky.
    Far,
    /// A light whose intensity depends on the direction.
    Beam,
    #[default]
    Common,
}

impl RowKind {
    /// `strong`: whether it emits strongly, and such are looked at with more care.
    pub fn new(source: &Source, strong: bool) -> Self {
        match source.kind {
            KIND_BEAM => Self::Beam,
            _ if source.is_far() => Self::Far,
            _ if strong => Self::Strong,
            _ => Self::Common,
        }
    }
}

/// Rows of a batch, of sources of one kind.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct Batch {
    pub sources: Vec<u32>,
    pub kind: RowKind,
}

/// Batches under way at once; the last of them is drawn.
pub(super) const UNDER_WAY: usize = SETS + 1;

/// The row makers of a member.
pub(super) struct Makers {
    all: RowMaker,
    /// Of other kinds.
    others: Vec<(RowKind, RowMaker)>,
    /// Batches that are to be evaluated, of which item buffers that are shared out are drawn and
    /// given away, oldest first.
    waiting: VecDeque<Asked>,
    /// Batches that the device evaluates, oldest first.
    evaluated: VecDeque<Asked>,
    /// The set of the next of these.
    next: usize,
    /// When the batch that was taken last ended, if another one waited for it.
    ended: Option<f64>,
}

impl Makers {
    /// For sources of these kinds, and common ones.
    ///
    /// # Errors
    /// A device that fails, or without the memory.
    pub fn new(device: &Arc<Device>, parts: &RowParts<'_>, wanted: &[RowKind]) -> Result<Self> {
        let settings = parts.settings;
        let looks = |kind| match kind {
            RowKind::Common => Some(Looks::Hemicubes(settings.hemicube)),
            _ if !wanted.contains(&kind) => None,
            RowKind::Strong => emitter_looks(device, settings),
            RowKind::Far => Some(Looks::Lights { beams: false }),
            RowKind::Beam => Some(Looks::Lights { beams: true }),
        };
        let kinds = [
            RowKind::Strong,
            RowKind::Far,
            RowKind::Beam,
            RowKind::Common,
        ];
        let make = |kind| Some(RowMaker::new(device, parts, looks(kind)?).map(|m| (kind, m)));
        // Most of this is compiling pipelines, which drivers do on the thread that asks.
        let mut makers = (kinds.into_par_iter().filter_map(make)).collect::<Result<Vec<_>>>()?;
        let (_, all) = makers.pop().expect("common sources are always drawn");
        Ok(Self {
            all,
            others: makers,
            waiting: VecDeque::new(),
            evaluated: VecDeque::new(),
            next: 0,
            ended: None,
        })
    }

    /// Kinds of which it makes rows other than as those of all others.
    pub fn kinds(&self) -> Vec<RowKind> {
        self.others.iter().map(|(of, _)| *of).collect()
    }

    /// Sources of a batch of this kind, at most.
    pub fn slots(&self, kind: RowKind) -> usize {
        let other = self.others.iter().find(|(of, _)| *of == kind);
        other.map_or(&self.all, |(_, maker)| maker).slots()
    }

    /// The batch that common sources are drawn in.
    pub fn batch(&self) -> &DrawnBatch {
        self.all.batch()
    }

    fn of(&mut self, kind: RowKind) -> &mut RowMaker {
        let other = self.others.iter_mut().find(|(of, _)| *of == kind);
        other.map_or(&mut self.all, |(_, maker)| maker)
    }

    /// Begins a batch. Where item buffers are shared out, this member's are drawn before those that
    /// are waiting are evaluated.
    ///
    /// # Errors
    /// A device that fails; another member that does.
    pub fn submit(&mut self, batch: Batch, mut exchange: Lent<'_>) -> Result<()> {
        let Batch { sources, kind } = batch;
        let under_way = self.waiting.len() + self.evaluated.len();
        assert!(sources.len() <= self.slots(kind) && under_way < UNDER_WAY);
        let mut asked = Asked {
            sources,
            kind,
            ..Asked::default()
        };
        self.of(kind).draw(&asked, exchange.as_deref_mut())?;
        self.go_on(exchange.as_deref_mut())?;
        self.of(kind).give(&mut asked, exchange.as_deref_mut())?;
        self.waiting.push_back(asked);
        // What others give is asked for when the next batch is drawn.
        match self.of(kind).shares() {
            true => Ok(()),
            false => self.go_on(exchange),
        }
    }

    /// Evaluates what is waiting, as far as there is room.
    fn go_on(&mut self, mut exchange: Lent<'_>) -> Result<()> {
        while self.evaluated.len() < SETS {
            let Some(asked) = self.waiting.pop_front() else {
                break;
            };
            let set = self.next;
            let maker = self.of(asked.kind);
            maker.evaluate(set, &asked, exchange.as_deref_mut())?;
            self.evaluated.push_back(asked);
            self.next = (set + 1) % SETS;
        }
        Ok(())
    }

    /// Waits for the oldest batch under way; none if there is none. Its rows that find no room last
    /// until the next call.
    ///
    /// # Errors
    /// As [`Self::submit`].
    pub fn take(&mut self, exchange: Lent<'_>) -> Result<Option<MadeParts>> {
        self.go_on(exchange)?;
        let Some(asked) = self.evaluated.pop_front() else {
            return Ok(None);
        };
        let set = (self.next + SETS - self.evaluated.len() - 1) % SETS;
        let (mut made, [began, ended]) = self.of(asked.kind).take(set, asked)?;
        // What is shared out of the next batch was drawn in between.
        let next = self.evaluated.front().or(self.waiting.front());
        let drawn: f64 = next.map_or(0.0, |next| next.drawing.iter().sum());
        let idle = self.ended.map(|ended| (began - ended - drawn).max(0.0));
        made.stages.idle = idle.unwrap_or(0.0);
        self.ended = (!self.evaluated.is_empty()).then_some(ended);
        Ok(Some(made))
    }

    /// Whether rows come from the elements, not from pixels.
    pub fn sorts(settings: &super::Settings) -> bool {
        settings.estimator == Estimator::Receiver
    }
}
