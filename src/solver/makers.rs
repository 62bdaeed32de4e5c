//! The row makers of one device.

use std::sync::Arc;

use rayon::prelude::*;

use super::rows::{Looks, RowMaker, RowParts, emitter_looks};
use super::{Estimator, Problem};
use crate::constants::KIND_BEAM;
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::passes::buffers::{SceneBuffers, upload};
use crate::passes::fresh_rows::{FreshRows, RowShape};
use crate::passes::kept_rows::KeptRows;
use crate::passes::occluder_tree::OccluderTree;
use crate::passes::types::{CouplingTarget, MesoElement};
use crate::vk::{BufferUse, Device};

/// How the rows of a source are made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
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

/// The row makers of a device.
pub(super) struct Makers {
    pub all: RowMaker,
    /// Of other kinds.
    others: Vec<(RowKind, RowMaker)>,
}

/// What the makers of every device are made from.
#[derive(Clone, Copy)]
pub(super) struct TeamParts<'a> {
    pub problem: &'a Problem,
    pub targets: &'a [CouplingTarget],
    /// Elements with a relief.
    pub meso: &'a [MesoElement],
    /// Kinds of the sources that are to be drawn.
    pub kinds: &'a [RowKind],
}

impl Makers {
    pub fn new(
        device: &Arc<Device>,
        parts: TeamParts<'_>,
        scene: &SceneBuffers,
        kept: Option<&KeptRows>,
    ) -> Result<Self> {
        let settings = &parts.problem.settings;
        let shape = RowShape::new(scene, parts.meso.len() as u32);
        let sorts = settings.estimator == Estimator::Receiver;
        let fresh = FreshRows::new(device, shape, parts.problem.slots, sorts)?;
        let meso = match parts.meso {
            [] => None,
            meso => Some(upload(device, "meso elements", meso, BufferUse::Storage)?),
        };
        let occluders = match settings.estimator {
            Estimator::Receiver => Some(OccluderTree::new(device, &parts.problem.occluder_tree)?),
            Estimator::Pixel | Estimator::Paper => None,
        };
        let row_parts = RowParts {
            settings,
            scene,
            targets: parts.targets,
            meso: meso.as_ref(),
            fresh: &fresh,
            occluders: occluders.as_ref(),
            kept,
        };
        let looks = |kind| match kind {
            RowKind::Common => Some(Looks::Hemicubes(settings.hemicube)),
            _ if !parts.kinds.contains(&kind) => None,
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
        let make = |kind| Some(RowMaker::new(device, &row_parts, looks(kind)?).map(|m| (kind, m)));
        // Most of this is compiling pipelines, which drivers do on the thread that asks.
        let mut makers = (kinds.into_par_iter().filter_map(make)).collect::<Result<Vec<_>>>()?;
        let (_, all) = makers.pop().expect("common sources are always drawn");
        Ok(Self {
            all,
            others: makers,
        })
    }

    /// Whether it makes rows of a kind other than as those of all others.
    pub fn has(&self, kind: RowKind) -> bool {
        self.others.iter().any(|(of, _)| *of == kind)
    }

    pub fn of(&mut self, kind: RowKind) -> &mut RowMaker {
        let other = self.others.iter_mut().find(|(of, _)| *of == kind);
        other.map_or(&mut self.all, |(_, maker)| maker)
    }
}
