//! The paper's method: progressive radiosity. Every element is a patch; those with the most unshot
//! power draw their hemicubes, and each pixel adds what it brings.

mod light;

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::drawing::Drawing;
use super::progress::{Bound, Watch};
use super::rows::Stages;
use super::{Problem, Report, StopReason};
use crate::constants::FACES;
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::passes::batch::Batch;
use crate::passes::bin_shots::BinShots;
use crate::passes::buffers::SceneBuffers;
use crate::passes::shoot::Shoot;
use crate::passes::shot_light::ShotLight;
use crate::passes::types::Slot;
use crate::passes::unshot::Unshot;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

pub(super) struct Shots {
    device: Arc<Device>,
    measuring: Commands,
    /// [`Unshot::powers`].
    readback: Buffer,
    /// Reflected and not sent, as measured last, RGB, internal units, `[source]`.
    reflected: Vec<Vec3>,
    /// Emitted power that waits to be sent, `[source]`.
    emitted: Vec<DVec3>,
    pub scene: SceneBuffers,
    light: ShotLight,
    batch: ShotBatch,
    bound: Bound,
    /// Power that has been sent, internal units.
    sent: f64,
}

/// Over the power of the strongest patch of a batch, that of the weakest, at least.
const ALIKE: f64 = 0.5;

/// Over what was emitted, what is sent before the solution is given up: far below where a sum of
/// [`ShotLight`] would overflow.
const MOST_SENT: f64 = 1000.0;

const STAMPS: u32 = 4;

impl Shots {
    pub fn new(
        device: &Arc<Device>,
        on: &Problem,
        scene: SceneBuffers,
        bound: Bound,
    ) -> Result<Self> {
        let power: f64 = on.sources.list.iter().map(Source::emitted_power).sum();
        let light = ShotLight::new(device, &on.elements, power, on.slots)?;
        let unshot = Unshot::new(device, &scene, &light)?;
        let bytes = unshot.powers.bytes();
        let readback = Buffer::new(device, "unshot readback", bytes, BufferUse::Readback)?;
        let measuring = Commands::record(device, "unshot", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            unshot.record(cmd);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            cmd.copy(&unshot.powers, 0, &readback, 0, bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok(Self {
            device: Arc::clone(device),
            measuring,
            readback,
            reflected: vec![Vec3::ZERO; on.sources.list.len()],
            emitted: on.sources.list.iter().map(emitted).collect(),
            batch: ShotBatch::new(device, on, &scene, &light)?,
            scene,
            light,
            bound,
            sent: 0.0,
        })
    }

    /// Shoots until little is left or the watch says stop.
    pub fn run(&mut self, on: &Problem, report: &mut Report, watch: &mut Watch<'_>) -> Result<()> {
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        loop {
            self.measure()?;
            let left = self.left();
            if !watch.look(report.shots, left, self.bound.importance() * left) {
                return Ok(());
            }
            if left <= self.bound.stop_power() {
                watch.stop = Some(StopReason::Residual);
                return Ok(());
            }
            if report.shots >= limit {
                watch.stop = Some(StopReason::Shots);
                return Ok(());
            }
            if self.bound.share(self.sent) > MOST_SENT {
                tracing::warn!(
                    "the scene absorbs no light: what is emitted goes to and fro for ever"
                );
                watch.stop = Some(StopReason::Unsolved);
                return Ok(());
            }
            let most = (self.batch.slot_count()).min((limit - report.shots) as usize);
            let slots: Vec<Slot> = (self.strongest(most).into_iter())
                .map(|s| {
                    self.sent += self.power(s);
                    let emits = std::mem::take(&mut self.emitted[s]) != DVec3::ZERO;
                    Slot {
                        emitted: match emits {
                            true => on.sources.list[s].emitted,
                            false => Vec3::ZERO,
                        },
                        ..Slot::of(s as u32)
                    }
                })
                .collect();
            let (stages, counts) = self.batch.run(&slots)?;
            report.seconds.stages += stages;
            for counts in counts.chunks(FACES as usize).take(slots.len()) {
                report.add_drawn(counts, false);
            }
        }
    }

    /// The sources with the most unshot power, alike, at most so many, the strongest first.
    fn strongest(&self, most: usize) -> Vec<usize> {
        let mut powers: Vec<(usize, f64)> = (0..self.reflected.len())
            .map(|s| (s, self.power(s)))
            .filter(|&(_, power)| power > 0.0)
            .collect();
        let first = |a: &(usize, f64), b: &(usize, f64)| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0));
        if powers.len() > most {
            powers.select_nth_unstable_by(most - 1, first);
            powers.truncate(most);
        }
        powers.sort_by(first);
        let least = powers.first().map_or(0.0, |p| ALIKE * p.1);
        let alike = powers.into_iter().take_while(|p| p.1 >= least);
        alike.map(|(s, _)| s).collect()
    }

    fn measure(&mut self) -> Result<()> {
        self.measuring.submit()?;
        self.measuring.wait()?;
        self.reflected = self.readback.read(0, self.reflected.len());
        Ok(())
    }

    /// Unshot power of a source, summed over the colours.
    fn power(&self, s: usize) -> f64 {
        (self.reflected[s].as_dvec3() + self.emitted[s]).element_sum()
    }

    /// Unshot power when last measured, summed over the colours.
    pub fn left(&self) -> f64 {
        self.unshot_by_colour().element_sum()
    }

    pub fn unshot_by_colour(&self) -> DVec3 {
        let reflected = self.reflected.iter().map(|power| power.as_dvec3());
        reflected.sum::<DVec3>() + self.emitted.iter().sum::<DVec3>()
    }
}

/// Power, RGB, internal units.
fn emitted(source: &Source) -> DVec3 {
    let sum = f64::from(source.emitted.element_sum());
    match sum > 0.0 {
        true => source.emitted.as_dvec3() * (source.emitted_power() / sum),
        false => DVec3::ZERO,
    }
}

/// Draws a batch and adds what its pixels bring.
struct ShotBatch {
    commands: Commands,
    wanted: Buffer,
    readback: Buffer,
    timestamps: Timestamps,
    batch: Batch,
}

impl ShotBatch {
    fn new(
        device: &Arc<Device>,
        on: &Problem,
        scene: &SceneBuffers,
        light: &ShotLight,
    ) -> Result<Self> {
        let face = on.settings.hemicube;
        let size = Drawing::fitting(device, scene, &on.settings, on.slots, face);
        let (drawing, batch) = Drawing::new(device, scene, on.settings.culling, &size)?;
        let shoot = Shoot::new(device, scene, light, &batch.slots, batch.slot_count)?;
        let bin = BinShots::new(device, scene, light, &batch)?;
        let counts = &drawing.lists.counts;
        let bytes = u64::from(batch.slot_count) * size_of::<Slot>() as u64;
        let wanted = Buffer::new(device, "wanted shots", bytes, BufferUse::Upload)?;
        let readback = Buffer::new(device, "counts", counts.bytes(), BufferUse::Readback)?;
        let timestamps = Timestamps::new(device, "shot timestamps", STAMPS)?;
        let commands = Commands::record(device, "shots", |cmd| {
            let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.reset_timestamps(&timestamps);
            cmd.barrier(&used, &[Stage::Transfer]);
            cmd.copy(&wanted, 0, &batch.slots, 0, bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            shoot.record(cmd);
            cmd.timestamp(&timestamps, 0);
            drawing.record(cmd, || cmd.timestamp(&timestamps, 1));
            cmd.timestamp(&timestamps, 2);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            bin.record(cmd);
            cmd.timestamp(&timestamps, 3);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            cmd.copy(counts, 0, &readback, 0, counts.bytes());
            cmd.read_back_timestamps(&timestamps);
            Ok(())
        })?;
        Ok(Self {
            commands,
            wanted,
            readback,
            timestamps,
            batch,
        })
    }

    fn slot_count(&self) -> usize {
        self.batch.slot_count as usize
    }

    /// How long it took, and the counts of each face.
    fn run(&mut self, slots: &[Slot]) -> Result<(Stages, Vec<[u32; 3]>)> {
        let mut all = vec![Slot::EMPTY; self.slot_count()];
        all[..slots.len()].copy_from_slice(slots);
        self.wanted.write(0, &all);
        self.commands.submit()?;
        self.commands.wait()?;
        let [cull, item_buffer, bin] = self.timestamps.intervals()[..] else {
            unreachable!("a batch of shots has {STAMPS} timestamps");
        };
        let stages = Stages {
            cull,
            item_buffer,
            bin,
            ..Stages::default()
        };
        let counts = self.readback.read(0, slots.len() * FACES as usize);
        Ok((stages, counts))
    }
}
