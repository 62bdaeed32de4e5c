//! The row makers of one device.

use std::sync::Arc;

use super::rows::{Looks, RowMaker, RowParts, emitter_looks};
use super::{Estimator, Problem};
use crate::error::Result;
use crate::passes::buffers::{SceneBuffers, upload};
use crate::passes::fresh_rows::{FreshRows, RowShape};
use crate::passes::kept_rows::KeptRows;
use crate::passes::occluder_tree::OccluderTree;
use crate::passes::types::{CouplingTarget, MesoElement};
use crate::vk::{BufferUse, Device};

/// Rows of a batch, of sources of one kind.
#[derive(Debug, Clone)]
pub(super) struct Batch {
    pub sources: Vec<u32>,
    /// Whether they emit strongly, and are looked at with more care.
    pub strong: bool,
}

/// The row makers of a device.
pub(super) struct Makers {
    pub all: RowMaker,
    pub emitters: Option<RowMaker>,
}

/// What the makers of every device are made from.
#[derive(Clone, Copy)]
pub(super) struct TeamParts<'a> {
    pub problem: &'a Problem,
    pub targets: &'a [CouplingTarget],
    /// Elements with a relief.
    pub meso: &'a [MesoElement],
    /// Whether strong emitters are to be drawn.
    pub strong: bool,
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
            Estimator::Pixel => None,
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
        let looks = match parts.strong {
            true => emitter_looks(device, settings),
            false => None,
        };
        let emitters = looks.map(|looks| RowMaker::new(device, &row_parts, looks));
        let all = RowMaker::new(device, &row_parts, Looks::Hemicubes(settings.hemicube))?;
        Ok(Self {
            all,
            emitters: emitters.transpose()?,
        })
    }

    pub fn of(&mut self, strong: bool) -> &mut RowMaker {
        match (&mut self.emitters, strong) {
            (Some(emitters), true) => emitters,
            _ => &mut self.all,
        }
    }
}
