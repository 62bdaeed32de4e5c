//! The `pixel` estimator in a scene with relief: each pixel brings light by its own direction, so
//! that there is no row to keep. Sources are drawn for every shot, those with the most unshot power
//! first (Southwell), and what they reflect is measured before each batch.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::drawing::{Drawing, read_items};
use super::progress::{Bound, Watch};
use super::rows::{Looks, Stages, emitter_looks};
use super::{Problem, Report, StopReason};
use crate::constants::{FACES, KIND_POINT};
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::passes::batch::Batch;
use crate::passes::buffers::{State, download};
use crate::passes::measure::Measure;
use crate::passes::measure_relief::MeasureRelief;
use crate::passes::pixels_relief::PixelsRelief;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::send_relief::SendRelief;
use crate::passes::types::Slot;
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

pub(super) struct Shots {
    device: Arc<Device>,
    measuring: Commands,
    all: ShotPass,
    emitters: Option<ShotPass>,
    /// `[source]`
    sources: Vec<Shot>,
    bound: Bound,
}

/// What a source has sent.
#[derive(Debug, Clone, Copy)]
struct Shot {
    strong: bool,
    emitted: DVec3,
    /// That radiosity is multiplied by for power.
    area: f64,
    emission_shot: bool,
    reflected: DVec3,
}

/// Sources of a batch with large faces, at most.
const FINE_SLOTS: u32 = 4;

const STAMPS: u32 = 4;

impl Shots {
    /// In a scene with `relief`.
    pub fn new(
        device: &Arc<Device>,
        on: &Problem,
        relief: &ReliefBuffers,
        bound: Bound,
    ) -> Result<Self> {
        let measure = Measure::new(device, &on.scene, &on.state)?;
        let measure_relief = MeasureRelief::new(device, &on.scene, &on.state, relief)?;
        let measuring = Commands::record(device, "measure", |cmd| {
            cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
            measure.record(cmd);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            measure_relief.record(cmd);
            Ok(())
        })?;
        let shot = |(source, strong): (&Source, bool)| Shot {
            strong,
            emitted: source.emitted.as_dvec3(),
            area: match source.kind {
                KIND_POINT => std::f64::consts::TAU,
                _ => source.area,
            },
            emission_shot: false,
            reflected: DVec3::ZERO,
        };
        let list = on.sources.list.iter().zip(on.strong());
        let sources: Vec<Shot> = list.map(shot).collect();
        let any_strong = sources.iter().any(|s| s.strong);
        let looks = match any_strong {
            true => emitter_looks(device, &on.settings),
            false => None,
        };
        let emitters = match looks {
            Some(Looks::Hemicubes(face)) => {
                let slots = relief.slots.min(FINE_SLOTS);
                Some(ShotPass::new(device, on, relief, slots, face)?)
            }
            _ => None,
        };
        let face = on.settings.hemicube;
        Ok(Self {
            device: Arc::clone(device),
            measuring,
            all: ShotPass::new(device, on, relief, relief.slots, face)?,
            emitters,
            sources,
            bound,
        })
    }

    /// Shoots until little is left or the watch says stop.
    pub fn run(&mut self, on: &Problem, report: &mut Report, watch: &mut Watch<'_>) -> Result<()> {
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        loop {
            let reflected = self.measure(on)?;
            let unshot = self.unshot(&reflected);
            if !watch.look(report.shots, unshot, self.bound.importance() * unshot) {
                return Ok(());
            }
            let (chosen, strong) = self.choose(&reflected);
            if chosen.is_empty() {
                watch.stop = Some(StopReason::Residual);
                return Ok(());
            }
            if report.shots >= limit {
                watch.stop = Some(StopReason::Shots);
                return Ok(());
            }
            let pass = match (&mut self.emitters, strong) {
                (Some(emitters), true) => emitters,
                _ => &mut self.all,
            };
            let most = pass.slots().min((limit - report.shots) as usize);
            let slots: Vec<Slot> = (chosen.into_iter().take(most))
                .map(|s| self.sources[s].shoot(s as u32, reflected[s]))
                .collect();
            let (stages, counts) = pass.run(&slots)?;
            report.seconds.stages += stages;
            for (counts, _) in counts.chunks(FACES as usize).zip(&slots) {
                report.add_drawn(counts, strong);
            }
        }
    }

    /// Radiosity that each source reflects by now.
    fn measure(&mut self, on: &Problem) -> Result<Vec<DVec3>> {
        self.measuring.submit()?;
        self.measuring.wait()?;
        let count = self.sources.len();
        let reflected: Vec<Vec3> = download(&self.device, &on.state.reflected, count)?;
        Ok(reflected.into_iter().map(Vec3::as_dvec3).collect())
    }

    /// Sources with unshot power, the strongest first: of the strong emitters while one has not
    /// sent its emission, which the flag says.
    fn choose(&self, reflected: &[DVec3]) -> (Vec<usize>, bool) {
        let mut powers: Vec<(usize, f64)> = Vec::new();
        let strong = self.sources.iter().any(|s| s.strong && !s.emission_shot);
        let (mut emitted_left, mut power_left) = (0.0, 0.0);
        for (s, (shot, &reflected)) in self.sources.iter().zip(reflected).enumerate() {
            let (power, emitted) = shot.unshot(reflected);
            emitted_left += emitted;
            power_left += power;
            if power > 0.0 && (!strong || shot.strong && !shot.emission_shot) {
                powers.push((s, power));
            }
        }
        if emitted_left == 0.0 && power_left <= self.bound.stop_power() {
            return (Vec::new(), false);
        }
        powers.sort_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        (powers.into_iter().map(|(s, _)| s).collect(), strong)
    }

    fn unshot(&self, reflected: &[DVec3]) -> f64 {
        let powers = self.sources.iter().zip(reflected);
        powers
            .map(|(shot, &reflected)| shot.unshot(reflected).0)
            .sum()
    }

    /// Unshot power after the last run.
    pub fn left(&mut self, on: &Problem) -> Result<f64> {
        let reflected = self.measure(on)?;
        Ok(self.unshot(&reflected))
    }

    /// Unshot power by colour, after the last run.
    pub fn unshot_by_colour(&self, state: &State) -> Result<DVec3> {
        let count = self.sources.len();
        let reflected: Vec<Vec3> = download(&self.device, &state.reflected, count)?;
        let left = |(shot, reflected): (&Shot, Vec3)| {
            let emitted = match shot.emission_shot {
                true => DVec3::ZERO,
                false => shot.emitted,
            };
            (emitted + reflected.as_dvec3() - shot.reflected) * shot.area
        };
        Ok(self.sources.iter().zip(reflected).map(left).sum())
    }
}

impl Shots {
    /// The last slots that were shot by hemicubes of the common size, and their item buffers.
    pub fn slots(&self, count: usize) -> Result<Vec<Slot>> {
        download(&self.device, &self.all.batch.slots, count)
    }

    pub fn items(&self) -> Result<Vec<u32>> {
        read_items(&self.device, &self.all.batch)
    }
}

impl Shot {
    /// Unshot power, and of it what is emitted.
    fn unshot(&self, reflected: DVec3) -> (f64, f64) {
        let emitted = match self.emission_shot {
            true => 0.0,
            false => self.emitted.element_sum() * self.area,
        };
        let reflected = (reflected - self.reflected).abs().element_sum() * self.area;
        (emitted + reflected, emitted)
    }

    /// All that the source has left.
    fn shoot(&mut self, source: u32, reflected: DVec3) -> Slot {
        let sent = (reflected - self.reflected).as_vec3();
        self.reflected += sent.as_dvec3();
        let emitted = match std::mem::replace(&mut self.emission_shot, true) {
            true => Vec3::ZERO,
            false => self.emitted.as_vec3(),
        };
        Slot {
            emitted,
            source,
            reflected: sent,
            scale: 1.0,
        }
    }
}

/// Draws a batch and adds what its pixels bring.
struct ShotPass {
    commands: Commands,
    wanted: Buffer,
    readback: Buffer,
    timestamps: Timestamps,
    batch: Batch,
}

impl ShotPass {
    fn new(
        device: &Arc<Device>,
        on: &Problem,
        relief: &ReliefBuffers,
        slots: u32,
        face: u32,
    ) -> Result<Self> {
        let size = Drawing::fitting(device, &on.scene, &on.settings, slots, face);
        let (drawing, batch) = Drawing::new(device, &on.scene, on.settings.culling, &size)?;
        let send = SendRelief::new(device, &on.scene, &batch.slots, relief)?;
        let pixels = PixelsRelief::new(device, &on.scene, &on.state, &batch, relief)?;
        let counts = &batch.hemicubes().counts;
        let bytes = u64::from(batch.slot_count) * size_of::<Slot>() as u64;
        let wanted = Buffer::new(device, "shots", bytes, BufferUse::Upload)?;
        let readback = Buffer::new(device, "counts", counts.bytes(), BufferUse::Readback)?;
        let timestamps = Timestamps::new(device, "shot timestamps", STAMPS)?;
        let commands = Commands::record(device, "shots", |cmd| {
            let used = [Stage::Compute, Stage::Draw, Stage::Transfer];
            cmd.reset_timestamps(&timestamps);
            cmd.barrier(&used, &[Stage::Transfer]);
            cmd.copy(&wanted, 0, &batch.slots, 0, bytes);
            cmd.barrier(&[Stage::Transfer], &[Stage::Compute]);
            cmd.timestamp(&timestamps, 0);
            send.record(cmd, 0..batch.slot_count);
            cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
            drawing.record(cmd, &on.scene, &batch, || cmd.timestamp(&timestamps, 1));
            cmd.timestamp(&timestamps, 2);
            pixels.record(cmd, relief, &batch);
            cmd.timestamp(&timestamps, 3);
            cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
            cmd.copy(counts, 0, &readback, 0, counts.bytes());
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
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

    fn slots(&self) -> usize {
        self.batch.slot_count as usize
    }

    /// How long it took, and the counts of each face.
    fn run(&mut self, slots: &[Slot]) -> Result<(Stages, Vec<[u32; 3]>)> {
        let mut all = vec![Slot::EMPTY; self.slots()];
        all[..slots.len()].copy_from_slice(slots);
        self.wanted.write(0, &all);
        self.commands.submit()?;
        self.commands.wait()?;
        let [cull, item_buffer, bin] = self.timestamps.intervals()?[..] else {
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
