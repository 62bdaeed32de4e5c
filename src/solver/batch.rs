//! The commands of a batch, recorded twice so that one is recorded work while the other's results are read.

use std::sync::Arc;

use super::{Estimator, Settings};
use crate::constants::FACES;
use crate::error::Result;
use crate::hemicube::pixel_count;
use crate::passes::bin_pixels::{self, BinPixels};
use crate::passes::bin_receivers::{BinReceivers, BinRelief, ReliefSets};
use crate::passes::buffers::{Batch, SceneBuffers, State, download};
use crate::passes::cull::Cull;
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::measure::Measure;
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::pixels_relief::{self, PixelsRelief};
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::select::{Parameters, Select};
use crate::passes::send_relief::SendRelief;
use crate::passes::types::{Draw, Progress, Slot};
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Stage, Timestamps};

/// Seconds of each stage of a batch, by GPU timestamps.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stages {
    /// Measuring unshot power and choosing sources.
    pub select: f64,
    pub cull: f64,
    pub item_buffer: f64,
    pub bin: f64,
}

/// What a batch did.
#[derive(Debug, Clone)]
pub struct BatchResult {
    pub progress: Progress,
    pub stages: Stages,
    /// `[slot][face]`: meshlets kept, triangles tested.
    pub counts: Vec<[u32; 2]>,
    /// `[slot][face]`.
    pub draws: Vec<Draw>,
}

/// What the solver and the benchmarks run batch after batch.
pub struct BatchLoop {
    // Commands first: dropping them waits until the device is done with the rest.
    commands: [Commands; 2],
    measure_only: Commands,
    readback: [Buffer; 2],
    timestamps: [Timestamps; 2],
    batch: Batch,
    _sets: Sets,
    _passes: Passes,
}

/// What lies on the device for as long as the solver.
pub(super) struct OnDevice<'a> {
    pub scene: &'a SceneBuffers,
    pub state: &'a State,
    pub relief: Option<&'a ReliefBuffers>,
}

struct Passes {
    measure: Measure,
    select: Select,
    cull: Cull,
    item_buffer: ItemBuffer,
    bin: Bin,
}

#[allow(clippy::large_enum_variant)] // one of each lives as long as the solver
enum Bin {
    Receivers(BinReceivers),
    Relief(ReliefPasses),
    Pixels(BinPixels),
}

/// What only scenes with relief compile.
struct ReliefPasses {
    measure: MeasureRelief,
    send: SendRelief,
    bin: ReliefBin,
}

#[allow(clippy::large_enum_variant)] // as `Bin`
enum ReliefBin {
    Receivers(BinRelief),
    Pixels(PixelsRelief),
}

struct Sets {
    measure: DescriptorSet,
    select: DescriptorSet,
    cull: DescriptorSet,
    item_buffer: DescriptorSet,
    bin: BinSets,
}

#[allow(clippy::large_enum_variant)] // as `Bin`
enum BinSets {
    Receivers(DescriptorSet),
    Relief {
        measure: DescriptorSet,
        send: DescriptorSet,
        bin: ReliefBinSets,
    },
    Pixels(bin_pixels::Buffers),
}

enum ReliefBinSets {
    Receivers(ReliefSets),
    Pixels(pixels_relief::Buffers),
}

const STAMPS: u32 = 5;

impl BatchLoop {
    pub(super) fn new(
        device: &Arc<Device>,
        settings: &Settings,
        item_buffer: ItemBuffer,
        batch: Batch,
        on: &OnDevice<'_>,
        stop_power: f64,
    ) -> Result<Self> {
        let OnDevice {
            scene,
            state,
            relief,
        } = *on;
        let passes = Passes {
            measure: Measure::new(device)?,
            select: Select::new(device)?,
            cull: Cull::new(device, settings.culling)?,
            item_buffer,
            bin: match (settings.estimator, relief) {
                (estimator, Some(_)) => Bin::Relief(ReliefPasses {
                    measure: MeasureRelief::new(device)?,
                    send: SendRelief::new(device)?,
                    bin: match estimator {
                        Estimator::Receiver => ReliefBin::Receivers(BinRelief::new(device)?),
                        Estimator::Pixel => ReliefBin::Pixels(PixelsRelief::new(device)?),
                    },
                }),
                (Estimator::Receiver, None) => Bin::Receivers(BinReceivers::new(device)?),
                (Estimator::Pixel, None) => Bin::Pixels(BinPixels::new(device)?),
            },
        };
        let sets = Sets {
            measure: passes.measure.bind(scene, state)?,
            select: passes.select.bind(scene, state, &batch)?,
            cull: passes.cull.bind(scene, &batch)?,
            item_buffer: passes.item_buffer.bind(&batch)?,
            bin: match (&passes.bin, relief) {
                (Bin::Receivers(bin), _) => BinSets::Receivers(bin.bind(scene, state, &batch)?),
                (Bin::Relief(passes), Some(relief)) => BinSets::Relief {
                    measure: passes.measure.bind(scene, state, relief)?,
                    send: passes.send.bind(scene, &batch, relief)?,
                    bin: match &passes.bin {
                        ReliefBin::Receivers(bin) => {
                            ReliefBinSets::Receivers(bin.bind(scene, state, &batch, relief)?)
                        }
                        ReliefBin::Pixels(bin) => {
                            ReliefBinSets::Pixels(bin.bind(device, scene, state, &batch, relief)?)
                        }
                    },
                },
                (Bin::Relief(_), None) => unreachable!("made for a scene with relief"),
                (Bin::Pixels(bin), _) => BinSets::Pixels(bin.bind(device, scene, state, &batch)?),
            },
        };
        let select = Parameters {
            source_count: scene.source_count,
            slot_count: batch.slot_count,
            shot_limit: settings.shots.unwrap_or(u32::MAX),
            stop_power: stop_power as f32,
        };
        let layout = ReadbackLayout::new(&batch);
        let readback = |name| Buffer::new(device, name, layout.bytes, BufferUse::Readback);
        let readback = [readback("batch readback a")?, readback("batch readback b")?];
        let timestamps = [
            Timestamps::new(device, "batch timestamps a", STAMPS)?,
            Timestamps::new(device, "batch timestamps b", STAMPS)?,
        ];
        let record = |name, i: usize| {
            Commands::record(device, name, |cmd| {
                let stamps = &timestamps[i];
                cmd.reset_timestamps(stamps);
                cmd.barrier(
                    &[Stage::Compute, Stage::Draw, Stage::Transfer],
                    &[Stage::Compute],
                );
                cmd.timestamp(stamps, 0);
                passes
                    .measure
                    .record(cmd, &sets.measure, scene.source_count);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                measure_relief(cmd, &passes, &sets, relief);
                passes.select.record(cmd, &sets.select, &select);
                cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                if let (Bin::Relief(passes), BinSets::Relief { send, .. }, Some(relief)) =
                    (&passes.bin, &sets.bin, relief)
                {
                    passes.send.record(cmd, send, relief, &batch);
                    cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
                }
                cmd.timestamp(stamps, 1);
                passes.cull.record(cmd, &sets.cull, scene, &batch);
                cmd.barrier(&[Stage::Compute], &[Stage::Draw]);
                cmd.timestamp(stamps, 2);
                passes
                    .item_buffer
                    .record(cmd, &sets.item_buffer, scene, &batch);
                cmd.timestamp(stamps, 3);
                match (&passes.bin, &sets.bin) {
                    (Bin::Receivers(bin), BinSets::Receivers(set)) => {
                        bin.record(cmd, set, scene, &batch);
                    }
                    (Bin::Relief(passes), BinSets::Relief { bin, .. }) => {
                        if let Some(relief) = relief {
                            match (&passes.bin, bin) {
                                (ReliefBin::Receivers(pass), ReliefBinSets::Receivers(sets)) => {
                                    pass.record(cmd, sets, relief, &batch);
                                }
                                (ReliefBin::Pixels(pass), ReliefBinSets::Pixels(buffers)) => {
                                    pass.record(cmd, buffers, relief, &batch);
                                }
                                _ => unreachable!("passes and sets are made of one estimator"),
                            }
                        }
                    }
                    (Bin::Pixels(bin), BinSets::Pixels(buffers)) => {
                        bin.record(cmd, buffers, scene, &batch);
                    }
                    _ => unreachable!("passes and sets are made of one estimator"),
                }
                cmd.timestamp(stamps, 4);
                layout.record(cmd, state, &batch, &readback[i]);
                Ok(())
            })
        };
        let commands = [record("batch a", 0)?, record("batch b", 1)?];
        let measure_only = Commands::record(device, "remeasure", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            passes
                .measure
                .record(cmd, &sets.measure, scene.source_count);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            measure_relief(cmd, &passes, &sets, relief);
            let none = Parameters {
                shot_limit: 0,
                ..select
            };
            passes.select.record(cmd, &sets.select, &none);
            layout.record(cmd, state, &batch, &readback[0]);
            Ok(())
        })?;
        Ok(Self {
            commands,
            measure_only,
            readback,
            timestamps,
            batch,
            _sets: sets,
            _passes: passes,
        })
    }

    /// Runs batches, one always ahead of what is read, until `look` says no; then waits for the one ahead, whose results
    /// are looked at too.
    pub fn run(&mut self, mut look: impl FnMut(&BatchResult) -> bool) -> Result<()> {
        let mut now = 0;
        self.commands[now].submit()?;
        loop {
            self.commands[1 - now].submit()?;
            let go_on = look(&self.finish(now)?);
            now = 1 - now;
            if !go_on {
                look(&self.finish(now)?);
                return Ok(());
            }
        }
    }

    fn finish(&mut self, i: usize) -> Result<BatchResult> {
        self.commands[i].wait()?;
        let layout = ReadbackLayout::new(&self.batch);
        let stamps = self.timestamps[i].intervals()?;
        let [select, cull, item_buffer, bin] = stamps[..] else {
            panic!("a batch has {STAMPS} timestamps");
        };
        let readback = &self.readback[i];
        Ok(BatchResult {
            progress: readback.read::<Progress>(0, 1)[0],
            stages: Stages {
                select,
                cull,
                item_buffer,
                bin,
            },
            counts: readback.read(layout.counts, layout.regions),
            draws: readback.read(layout.draws, layout.regions),
        })
    }

    /// What is unshot now, without shooting.
    pub fn remeasure(&mut self) -> Result<Progress> {
        self.measure_only.submit()?;
        self.measure_only.wait()?;
        Ok(self.readback[0].read::<Progress>(0, 1)[0])
    }

    pub(super) fn item_buffers(&self, device: &Arc<Device>) -> Result<(Vec<u32>, Vec<u32>)> {
        let texels = pixel_count(self.batch.face_size) * self.batch.slot_count as usize;
        let readback = Buffer::new(
            device,
            "item readback",
            4 * texels as u64,
            BufferUse::Readback,
        )?;
        Commands::run(device, "item readback", |cmd| {
            cmd.copy_shader_image_to_buffer(&self.batch.items, &readback);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok((
            readback.read(0, texels),
            self.slots(device)?.iter().map(|s| s.source).collect(),
        ))
    }

    /// What the last batch chose.
    pub(super) fn slots(&self, device: &Arc<Device>) -> Result<Vec<Slot>> {
        download(device, &self.batch.slots, self.batch.slot_count as usize)
    }
}

/// The unshot light of the sources with a relief, over what [`Measure`] took them for.
fn measure_relief(cmd: &Commands, passes: &Passes, sets: &Sets, relief: Option<&ReliefBuffers>) {
    if let (Bin::Relief(passes), BinSets::Relief { measure, .. }, Some(relief)) =
        (&passes.bin, &sets.bin, relief)
    {
        passes.measure.record(cmd, measure, relief);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
    }
}

/// Where a batch's results lie in its readback buffer: progress, then counts, then draws.
struct ReadbackLayout {
    regions: usize,
    counts: u64,
    draws: u64,
    bytes: u64,
}

impl ReadbackLayout {
    fn new(batch: &Batch) -> Self {
        let regions = (batch.slot_count * FACES) as usize;
        let counts = size_of::<Progress>() as u64;
        let draws = counts + (regions * size_of::<[u32; 2]>()) as u64;
        Self {
            regions,
            counts,
            draws,
            bytes: draws + (regions * size_of::<Draw>()) as u64,
        }
    }

    fn record(&self, cmd: &Commands, state: &State, batch: &Batch, to: &Buffer) {
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        cmd.copy(&state.progress, 0, to, 0, self.counts);
        cmd.copy(&batch.counts, 0, to, self.counts, self.draws - self.counts);
        cmd.copy(&batch.draws, 0, to, self.draws, self.bytes - self.draws);
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
    }
}
