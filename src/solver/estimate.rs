//! From what is seen to form factors, by estimator.

use std::sync::Arc;

use super::{Estimator, Settings};
use crate::error::Result;
use crate::passes::batch::{Batch, Sight};
use crate::passes::bin_pixels::{self, BinPixels};
use crate::passes::buffers::SceneBuffers;
use crate::passes::cull::Culling;
use crate::passes::form_factors::{self, FormFactors, SeenBy, Sorting};
use crate::passes::fresh_rows::FreshRows;
use crate::passes::normalise::Normalise;
use crate::vk::{Buffer, Commands, DescriptorSet, Device, Stage};

/// The passes between a batch's item buffers and its form factors.
#[allow(clippy::large_enum_variant)] // one or two of them live as long as the solver
pub(super) enum Evaluate {
    Receivers {
        form_factors: FormFactors,
        /// In enclosed scenes.
        normalise: Option<Normalise>,
    },
    Pixels(BinPixels),
}

/// What they are bound to.
#[allow(clippy::large_enum_variant)] // as above
pub(super) enum Evaluated {
    Receivers {
        form_factors: form_factors::Sets,
        normalise: Option<DescriptorSet>,
    },
    Pixels(bin_pixels::Bound),
}

impl Evaluate {
    pub fn new(
        device: &Arc<Device>,
        settings: &Settings,
        scene: &SceneBuffers,
        meso: Option<&Buffer>,
        batch: &Batch,
    ) -> Result<Self> {
        if settings.estimator == Estimator::Pixel {
            return Ok(Self::Pixels(BinPixels::new(device)?));
        }
        let sorting = Sorting {
            seen_by: match batch.sight {
                Sight::Hemicubes(_) => SeenBy::ItemBuffer,
                Sight::Rays(_) => SeenBy::ShadowRays,
            },
            culls: settings.culling != Culling::Off,
        };
        Ok(Self::Receivers {
            form_factors: FormFactors::new(device, meso.is_some(), sorting)?,
            normalise: (scene.enclosed.then(|| Normalise::new(device))).transpose()?,
        })
    }

    pub fn bind(
        &self,
        device: &Arc<Device>,
        scene: &SceneBuffers,
        batch: &Batch,
        fresh: &FreshRows,
        meso: Option<&Buffer>,
    ) -> Result<Evaluated> {
        Ok(match self {
            Self::Receivers {
                form_factors,
                normalise,
            } => Evaluated::Receivers {
                form_factors: form_factors.bind(scene, batch, fresh, meso)?,
                normalise: (normalise.as_ref())
                    .map(|n| n.bind(scene, batch, fresh))
                    .transpose()?,
            },
            Self::Pixels(bin) => Evaluated::Pixels(bin.bind(device, scene, batch, fresh)?),
        })
    }

    /// Ends with a barrier before compute passes.
    pub fn record(&self, cmd: &Commands, bound: &Evaluated, batch: &Batch, fresh: &FreshRows) {
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        match (self, bound) {
            (
                Self::Receivers {
                    form_factors,
                    normalise,
                },
                Evaluated::Receivers {
                    form_factors: sets,
                    normalise: set,
                },
            ) => {
                form_factors.record(cmd, sets, batch, fresh);
                if let (Some(normalise), Some(set)) = (normalise, set) {
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                    normalise.record(cmd, set, batch, fresh);
                }
            }
            (Self::Pixels(bin), Evaluated::Pixels(bound)) => bin.record(cmd, bound, batch, fresh),
            _ => unreachable!("bound as it was made"),
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}
