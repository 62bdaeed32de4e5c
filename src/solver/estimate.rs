//! From what is seen to form factors, by estimator.

use std::sync::Arc;

use super::Estimator;
use super::row_maker::RowParts;
use crate::error::Result;
use crate::passes::batch::{Batch, Sight};
use crate::passes::bin_pixels::BinPixels;
use crate::passes::couple::Couple;
use crate::passes::cull::Culling;
use crate::passes::form_factors::{Care, FormFactors};
use crate::passes::light_rows::LightRows;
use crate::passes::near_rows::NearRows;
use crate::vk::{Commands, Device, Stage};

/// The passes between a batch's item buffers and its form factors.
#[allow(clippy::large_enum_variant)] // one or two of them live as long as the solver
pub(super) enum Evaluate {
    Receivers {
        form_factors: FormFactors,
        near: NearRows,
        /// In enclosed scenes.
        sums: Option<Couple>,
    },
    Pixels(BinPixels),
    Lights(LightRows),
}

impl Evaluate {
    pub fn new(device: &Arc<Device>, parts: &RowParts<'_>, batch: &Batch) -> Result<Self> {
        let RowParts {
            settings,
            scene,
            meso,
            fresh,
            ..
        } = *parts;
        if settings.estimator == Estimator::Pixel {
            return Ok(Self::Pixels(BinPixels::new(device, scene, batch, fresh)?));
        }
        let care = Care {
            culls: settings.culling != Culling::Off,
            silhouettes: settings.silhouettes,
            places: match batch.sight {
                Sight::Hemicubes(_) => settings.places,
                Sight::Rays(_) => settings.emitter_places,
            },
        };
        let sums = || Couple::to_parcels(device, scene, batch, fresh, parts.parcels);
        Ok(Self::Receivers {
            form_factors: FormFactors::new(device, scene, batch, fresh, meso, care)?,
            near: NearRows::new(device, scene, batch, fresh)?,
            sums: scene.enclosed.then(sums).transpose()?,
        })
    }

    /// Sums of the form factors to each slot's source, in enclosed scenes.
    pub fn sums(&self) -> Option<&Couple> {
        match self {
            Self::Receivers { sums, .. } => sums.as_ref(),
            Self::Pixels(_) | Self::Lights(_) => None,
        }
    }

    /// Ends with a barrier before compute passes. Calls `stamp` twice: when it is sorted which
    /// elements see the sources, and when rays have decided where that was left open.
    pub fn record(&self, cmd: &Commands, mut stamp: impl FnMut()) {
        cmd.part();
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        match self {
            Self::Receivers {
                form_factors,
                near,
                sums,
            } => {
                form_factors.record(cmd, stamp);
                cmd.part();
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                near.record(cmd);
                if let Some(sums) = sums {
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                    sums.record(cmd);
                }
            }
            Self::Pixels(bin) => {
                stamp();
                stamp();
                bin.record(cmd);
            }
            Self::Lights(rows) => {
                stamp();
                stamp();
                rows.record(cmd);
            }
        }
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}
