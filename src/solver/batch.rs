//! The commands of a batch, recorded twice so that one is recorded work while the other's results are read.

use std::sync::Arc;

use super::Settings;
use super::estimate::{self, Estimate, ReliefSets, ReliefSources, Sending};
use super::readback::{BatchResult, ReadbackLayout, STAMPS, Stages};
use super::several::{Several, Team};
use crate::error::Result;
use crate::hemicube::pixel_count;
use crate::passes::batch::{Batch, Sight};
use crate::passes::buffers::{SceneBuffers, State, download};
use crate::passes::cull::Cull;
use crate::passes::factor_buffers::FactorBuffers;
use crate::passes::item_buffer::ItemBuffer;
use crate::passes::measure::Measure;
use crate::passes::relief_buffers::ReliefBuffers;
use crate::passes::select::{Parameters, Select};
use crate::passes::types::{Progress, Slot};
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Stage, Timestamps};

/// What the solver and the benchmarks run batch after batch.
pub struct BatchLoop {
    // Commands first: dropping them waits until the device is done with the rest.
    commands: [Commands; 2],
    /// Where sources with a relief send evenly first: the batches of that time.
    evenly: Option<Evenly>,
    measure_only: Commands,
    /// Where other devices draw too: it runs the batches instead of these commands.
    several: Option<Several>,
    readback: [Buffer; 2],
    timestamps: [Timestamps; 2],
    batch: Batch,
    _sets: Sets,
    _passes: Arc<Passes>,
}

struct Evenly {
    commands: [Commands; 2],
    measure_only: Commands,
    recall: Commands,
}

/// What lies on the device for as long as the solver.
pub(super) struct OnDevice<'a> {
    pub scene: &'a SceneBuffers,
    pub state: &'a State,
    pub relief: Option<&'a ReliefBuffers>,
    /// For the `receiver` estimator.
    pub factors: Option<&'a FactorBuffers>,
}

/// Pipelines, for any number of batches.
pub(super) struct Passes {
    measure: Measure,
    select: Select,
    cull: Cull,
    pub item_buffer: ItemBuffer,
    estimate: Estimate,
    relief: Option<ReliefSources>,
}

/// What they are bound to for one batch.
pub(super) struct Sets {
    measure: DescriptorSet,
    select: DescriptorSet,
    /// Of a batch that draws: culling and the item buffer.
    drawing: Option<(DescriptorSet, DescriptorSet)>,
    estimate: estimate::Bound,
    relief: Option<ReliefSets>,
}

/// Which sources a loop shoots, and how long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rule {
    pub shots: Option<u32>,
    /// See [`Parameters`].
    pub stop_power: f32,
    pub least_emitted: f32,
}

impl BatchLoop {
    pub(super) fn new(
        device: &Arc<Device>,
        passes: &Arc<Passes>,
        batch: Batch,
        on: &OnDevice<'_>,
        rule: Rule,
        team: Option<Team>,
    ) -> Result<Self> {
        let (scene, state) = (on.scene, on.state);
        let passes = Arc::clone(passes);
        let sets = passes.bind(device, &batch, on)?;
        let parameters = Parameters {
            source_count: scene.source_count,
            fresh_slots: batch.slot_count,
            replay_slots: batch.replay_slots,
            shot_limit: rule.shots.unwrap_or(u32::MAX),
            stop_power: rule.stop_power,
            least_emitted: rule.least_emitted,
        };
        let layout = ReadbackLayout::new(&batch);
        let readback = |name| Buffer::new(device, name, layout.bytes, BufferUse::Readback);
        let readback = [readback("batch readback a")?, readback("batch readback b")?];
        let timestamps = [
            Timestamps::new(device, "batch timestamps a", STAMPS)?,
            Timestamps::new(device, "batch timestamps b", STAMPS)?,
        ];
        let record = |name, i: usize, sending| {
            Commands::record(device, name, |cmd| {
                let stamps = &timestamps[i];
                cmd.reset_timestamps(stamps);
                cmd.barrier(
                    &[Stage::Compute, Stage::Draw, Stage::Transfer],
                    &[Stage::Compute],
                );
                cmd.timestamp(stamps, 0);
                passes.choose(cmd, &sets, on, &batch, (&parameters, sending));
                cmd.timestamp(stamps, 1);
                let listed = || cmd.timestamp(stamps, 2);
                match &sets.drawing {
                    Some((cull, item_buffer)) => {
                        let cull = (&passes.cull, cull);
                        let of = (scene, &batch);
                        (passes.item_buffer).record(cmd, item_buffer, cull, of, listed);
                    }
                    None => listed(),
                }
                cmd.timestamp(stamps, 3);
                let found = || cmd.timestamp(stamps, 4);
                (passes.estimate).record(cmd, &sets.estimate, &batch, on, sending, found);
                cmd.timestamp(stamps, 5);
                layout.record(cmd, state, &batch, &readback[i]);
                Ok(())
            })
        };
        let measure_only = |name, sending| {
            Commands::record(device, name, |cmd| {
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                passes.measure(cmd, &sets, on, sending);
                let none = Parameters {
                    shot_limit: 0,
                    ..parameters
                };
                passes.select.record(cmd, &sets.select, &none);
                layout.record(cmd, state, &batch, &readback[0]);
                Ok(())
            })
        };
        let by_direction = Sending::ByDirection;
        let commands = [
            record("batch a", 0, by_direction)?,
            record("batch b", 1, by_direction)?,
        ];
        let first_evenly = passes.sends_evenly_first(on);
        let directed = passes.directed(&sets, on, by_direction);
        let evenly = match directed.filter(|_| first_evenly) {
            Some((sources, of_relief, relief)) => Some(Evenly {
                commands: [
                    record("even batch a", 0, Sending::Evenly)?,
                    record("even batch b", 1, Sending::Evenly)?,
                ],
                measure_only: measure_only("remeasure evenly", Sending::Evenly)?,
                recall: Commands::record(device, "recall", |cmd| {
                    cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                    let gathers = (&passes.estimate, &sets.estimate);
                    sources.recall(cmd, of_relief, (relief, on), gathers);
                    Ok(())
                })?,
            }),
            None => None,
        };
        let measure_only = measure_only("remeasure", by_direction)?;
        let several = match (team, on.factors) {
            (Some(team), Some(factors)) => {
                let passes = (&*passes, &sets);
                let on = (on, factors);
                Some(Several::new(device, passes, &batch, on, parameters, team)?)
            }
            _ => None,
        };
        Ok(Self {
            commands,
            evenly,
            measure_only,
            several,
            readback,
            timestamps,
            batch,
            _sets: sets,
            _passes: passes,
        })
    }

    /// Pixels a side of the faces that it draws, if it draws any.
    pub(super) fn face_size(&self) -> Option<u32> {
        match &self.batch.sight {
            Sight::Hemicubes(hemicubes) => Some(hemicubes.face_size),
            Sight::Rays(_) => None,
        }
    }

    /// Runs batches, one always ahead of what is read, until `look` says no; then waits for the one ahead, whose results
    /// are looked at too.
    pub fn run(&mut self, look: impl FnMut(&BatchResult) -> bool) -> Result<()> {
        let sending = match &self.evenly {
            Some(_) => Sending::Evenly,
            None => Sending::ByDirection,
        };
        match &mut self.several {
            Some(several) => several.run(sending, look),
            None => self.run_alone(None, look),
        }
    }

    /// As [`Self::run`], before `next` runs, whose other devices may begin meanwhile.
    pub(super) fn run_before(
        &mut self,
        next: &mut Self,
        look: impl FnMut(&BatchResult) -> bool,
    ) -> Result<()> {
        self.run_alone(next.several.as_mut(), look)
    }

    fn run_alone(
        &mut self,
        mut next: Option<&mut Several>,
        mut look: impl FnMut(&BatchResult) -> bool,
    ) -> Result<()> {
        let mut now = 0;
        self.batch(now).submit()?;
        loop {
            self.batch(1 - now).submit()?;
            let result = self.finish(now)?;
            if let Some(next) = &mut next {
                next.foresee(result.progress.selected)?;
            }
            let go_on = look(&result);
            now = 1 - now;
            if !go_on {
                look(&self.finish(now)?);
                return Ok(());
            }
        }
    }

    /// Pairs of shot and element that faced away from one another, where several devices counted them.
    pub(super) fn facing_away(&self) -> u64 {
        self.several.as_ref().map_or(0, Several::facing_away)
    }

    fn batch(&mut self, i: usize) -> &mut Commands {
        match &mut self.evenly {
            Some(evenly) => &mut evenly.commands[i],
            None => &mut self.commands[i],
        }
    }

    /// Whether all has been sent evenly so far.
    pub fn sends_evenly(&self) -> bool {
        self.evenly.is_some()
    }

    /// Where all has been sent evenly so far: sources with a relief send by direction from now on, and elements with one have
    /// what came. Whether that was so.
    pub fn recall(&mut self) -> Result<bool> {
        let Some(mut evenly) = self.evenly.take() else {
            return Ok(false);
        };
        evenly.recall.submit()?;
        evenly.recall.wait()?;
        Ok(true)
    }

    fn finish(&mut self, i: usize) -> Result<BatchResult> {
        self.batch(i).wait()?;
        let intervals = self.timestamps[i].intervals()?;
        let layout = ReadbackLayout::new(&self.batch);
        Ok(layout.read(&self.readback[i], Stages::new(&intervals)))
    }

    /// What is unshot now, without shooting.
    pub fn remeasure(&mut self) -> Result<Progress> {
        let measure = match &mut self.evenly {
            Some(evenly) => &mut evenly.measure_only,
            None => &mut self.measure_only,
        };
        measure.submit()?;
        measure.wait()?;
        Ok(self.readback[0].read::<Progress>(0, 1)[0])
    }

    pub(super) fn item_buffers(&self, device: &Arc<Device>) -> Result<(Vec<u32>, Vec<u32>)> {
        let hemicubes = self.batch.hemicubes();
        let texels = pixel_count(hemicubes.face_size) * self.batch.slot_count as usize;
        let readback = Buffer::new(
            device,
            "item readback",
            4 * texels as u64,
            BufferUse::Readback,
        )?;
        Commands::run(device, "item readback", |cmd| {
            cmd.copy_shader_image_to_buffer(&hemicubes.items, &readback);
            cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
            Ok(())
        })?;
        Ok((
            readback.read(0, texels),
            (self.slots(device)?.iter())
                .take(self.batch.slot_count as usize)
                .map(|s| s.source)
                .collect(),
        ))
    }

    /// What the last batch chose.
    pub(super) fn slots(&self, device: &Arc<Device>) -> Result<Vec<Slot>> {
        download(device, &self.batch.slots, self.batch.all_slots() as usize)
    }
}

impl Passes {
    pub fn new(
        device: &Arc<Device>,
        settings: &Settings,
        item_buffer: ItemBuffer,
        on: &OnDevice<'_>,
    ) -> Result<Self> {
        let relief = on.relief.map(|_| ReliefSources::new(device));
        Ok(Self {
            measure: Measure::new(device)?,
            select: Select::new(device)?,
            cull: Cull::new(device, settings.culling)?,
            item_buffer,
            estimate: Estimate::new(device, settings, on)?,
            relief: relief.transpose()?,
        })
    }

    fn bind(&self, device: &Arc<Device>, batch: &Batch, on: &OnDevice<'_>) -> Result<Sets> {
        let relief = match (&self.relief, on.relief) {
            (Some(sources), Some(relief)) => Some(sources.bind(batch, on, relief)?),
            _ => None,
        };
        Ok(Sets {
            measure: self.measure.bind(on.scene, on.state)?,
            select: self.select.bind(on.scene, on.state, batch)?,
            drawing: match batch.sight {
                Sight::Hemicubes(_) => Some((
                    self.cull.bind(on.scene, batch)?,
                    self.item_buffer.bind(batch)?,
                )),
                Sight::Rays(_) => None,
            },
            estimate: self.estimate.bind(device, batch, on)?,
            relief,
        })
    }

    pub fn sends_evenly_first(&self, on: &OnDevice<'_>) -> bool {
        self.estimate.sends_evenly_first(on)
    }

    /// Measures, chooses the sources of a batch, and finds what they send by direction.
    pub fn choose(
        &self,
        cmd: &Commands,
        sets: &Sets,
        on: &OnDevice<'_>,
        batch: &Batch,
        (parameters, sending): (&Parameters, Sending),
    ) {
        self.measure(cmd, sets, on, sending);
        self.select.record(cmd, &sets.select, parameters);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        if let Some((sources, sets, relief)) = self.directed(sets, on, sending) {
            sources.send(cmd, sets, relief, batch);
        }
    }

    /// Keeps fresh form factors and gathers.
    pub fn gather(
        &self,
        cmd: &Commands,
        sets: &Sets,
        on: &OnDevice<'_>,
        batch: &Batch,
        sending: Sending,
    ) {
        let (estimate, bound) = (&self.estimate, &sets.estimate);
        estimate.record_gather(cmd, bound, batch, on, sending);
    }

    /// The sources that send by direction.
    fn directed<'a>(
        &'a self,
        sets: &'a Sets,
        on: &OnDevice<'a>,
        sending: Sending,
    ) -> Option<(&'a ReliefSources, &'a ReliefSets, &'a ReliefBuffers)> {
        match (&self.relief, &sets.relief, on.relief, sending) {
            (Some(sources), Some(sets), Some(relief), Sending::ByDirection) => {
                Some((sources, sets, relief))
            }
            _ => None,
        }
    }

    /// The unshot light of every source.
    fn measure(&self, cmd: &Commands, sets: &Sets, on: &OnDevice<'_>, sending: Sending) {
        self.measure
            .record(cmd, &sets.measure, on.scene.source_count);
        cmd.barrier(&[Stage::Compute], &[Stage::Compute]);
        if let Some((sources, sets, relief)) = self.directed(sets, on, sending) {
            sources.measure(cmd, sets, relief);
        }
    }
}
