//! Batches on several devices. The first one holds the solution: it chooses and gathers as if it were alone. Form factors of fresh sources
//! come from all devices, as rows in the host's memory, and take their places in the order of the slots, so that the sums are the same.

use std::collections::HashMap;
use std::sync::Arc;

use super::batch::{OnDevice, Passes, Sets};
use super::drawer::{Drawer, Row, RowWords};
use super::estimate::Sending;
use super::helpers::Helper;
use super::readback::{BatchResult, Stages};
use super::schedule::Schedule;
use crate::constants::{FACES, NONE};
use crate::error::Result;
use crate::passes::batch::Batch;
use crate::passes::buffers::{SceneBuffers, State};
use crate::passes::factor_buffers::FactorBuffers;
use crate::passes::select::Parameters;
use crate::passes::types::{KeptRow, Progress, Slot};
use crate::vk::{Buffer, BufferUse, Commands, Device, Stage, Timestamps};

/// Rows that are drawn ahead, in batches, and their bytes, at most: while emitters are shot, others have all that time.
const BATCHES_AHEAD: usize = 32;
const BYTES_AHEAD: u64 = 128 << 20;

/// What other devices are to do, and the first one for them.
pub(super) struct Team {
    pub own: Drawer,
    pub helpers: Vec<Helper>,
    /// Of each source, whether it is a strong emitter, which the loop before this one shoots.
    pub strong: Vec<bool>,
}

pub(super) struct Several {
    // Commands first: dropping them waits until the device is done with the rest.
    choose: BySending,
    /// For each number of fresh sources above 0.
    put: Vec<Commands>,
    gather: BySending,
    look_ahead: Commands,
    chosen: Buffer,
    rows: Buffer,
    choose_stamps: Timestamps,
    gather_stamps: Timestamps,
    layout: ChosenLayout,
    words: RowWords,
    parameters: Parameters,
    /// Whether something is gathered of which no time has been taken.
    gathering: bool,
    team: Team,
    schedule: Schedule,
    /// Pairs of shot and element that faced away from one another.
    facing_away: u64,
}

/// The same, as sources with a relief send.
struct BySending {
    by_direction: Commands,
    evenly: Option<Commands>,
}

impl BySending {
    fn of(&mut self, sending: Sending) -> &mut Commands {
        match (sending, &mut self.evenly) {
            (Sending::Evenly, Some(evenly)) => evenly,
            _ => &mut self.by_direction,
        }
    }
}

impl Several {
    pub fn new(
        device: &Arc<Device>,
        (passes, sets): (&Passes, &Sets),
        batch: &Batch,
        (on, factors): (&OnDevice<'_>, &FactorBuffers),
        parameters: Parameters,
        team: Team,
    ) -> Result<Self> {
        let layout = ChosenLayout::new(on.scene, batch);
        let words = RowWords::new(factors);
        let slots = u64::from(batch.slot_count);
        let bytes = slots * (words.bytes() + 4);
        let chosen = Buffer::new(device, "chosen", layout.bytes, BufferUse::Readback)?;
        let rows = Buffer::new(device, "rows", bytes, BufferUse::Upload)?;
        let choose_stamps = Timestamps::new(device, "choose timestamps", 2)?;
        let gather_stamps = Timestamps::new(device, "gather timestamps", 2)?;
        let choose = |sending| {
            Commands::record(device, "choose", |cmd| {
                cmd.reset_timestamps(&choose_stamps);
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                cmd.timestamp(&choose_stamps, 0);
                passes.choose(cmd, sets, on, batch, (&parameters, sending));
                cmd.timestamp(&choose_stamps, 1);
                layout.record(cmd, on.state, batch, &chosen);
                Ok(())
            })
        };
        let gather = |sending| {
            Commands::record(device, "gather", |cmd| {
                cmd.reset_timestamps(&gather_stamps);
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Compute]);
                cmd.timestamp(&gather_stamps, 0);
                passes.gather(cmd, sets, on, batch, sending);
                cmd.timestamp(&gather_stamps, 1);
                Ok(())
            })
        };
        let put = |count| {
            Commands::record(device, "put rows", |cmd| {
                cmd.barrier(&[Stage::Compute, Stage::Transfer], &[Stage::Transfer]);
                put_rows(cmd, words, (count, slots), &rows, batch, factors);
                Ok(())
            })
        };
        let first_evenly = passes.sends_evenly_first(on);
        let by_sending = |record: &dyn Fn(Sending) -> Result<Commands>| {
            Ok::<_, crate::error::Error>(BySending {
                by_direction: record(Sending::ByDirection)?,
                evenly: (first_evenly.then(|| record(Sending::Evenly))).transpose()?,
            })
        };
        let look_ahead = Commands::record(device, "look ahead", |cmd| {
            layout.record(cmd, on.state, batch, &chosen);
            Ok(())
        })?;
        Ok(Self {
            choose: by_sending(&choose)?,
            put: (1..=slots).map(put).collect::<Result<_>>()?,
            gather: by_sending(&gather)?,
            look_ahead,
            schedule: Schedule::new(team.helpers.len()),
            chosen,
            rows,
            choose_stamps,
            gather_stamps,
            layout,
            words,
            parameters,
            gathering: false,
            team,
            facing_away: 0,
        })
    }

    /// Pairs of shot and element that faced away from one another.
    pub fn facing_away(&self) -> u64 {
        self.facing_away
    }

    /// As [`super::batch::BatchLoop::run`]: one more batch follows the one at which `look` says no.
    pub fn run(
        &mut self,
        sending: Sending,
        mut look: impl FnMut(&BatchResult) -> bool,
    ) -> Result<()> {
        self.choose.of(sending).submit()?;
        let mut last = false;
        loop {
            let result = self.batch(sending, last)?;
            let go_on = look(&result);
            if last {
                break;
            }
            last = !go_on;
        }
        self.team.helpers.iter().for_each(Helper::let_be);
        Ok(())
    }

    fn batch(&mut self, sending: Sending, last: bool) -> Result<BatchResult> {
        self.choose.of(sending).wait()?;
        let mut stages = Stages {
            select: self.choose_stamps.intervals()?[0],
            gather: self.gathered(sending)?,
            ..Stages::default()
        };
        let chosen = self.layout.read(&self.chosen);
        let progress = chosen.progress;
        let shots = progress.selected + progress.replayed;
        let owners = self.schedule.choose(&chosen.sources, shots);
        self.ask(&chosen);
        let rows = self.draw(&chosen.sources, &owners, &mut stages)?;

        if let Some(last) = rows.len().checked_sub(1) {
            self.write(&rows);
            self.put[last].submit()?;
        }
        self.gather.of(sending).submit()?;
        self.gathering = true;
        if last {
            stages.gather += self.gathered(sending)?;
        } else {
            self.choose.of(sending).submit()?;
        }
        self.facing_away += rows
            .iter()
            .map(|row| u64::from(row.facing_away))
            .sum::<u64>();
        let faces = FACES as usize * self.put.len();
        let mut counts: Vec<_> = rows.iter().flat_map(|r| r.counts.iter().copied()).collect();
        counts.resize(faces, bytemuck::Zeroable::zeroed());
        Ok(BatchResult {
            progress,
            stages,
            counts,
        })
    }

    /// Waits for the last gathering, if there is one, and says how long it took.
    fn gathered(&mut self, sending: Sending) -> Result<f64> {
        if !std::mem::take(&mut self.gathering) {
            return Ok(0.0);
        }
        self.put.iter_mut().try_for_each(Commands::wait)?;
        self.gather.of(sending).wait()?;
        Ok(self.gather_stamps.intervals()?[0])
    }

    /// The rows of the chosen sources, in their order.
    fn draw(&mut self, sources: &[u32], owners: &[usize], stages: &mut Stages) -> Result<Vec<Row>> {
        let of = |device: usize| -> Vec<u32> {
            let owned = sources.iter().zip(owners).filter(|(_, o)| **o == device);
            owned.map(|(s, _)| *s).collect()
        };
        for (i, helper) in self.team.helpers.iter().enumerate() {
            helper.ask_now(&of(i + 1));
        }
        let mut own = Vec::new();
        for some in of(0).chunks(self.team.own.slots()) {
            let (rows, took) = self.team.own.draw(some)?;
            own.extend(rows);
            *stages += took;
        }
        let mut own = own.into_iter();
        let rows = sources
            .iter()
            .zip(owners)
            .map(|(&source, &owner)| match owner.checked_sub(1) {
                None => Ok(own.next().expect("one for each that it was asked for")),
                Some(helper) => self.team.helpers[helper].take(source),
            });
        let rows = rows.collect::<Result<_>>()?;
        for helper in &self.team.helpers {
            *stages += helper.take_stages();
        }
        Ok(rows)
    }

    /// Brings rows to where `put` takes them from.
    fn write(&mut self, rows: &[Row]) {
        let RowWords {
            plain,
            meso,
            occupied,
        } = self.words;
        let slots = self.put.len() as u64;
        let after_plain = 4 * slots * plain;
        let after_meso = after_plain + 4 * slots * meso;
        let after_occupied = after_meso + 4 * slots * occupied;
        for (i, row) in (0..).zip(rows) {
            self.rows.write(4 * i * plain, &row.plain);
            self.rows.write(after_plain + 4 * i * meso, &row.meso);
            self.rows
                .write(after_meso + 4 * i * occupied, &row.occupied);
            self.rows.write(after_occupied + 4 * i, &[row.scale]);
        }
    }

    /// While strong emitters are shot, of which a batch has had so many: what the others see has no need to wait.
    pub fn foresee(&mut self, emitters: u32) -> Result<()> {
        self.look_ahead.submit()?;
        self.look_ahead.wait()?;
        let mut chosen = self.layout.read(&self.chosen);
        let waiting = chosen.waiting.len();
        let strong = &self.team.strong;
        chosen.waiting.retain(|s| !strong[s.index as usize]);
        let left = waiting - chosen.waiting.len();
        self.schedule.emitters(emitters, left as u32);
        self.ask(&chosen);
        Ok(())
    }

    /// Asks the other devices for the sources with the most unshot power that are not drawn.
    fn ask(&mut self, chosen: &Chosen) {
        let mut waiting: Vec<&Waiting> = chosen.waiting.iter().collect();
        waiting.sort_by(|a, b| b.power.total_cmp(&a.power).then(a.index.cmp(&b.index)));
        // The last ones may stay unshot when all is done.
        let mut left = 0.0;
        while let Some(source) = waiting.last()
            && left + source.power <= self.parameters.stop_power
        {
            left += source.power;
            waiting.pop();
        }
        let shots = self
            .parameters
            .shot_limit
            .saturating_sub(chosen.progress.shots);
        waiting.truncate(shots as usize);
        let by_bytes = (BYTES_AHEAD / self.words.bytes().max(1)) as usize;
        let most = (BATCHES_AHEAD * self.put.len()).min(by_bytes.max(self.put.len()));
        let sources = waiting.iter().map(|s| s.index);
        let places: HashMap<u32, usize> = sources.clone().zip(0..).collect();
        for (device, source) in self.schedule.foresee(sources, most) {
            self.team.helpers[device - 1].ask(source);
        }
        for helper in &self.team.helpers {
            helper.order(&places);
        }
    }
}

/// Rows to the places of the first slots, as if they had been drawn there.
fn put_rows(
    cmd: &Commands,
    words: RowWords,
    (count, slots): (u64, u64),
    rows: &Buffer,
    batch: &Batch,
    factors: &FactorBuffers,
) {
    let mut at = 0;
    for (words, to) in [
        (words.plain, &factors.fresh),
        (words.meso, &factors.fresh_meso),
        (words.occupied, &factors.occupied),
    ] {
        cmd.copy(rows, at, to, 0, 4 * count * words);
        at += 4 * slots * words;
    }
    let scale = std::mem::offset_of!(Slot, scale) as u64;
    for slot in 0..count {
        let to = slot * size_of::<Slot>() as u64 + scale;
        cmd.copy(rows, at + 4 * slot, &batch.slots, to, 4);
    }
}

/// What the first device has chosen, and what it may choose next.
struct Chosen {
    progress: Progress,
    /// Of the fresh slots.
    sources: Vec<u32>,
    waiting: Vec<Waiting>,
}

/// A source that has something to send and is not kept.
struct Waiting {
    index: u32,
    power: f32,
}

struct ChosenLayout {
    fresh: usize,
    sources: usize,
    slots: u64,
    unshot: u64,
    kept: u64,
    bytes: u64,
}

impl ChosenLayout {
    fn new(scene: &SceneBuffers, batch: &Batch) -> Self {
        let (fresh, sources) = (batch.slot_count as usize, scene.source_count as usize);
        let slots = size_of::<Progress>() as u64;
        let unshot = slots + (fresh * size_of::<Slot>()) as u64;
        let kept = unshot + (sources * size_of::<[f32; 4]>()) as u64;
        Self {
            fresh,
            sources,
            slots,
            unshot,
            kept,
            bytes: kept + (sources * size_of::<KeptRow>()) as u64,
        }
    }

    fn record(&self, cmd: &Commands, state: &State, batch: &Batch, to: &Buffer) {
        cmd.barrier(&[Stage::Compute], &[Stage::Transfer]);
        for (from, at, end) in [
            (&state.progress, 0, self.slots),
            (&batch.slots, self.slots, self.unshot),
            (&state.unshot, self.unshot, self.kept),
            (&state.kept_rows, self.kept, self.bytes),
        ] {
            cmd.copy(from, 0, to, at, end - at);
        }
        cmd.barrier(&[Stage::Transfer], &[Stage::Host]);
    }

    fn read(&self, from: &Buffer) -> Chosen {
        let slots: Vec<Slot> = from.read(self.slots, self.fresh);
        let unshot: Vec<[f32; 4]> = from.read(self.unshot, self.sources);
        let kept: Vec<KeptRow> = from.read(self.kept, self.sources);
        let waiting = (0..).zip(unshot.iter().zip(&kept));
        let waiting = waiting.filter(|(_, (unshot, kept))| unshot[3] > 0.0 && kept.chunk == NONE);
        Chosen {
            progress: from.read::<Progress>(0, 1)[0],
            sources: slots
                .iter()
                .map(|s| s.source)
                .take_while(|&s| s != NONE)
                .collect(),
            waiting: waiting
                .map(|(index, (unshot, _))| Waiting {
                    index,
                    power: unshot[3],
                })
                .collect(),
        }
    }
}
