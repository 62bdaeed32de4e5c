//! The row makers of one member.

use std::sync::Arc;

use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Estimator;
use super::row_maker::{Looks, RowMaker, RowParts, emitter_looks};
use crate::constants::KIND_BEAM;
use crate::error::Result;
use crate::mesh::sources::Source;
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
#[derive(Debug, Clone)]
pub(super) struct Batch {
    pub sources: Vec<u32>,
    pub kind: RowKind,
}

/// The row makers of a member.
pub(super) struct Makers {
    pub all: RowMaker,
    /// Of other kinds.
    others: Vec<(RowKind, RowMaker)>,
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
        })
    }

    /// Kinds of which it makes rows other than as those of all others.
    pub fn kinds(&self) -> Vec<RowKind> {
        self.others.iter().map(|(of, _)| *of).collect()
    }

    pub fn of(&mut self, kind: RowKind) -> &mut RowMaker {
        let other = self.others.iter_mut().find(|(of, _)| *of == kind);
        other.map_or(&mut self.all, |(_, maker)| maker)
    }

    /// Whether rows come from the elements, not from pixels.
    pub fn sorts(settings: &super::Settings) -> bool {
        settings.estimator == Estimator::Receiver
    }
}
