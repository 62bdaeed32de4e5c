//! The passes between the item buffer and irradiance, by estimator and by whether the scene has relief, bound to the buffers of
//! one problem.

use std::sync::Arc;

use super::batch::OnDevice;
use super::{Estimator, Settings};
use crate::error::Result;
use crate::passes::batch::{Batch, Sight};
use crate::passes::bin_pixels::{self, BinPixels};
use crate::passes::cull::Culling;
use crate::passes::form_factors::{self, FacingAway, FormFactors, SeenBy, Sorting};
use crate::passes::gather::{self, Gather, GatherRelief};
use crate::passes::keep::{self, Keep};
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::normalise::Normalise;
use crate::passes::pixels_relief::{self, PixelsRelief};
use crate::passes::recall::Recall;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::send_relief::SendRelief;
use crate::vk::{Commands, DescriptorSet, Device, Stage};

/// How sources with a relief send. Shots are many and most of their light is even, so that where form factors are kept all is first
/// solved as if it were, and what leaves in other directions is sent after.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sending {
    Evenly,
    ByDirection,
}

/// Pipelines, for any number of batches.
#[allow(clippy::large_enum_variant)] // one of them lives as long as the solver
pub(super) enum Estimate {
    Receivers {
        form_factors: FormFactors,
        /// See [`Sorting`].
        culls: bool,
        /// In enclosed scenes.
        normalise: Option<Normalise>,
        /// None where nothing is to be kept.
        keep: Option<Keep>,
        gather: GatherBy,
    },
    Pixels(BinPixels),
    PixelsRelief(PixelsRelief),
}

#[allow(clippy::large_enum_variant)] // as above
pub(super) enum GatherBy {
    Plain(Gather),
    Relief(GatherRelief),
}

/// What they are bound to for one batch.
#[allow(clippy::large_enum_variant)] // one or two of them live as long as the solver
pub(super) enum Bound {
    Receivers {
        /// Of a batch that asks shadow rays.
        by_rays: Option<FormFactors>,
        form_factors: form_factors::Sets,
        normalise: Option<DescriptorSet>,
        keep: Option<keep::Sets>,
        gather: GatherSets,
    },
    Pixels(bin_pixels::Buffers),
    PixelsRelief(pixels_relief::Buffers),
}

pub(super) enum GatherSets {
    Plain(gather::Sets),
    Relief(gather::ReliefSets),
}

fn form_factors(
    device: &Arc<Device>,
    on: &OnDevice<'_>,
    (seen_by, culls): (SeenBy, bool),
) -> Result<FormFactors> {
    let sorting = Sorting {
        seen_by,
        facing_away: FacingAway::ByElement,
        culls,
    };
    FormFactors::new(device, on.relief.is_some(), sorting)
}

impl Estimate {
    pub fn new(device: &Arc<Device>, settings: &Settings, on: &OnDevice<'_>) -> Result<Self> {
        let receives = settings.estimator == Estimator::Receiver;
        let Some(factors) = on.factors.filter(|_| receives) else {
            return Ok(match on.relief {
                Some(_) => Self::PixelsRelief(PixelsRelief::new(device)?),
                None => Self::Pixels(BinPixels::new(device)?),
            });
        };
        let normalise = on.scene.enclosed.then(|| Normalise::new(device));
        let keep = factors.keeps().then(|| Keep::new(device));
        let culls = settings.culling != Culling::Off;
        Ok(Self::Receivers {
            form_factors: form_factors(device, on, (SeenBy::ItemBuffer, culls))?,
            culls,
            normalise: normalise.transpose()?,
            keep: keep.transpose()?,
            gather: match on.relief {
                None => GatherBy::Plain(Gather::new(device)?),
                Some(_) => GatherBy::Relief(GatherRelief::new(device)?),
            },
        })
    }

    pub fn bind(&self, device: &Arc<Device>, batch: &Batch, on: &OnDevice<'_>) -> Result<Bound> {
        let (scene, state) = (on.scene, on.state);
        Ok(match (self, on.factors, on.relief) {
            (
                Self::Receivers {
                    form_factors,
                    culls,
                    normalise,
                    keep,
                    gather,
                },
                Some(factors),
                relief,
            ) => {
                let by_rays = match batch.sight {
                    Sight::Hemicubes(_) => None,
                    Sight::Rays(_) => Some(self::form_factors(
                        device,
                        on,
                        (SeenBy::ShadowRays, *culls),
                    )?),
                };
                Bound::Receivers {
                    form_factors: by_rays.as_ref().unwrap_or(form_factors).bind(
                        device,
                        (scene, &state.facing_away),
                        batch,
                        factors,
                        relief.map(|relief| &relief.elements),
                    )?,
                    by_rays,
                    normalise: (normalise.as_ref())
                        .map(|n| n.bind(scene, batch, factors))
                        .transpose()?,
                    keep: (keep.as_ref())
                        .map(|k| k.bind(state, batch, factors))
                        .transpose()?,
                    gather: match (gather, relief) {
                        (GatherBy::Plain(gather), _) => {
                            GatherSets::Plain(gather.bind(device, state, batch, factors)?)
                        }
                        (GatherBy::Relief(gather), Some(relief)) => {
                            let lit = (scene, state);
                            GatherSets::Relief(gather.bind(device, lit, batch, factors, relief)?)
                        }
                        (GatherBy::Relief(_), None) => unreachable!("made for a scene with relief"),
                    },
                }
            }
            (Self::Pixels(pass), ..) => Bound::Pixels(pass.bind(device, scene, state, batch)?),
            (Self::PixelsRelief(pass), _, Some(relief)) => {
                Bound::PixelsRelief(pass.bind(device, scene, state, batch, relief)?)
            }
            _ => unreachable!("made for what is on the device"),
        })
    }

    /// `found` is recorded between form factors and irradiance.
    pub fn record(
        &self,
        cmd: &Commands,
        bound: &Bound,
        batch: &Batch,
        on: &OnDevice<'_>,
        sending: Sending,
        found: impl FnOnce(),
    ) {
        match (self, bound, on.factors, on.relief) {
            (
                Self::Receivers {
                    form_factors,
                    normalise,
                    ..
                },
                Bound::Receivers {
                    by_rays,
                    form_factors: sets,
                    normalise: normalise_set,
                    ..
                },
                Some(factors),
                _,
            ) => {
                let form_factors = by_rays.as_ref().unwrap_or(form_factors);
                cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
                form_factors.record(cmd, sets, batch, factors);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                if let (Some(normalise), Some(set)) = (normalise, normalise_set) {
                    normalise.record(cmd, set, batch, factors);
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                }
                found();
                self.record_gather(cmd, bound, batch, on, sending);
            }
            (Self::Pixels(pass), Bound::Pixels(buffers), ..) => {
                pass.record(cmd, buffers, on.scene, batch);
                found();
            }
            (Self::PixelsRelief(pass), Bound::PixelsRelief(buffers), _, Some(relief)) => {
                pass.record(cmd, buffers, relief, batch);
                found();
            }
            _ => unreachable!("bound as it was made"),
        }
    }

    /// Keeps fresh form factors and gathers by all; of the `receiver` estimator.
    pub fn record_gather(
        &self,
        cmd: &Commands,
        bound: &Bound,
        batch: &Batch,
        on: &OnDevice<'_>,
        sending: Sending,
    ) {
        let (
            Self::Receivers { keep, gather, .. },
            Bound::Receivers {
                keep: keep_sets,
                gather: gather_sets,
                ..
            },
            Some(factors),
        ) = (self, bound, on.factors)
        else {
            unreachable!("asked for where there are form factors")
        };
        if let (Some(keep), Some(sets)) = (keep, keep_sets) {
            keep.record(cmd, sets, batch, factors);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        }
        match (gather, gather_sets, on.relief) {
            (GatherBy::Plain(gather), GatherSets::Plain(sets), _) => {
                gather.record(cmd, sets, batch, factors);
            }
            (GatherBy::Relief(gather), GatherSets::Relief(sets), Some(relief)) => match sending {
                Sending::Evenly => gather.record_evenly(cmd, sets, relief, batch, factors),
                Sending::ByDirection => gather.record(cmd, sets, relief, batch, factors),
            },
            _ => unreachable!("bound as it was made"),
        }
    }

    /// Whether all is sent evenly first: not where sources with a relief emit, nor where what follows would have to be drawn anew.
    pub fn sends_evenly_first(&self, on: &OnDevice<'_>) -> bool {
        matches!(self, Self::Receivers { keep: Some(_), .. })
            && on
                .factors
                .is_some_and(|f| f.has_room_for(on.scene.source_count))
            && on.relief.is_some_and(|relief| !relief.glows)
    }

    /// Elements with a relief take in by direction what was shot evenly and is listed for them.
    fn recall(&self, cmd: &Commands, bound: &Bound, on: &OnDevice<'_>) {
        match (self, bound, on.factors, on.relief) {
            (
                Self::Receivers {
                    gather: GatherBy::Relief(gather),
                    ..
                },
                Bound::Receivers {
                    gather: GatherSets::Relief(sets),
                    ..
                },
                Some(factors),
                Some(relief),
            ) => gather.record_recalled(cmd, sets, (relief, on.scene.source_count), factors),
            _ => unreachable!("asked for where light is sent evenly first"),
        }
    }
}

/// What only scenes with relief compile: what their sources have to send, and by which direction they send it.
pub(super) struct ReliefSources {
    measure: MeasureRelief,
    send: SendRelief,
    recall: Recall,
}

/// What they are bound to for one batch.
pub(super) struct ReliefSets {
    measure: DescriptorSet,
    send: DescriptorSet,
    recall: DescriptorSet,
}

impl ReliefSources {
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            measure: MeasureRelief::new(device)?,
            send: SendRelief::new(device)?,
            recall: Recall::new(device)?,
        })
    }

    pub fn bind(
        &self,
        batch: &Batch,
        on: &OnDevice<'_>,
        relief: &ReliefBuffers,
    ) -> Result<ReliefSets> {
        Ok(ReliefSets {
            measure: self.measure.bind(on.scene, on.state, relief)?,
            send: self.send.bind(on.scene, batch, relief)?,
            recall: self.recall.bind(on.scene, on.state, relief)?,
        })
    }

    /// Unshot light, over what [`crate::passes::measure`] took it for.
    pub fn measure(&self, cmd: &Commands, sets: &ReliefSets, relief: &ReliefBuffers) {
        self.measure.record(cmd, &sets.measure, relief);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }

    pub fn send(&self, cmd: &Commands, sets: &ReliefSets, relief: &ReliefBuffers, batch: &Batch) {
        self.send.record(cmd, &sets.send, relief, batch);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }

    /// Elements with a relief take in by direction what was shot evenly, and sources with a relief send by direction from now on.
    pub fn recall(
        &self,
        cmd: &Commands,
        sets: &ReliefSets,
        (relief, on): (&ReliefBuffers, &OnDevice<'_>),
        (estimate, bound): (&Estimate, &Bound),
    ) {
        self.recall.record(cmd, &sets.recall, on.scene, relief);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        estimate.recall(cmd, bound, on);
    }
}
