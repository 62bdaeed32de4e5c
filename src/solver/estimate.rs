//! The passes between the item buffer and irradiance, by estimator and by whether the scene has relief, bound to the buffers of
//! one problem.

use std::sync::Arc;

use super::Estimator;
use super::batch::OnDevice;
use crate::error::Result;
use crate::passes::bin_pixels::{self, BinPixels};
use crate::passes::buffers::Batch;
use crate::passes::factor_buffers::FactorBuffers;
use crate::passes::form_factors::{self, FormFactors};
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

#[allow(clippy::large_enum_variant)] // one of them lives as long as the solver
pub(super) enum Estimate {
    Receivers {
        form_factors: (FormFactors, form_factors::Sets),
        /// In enclosed scenes.
        normalise: Option<(Normalise, DescriptorSet)>,
        /// None where nothing is to be kept.
        keep: Option<(Keep, keep::Sets)>,
        gather: GatherBy,
    },
    Pixels(BinPixels, bin_pixels::Buffers),
    PixelsRelief(PixelsRelief, pixels_relief::Buffers),
}

#[allow(clippy::large_enum_variant)] // as above
pub(super) enum GatherBy {
    Plain(Gather, gather::Sets),
    Relief(GatherRelief, gather::ReliefSets),
}

impl Estimate {
    pub fn new(
        device: &Arc<Device>,
        estimator: Estimator,
        batch: &Batch,
        on: &OnDevice<'_>,
    ) -> Result<Self> {
        let (scene, state) = (on.scene, on.state);
        let Some(factors) = on.factors.filter(|_| estimator == Estimator::Receiver) else {
            return Ok(match on.relief {
                Some(relief) => {
                    let pass = PixelsRelief::new(device)?;
                    let buffers = pass.bind(device, scene, state, batch, relief)?;
                    Self::PixelsRelief(pass, buffers)
                }
                None => {
                    let pass = BinPixels::new(device)?;
                    let buffers = pass.bind(device, scene, state, batch)?;
                    Self::Pixels(pass, buffers)
                }
            });
        };
        let form_factors = FormFactors::new(device, on.relief.is_some())?;
        let sets = form_factors.bind(device, (scene, state), batch, factors, on.relief)?;
        let normalise = match scene.enclosed {
            true => {
                let normalise = Normalise::new(device)?;
                let set = normalise.bind(scene, batch, factors)?;
                Some((normalise, set))
            }
            false => None,
        };
        let keep = match factors.keeps() {
            true => {
                let keep = Keep::new(device)?;
                let sets = keep.bind(state, batch, factors)?;
                Some((keep, sets))
            }
            false => None,
        };
        let gather = match on.relief {
            None => {
                let gather = Gather::new(device)?;
                let sets = gather.bind(device, scene, state, batch, factors)?;
                GatherBy::Plain(gather, sets)
            }
            Some(relief) => {
                let gather = GatherRelief::new(device)?;
                let sets = gather.bind(device, (scene, state), batch, factors, relief)?;
                GatherBy::Relief(gather, sets)
            }
        };
        Ok(Self::Receivers {
            form_factors: (form_factors, sets),
            normalise,
            keep,
            gather,
        })
    }

    /// `found` is recorded between form factors and irradiance.
    pub fn record(
        &self,
        cmd: &Commands,
        batch: &Batch,
        on: &OnDevice<'_>,
        sending: Sending,
        found: impl FnOnce(),
    ) {
        match (self, on.factors, on.relief) {
            (
                Self::Receivers {
                    form_factors: (form_factors, sets),
                    normalise,
                    keep,
                    gather,
                },
                Some(factors),
                relief,
            ) => {
                cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
                form_factors.record(cmd, sets, batch, factors);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                if let Some((normalise, set)) = normalise {
                    normalise.record(cmd, set, batch, factors);
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                }
                found();
                if let Some((keep, sets)) = keep {
                    keep.record(cmd, sets, batch, factors);
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                }
                gather.record(cmd, batch, on, (factors, relief), sending);
            }
            (Self::Pixels(pass, buffers), ..) => {
                pass.record(cmd, buffers, on.scene, batch);
                found();
            }
            (Self::PixelsRelief(pass, buffers), _, Some(relief)) => {
                pass.record(cmd, buffers, relief, batch);
                found();
            }
            _ => unreachable!("made for what is on the device"),
        }
    }
}

impl GatherBy {
    fn record(
        &self,
        cmd: &Commands,
        batch: &Batch,
        on: &OnDevice<'_>,
        (factors, relief): (&FactorBuffers, Option<&ReliefBuffers>),
        sending: Sending,
    ) {
        match (self, relief) {
            (Self::Plain(gather, sets), _) => gather.record(cmd, sets, on.scene, batch),
            (Self::Relief(gather, sets), Some(relief)) => match sending {
                Sending::Evenly => gather.record_evenly(cmd, sets, relief, batch, factors),
                Sending::ByDirection => gather.record(cmd, sets, relief, batch, factors),
            },
            (Self::Relief(..), None) => unreachable!("made for a scene with relief"),
        }
    }
}

impl Estimate {
    /// Whether all is sent evenly first: not where sources with a relief emit, nor where what follows would have to be drawn anew.
    pub fn sends_evenly_first(&self, on: &OnDevice<'_>) -> bool {
        matches!(self, Self::Receivers { keep: Some(_), .. })
            && on
                .factors
                .is_some_and(|f| f.has_room_for(on.scene.source_count))
            && on.relief.is_some_and(|relief| !relief.glows)
    }

    /// Elements with a relief take in by direction what was shot evenly, and sources with a relief send by direction from now on.
    pub fn recall(&self, cmd: &Commands, sources: &ReliefSources, on: &OnDevice<'_>) {
        let (Self::Receivers { gather, .. }, Some(factors), Some(relief)) =
            (self, on.factors, on.relief)
        else {
            unreachable!("asked for where light is sent evenly first");
        };
        let GatherBy::Relief(gather, sets) = gather else {
            unreachable!("made for a scene with relief");
        };
        let (recall, set) = &sources.recall;
        recall.record(cmd, set, on.scene, relief);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        let listed = (relief, on.scene.source_count);
        gather.record_recalled(cmd, sets, listed, factors);
    }
}

/// What only scenes with relief compile: what their sources have to send, and by which direction they send it.
pub(super) struct ReliefSources {
    measure: (MeasureRelief, DescriptorSet),
    send: (SendRelief, DescriptorSet),
    recall: (Recall, DescriptorSet),
}

impl ReliefSources {
    pub fn new(
        device: &Arc<Device>,
        batch: &Batch,
        on: &OnDevice<'_>,
        relief: &ReliefBuffers,
    ) -> Result<Self> {
        let measure = MeasureRelief::new(device)?;
        let measured = measure.bind(on.scene, on.state, relief)?;
        let send = SendRelief::new(device)?;
        let sent = send.bind(on.scene, batch, relief)?;
        let recall = Recall::new(device)?;
        let recalled = recall.bind(on.scene, on.state, relief)?;
        Ok(Self {
            measure: (measure, measured),
            send: (send, sent),
            recall: (recall, recalled),
        })
    }

    /// Unshot light, over what [`crate::passes::measure`] took it for.
    pub fn measure(&self, cmd: &Commands, relief: &ReliefBuffers) {
        let (pass, set) = &self.measure;
        pass.record(cmd, set, relief);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }

    pub fn send(&self, cmd: &Commands, relief: &ReliefBuffers, batch: &Batch) {
        let (pass, set) = &self.send;
        pass.record(cmd, set, relief, batch);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}
