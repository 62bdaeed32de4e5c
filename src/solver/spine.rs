//! The method: rows, coupling, solve, gather.
//!
//! Sources are drawn once, the strongest emitters first and then by unshot power (Southwell). What
//! a row brings to every other source is summed while the row is at hand, so that bounces are
//! solved among the sources. In the end the rows bring what the sources send to the elements.

mod settling;

use std::cmp::Reverse;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use settling::MOST_TURNS;

use super::coupling::Targets;
use super::devices::Crew;
use super::gather::LitRow;
use super::journal::{Checkpoints, Journal};
use super::ledger::{Candidates, Drawn, Kept, Ledger, strongest_first};
use super::makers::{Batch, RowKind};
use super::near::NearLight;
use super::problem::Relit;
use super::progress::{Bound, Pace, Watch};
use super::rows::Made;
use super::shares::Share;
use super::team::{Taken, Team};
use super::turns::Turns;
use super::visibility::Visibility;
use super::{DrawnBatch, Problem, Report, StopReason};
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::passes::scene_data::SceneData;

/// A solution under way.
pub(super) struct Spine {
    pub team: Team,
    pub ledger: Ledger,
    /// Rows that were kept so far.
    made: u32,
    journal: Option<Journal>,
    pace: Pace,
    pub near: NearLight,
    /// Of what sources reflect of near light.
    turns: Turns,
    /// Whether rows have brought light since `near` was solved.
    brought: bool,
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Sources that were not drawn yet.
    First,
    /// Sources whose rows found no room, to send what they owe the elements.
    Again,
}

/// Of the unshot power that turns into what may be missing: what sweeps may leave.
const UNSOLVED: f64 = 0.01;

/// Between batches sweeps leave this share of what the undrawn sources have: it orders them well
/// enough.
const ORDERED: f64 = 0.1;

/// Sweeps between two batches, and of a whole solution, at most.
const ORDERING_SWEEPS: usize = 4;
const MOST_SWEEPS: usize = 1000;

/// Over what may be missing, what is missing when the importance of sources is first lowered.
const NEAR_THE_END: f64 = 8.0;

/// The sources that are best drawn next change as rows are made: the first batches are small, and
/// all others no more than this share of what was drawn.
const FIRST_BATCH: u32 = 16;
const BATCH_SHARE: u32 = 4;

/// Times that light is measured and corrected, at most.
const CORRECTIONS: u32 = 50;

impl Spine {
    /// With the rows of `restored`, which lie behind one another in the order of the sources.
    pub fn new(
        crew: &Crew,
        on: &Problem,
        scene: SceneData,
        bound: Bound,
        restored: Option<&Visibility>,
    ) -> Result<Self> {
        let targets = Targets::new(&on.elements, &on.sources.list);
        // Lights may have moved, and be others.
        let not_lights = |s: usize| on.sources.list.get(s).is_some_and(Source::is_surface);
        let kept = restored
            .map(|restored| restored.kept(not_lights))
            .unwrap_or_default();
        let rows = |s: usize| kept.get(s).copied().flatten();
        let coupling = |s, words| restored?.coupling(s, words);
        let whole = scene.shape;
        let slices = |shares: &[Arc<Share>]| Some(restored?.slices(shares, whole, not_lights));
        Ok(Self {
            team: Team::new(crew, on, scene, &targets, slices)?,
            near: NearLight::new(on),
            turns: Turns::default(),
            brought: true,
            made: kept.iter().flatten().count() as u32,
            journal: None,
            pace: Pace::default(),
            ledger: Ledger::new(crew.first()?, on, bound, rows, coupling),
        })
    }

    /// Goes on from what is `at` a folder, and keeps there what is drawn. Where no rows are kept on
    /// the device there is nothing to go on from.
    ///
    /// # Errors
    /// A device that fails.
    pub fn keep_checkpoints(
        &mut self,
        at: &Checkpoints,
        key: String,
        report: &mut Report,
    ) -> Result<()> {
        if !self.team.keeps() {
            return Ok(());
        }
        let sizes = [
            self.ledger.sources.len(),
            self.ledger.system.targets.words(),
        ];
        let journal = Journal::open(&mut self.team, at, key, sizes)?;
        report.resumed = journal.rows() as u64;
        self.journal = Some(journal);
        Ok(())
    }

    /// Begins again with the rows that there are, but for those of lights that have moved.
    pub fn relight(&mut self, on: &Problem, bound: Bound, relit: &Relit) -> Result<()> {
        let moved = &relit.moved;
        // It is of the light before.
        self.journal = None;
        let device = Arc::clone(&self.team.first().device);
        let before = &mut self.ledger;
        let rows: Vec<_> = (before.sources.iter().zip(moved))
            .map(|(drawn, moved)| drawn.row.filter(|_| !moved))
            .collect();
        let of_moved = (0..).zip(moved).filter(|(_, moved)| **moved);
        let dropped: Vec<u32> = of_moved.map(|(s, _)| s).collect();
        let coupling = |s, _| before.system.take_row(s);
        self.near.relight(on);
        self.brought = true;
        self.ledger = Ledger::new(&device, on, bound, |s| rows[s], coupling);
        // Those that were drawn first may have been all of their kind.
        self.team.relight(on, relit, dropped, &self.kinds_to_draw())
    }

    /// Goes on until the solution is done, which the elements have then, or the watch says stop.
    pub fn run(&mut self, on: &Problem, report: &mut Report, watch: &mut Watch<'_>) -> Result<()> {
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        let (mut corrections, mut turns) = (0, 0);
        let mut drawn_before = None;
        while self.draw(on, Phase::First, report, watch)? {
            self.solve(
                UNSOLVED * self.ledger.bound.stop_power(),
                MOST_SWEEPS,
                report,
            );
            if report.shots < limit && self.ledger.undrawn().is_some() {
                continue;
            }
            self.carry(on, report);
            if report.shots < limit && self.ledger.lacks() {
                continue;
            }
            // With relief the first light is measured next, which tells more than another turn.
            let first = on.has_relief() && corrections == 0;
            match first {
                true => drop(self.bring(on, false, report, &mut self.looks(report, watch))?),
                false => self.settle(on, corrections > 0, report, watch)?,
            }
            if watch.stop.is_some() {
                break;
            }
            // Without what is carried less may be unshot, so that nothing more is drawn.
            let drew = drawn_before.replace(report.shots) != Some(report.shots);
            if drew && report.shots < limit && self.ledger.undrawn().is_some() {
                continue;
            }
            if !self.draw(on, Phase::Again, report, watch)? {
                break;
            }
            // What rows without room have brought moves near light once more.
            let settled = first || self.is_settled(on, false, report, watch)?;
            if watch.stop.is_some() {
                break;
            }
            if !settled && turns < MOST_TURNS {
                turns += 1;
                continue;
            }
            // By coupling alone the light is solved where every source has its row, and sends
            // evenly.
            if !on.has_relief() && self.ledger.system.is_whole() {
                break;
            }
            self.measure(on)?;
            // Sources that may not be drawn any more lack what they lack.
            let lost = match report.shots < limit {
                true => 0.0,
                false => self.ledger.undrawn_missing(),
            };
            let left = self.ledger.missing() - lost;
            if corrections > 0 && left <= self.ledger.bound.most_missing() {
                break;
            }
            if corrections == CORRECTIONS {
                tracing::warn!("light by direction does not settle: {left:.1e} of it is unshot");
                break;
            }
            corrections += 1;
            self.ledger.system.shoot_unknown();
        }
        if watch.stop.is_some() {
            self.carry(on, report);
        }
        let done = match self.ledger.missing() <= self.ledger.bound.most_missing() {
            true => StopReason::Residual,
            false if report.shots >= limit => StopReason::Shots,
            false => StopReason::Unsolved,
        };
        if watch.stop.is_none() && done == StopReason::Unsolved {
            tracing::warn!("the scene absorbs no light: what is emitted goes to and fro for ever");
        }
        watch.stop.get_or_insert(done);
        report.kept_sources = self
            .ledger
            .sources
            .iter()
            .filter(|d| d.row.is_some())
            .count() as u64;
        report.coupling_bytes = self.ledger.system.bytes();
        report.sweeps = self.ledger.system.sweeps;
        Ok(())
    }

    /// Draws what the phase asks for. Whether nothing stopped it.
    fn draw(
        &mut self,
        on: &Problem,
        phase: Phase,
        report: &mut Report,
        watch: &mut Watch<'_>,
    ) -> Result<bool> {
        if phase == Phase::First {
            self.ledger.system.release();
        }
        loop {
            while let Some(batch) = self.choose(on, phase, report, watch.left())? {
                self.submit(batch)?;
            }
            if !self.take(on, phase, report)? {
                return Ok(watch.stop.is_none());
            }
            self.write_checkpoint(false)?;
            let (unshot, missing) = (self.ledger.unshot(), self.ledger.missing());
            if !watch.look(report.shots, unshot, missing) {
                while self.take(on, phase, report)? {}
                self.write_checkpoint(watch.stop == Some(StopReason::Interrupted))?;
                return Ok(false);
            }
        }
    }

    fn submit(&mut self, batch: Batch) -> Result<()> {
        for &source in &batch.sources {
            self.ledger.sources[source as usize].under_way = true;
        }
        let recorded = match &mut self.journal {
            Some(journal) => journal.next(&batch)?,
            None => None,
        };
        self.pace.begin();
        self.team.submit(batch, recorded)
    }

    /// Asks the watch during work that draws nothing.
    fn looks<'w, 'a>(
        &self,
        report: &Report,
        watch: &'w mut Watch<'a>,
    ) -> impl FnMut() -> bool + use<'w, 'a> {
        let (unshot, missing) = (self.ledger.unshot(), self.ledger.missing());
        watch.looks(report.shots, unshot, missing)
    }

    /// If it is time for one, or `now`, if the bake is long.
    fn write_checkpoint(&mut self, now: bool) -> Result<()> {
        match &mut self.journal {
            Some(journal) => journal.write(&mut self.team, now),
            None => Ok(()),
        }
    }

    /// Takes in the oldest batch under way. Whether there was one.
    fn take(&mut self, on: &Problem, phase: Phase, report: &mut Report) -> Result<bool> {
        let Some(Taken {
            kind,
            made,
            recorded,
        }) = self.team.take(&on.sources.list)?
        else {
            return Ok(false);
        };
        let drawn = if recorded { 0 } else { made.rows.len() };
        self.pace.end(kind, drawn, self.team.is_drawing());
        if let Some(journal) = self.journal.as_mut().filter(|_| !recorded) {
            journal.add(kind, &made);
        }
        self.take_in(on, made, report)?;
        if phase == Phase::First {
            let undrawn = self.ledger.system.unshot().undrawn;
            let most = ORDERED * undrawn.max(self.ledger.bound.stop_power());
            self.solve(most, ORDERING_SWEEPS, report);
            // Importance matters once the end is near.
            if self.ledger.missing() <= NEAR_THE_END * self.ledger.bound.most_missing() {
                self.ledger.weigh(on);
            }
        }
        Ok(true)
    }

    /// The sources of the next batch, if one is to be drawn, and can begin and end in this time.
    fn choose(
        &mut self,
        on: &Problem,
        phase: Phase,
        report: &Report,
        time: Option<Duration>,
    ) -> Result<Option<Batch>> {
        let under_way = self.ledger.sources.iter().filter(|d| d.under_way).count() as u32;
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        let chosen = report.shots + under_way;
        let left = limit.saturating_sub(chosen) as usize;
        let worth = (chosen / BATCH_SHARE).max(FIRST_BATCH) as usize;
        let candidates = match phase {
            Phase::First => self.ledger.undrawn(),
            Phase::Again => self.ledger.owing(),
        };
        let Some(Candidates { powers, kind }) = candidates.filter(|_| left > 0) else {
            return Ok(None);
        };
        let mut candidates = powers;
        let recorded = self.journal.as_ref().and_then(Journal::next_size);
        let fitting = |left| {
            let (under_way, elements) = (under_way as usize, on.elements.len());
            self.pace.fitting(kind, left, under_way, elements)
        };
        let in_time = recorded.or(time.map(fitting)).unwrap_or(usize::MAX);
        self.prepare()?;
        if !self.team.has_room() || in_time == 0 {
            return Ok(None);
        }
        candidates.sort_by(strongest_first);
        candidates.truncate(self.team.slots(kind).min(left).min(worth).min(in_time));
        let sources = candidates.into_iter().map(|(s, _)| s).collect();
        Ok(Some(Batch { sources, kind }))
    }

    /// Solves the system, keeps the rows of a batch, and gathers by those that find no room.
    fn take_in(&mut self, on: &Problem, made: Made, report: &mut Report) -> Result<()> {
        report.seconds.stages += made.stages;
        report.sent_bytes += made.sent;
        let mut loose = Vec::new();
        for row in made.rows {
            let s = row.source as usize;
            report.add(
                &row,
                on.sources.list[s].area,
                self.ledger.sources[s].kind,
                self.ledger.sources[s].times > 0,
            );
            let drawn = &mut self.ledger.sources[s];
            drawn.under_way = false;
            drawn.times += 1;
            if !self.ledger.system.is_drawn(s) {
                self.ledger.system.draw(s, Some(row.coupling));
            }
            match row.places.is_some() {
                true => {
                    self.ledger.sources[s].row = Some(Kept {
                        scale: row.scale,
                        order: self.made,
                    });
                    self.made += 1;
                }
                false => loose.extend(self.ledger.to_send(s, row.scale, true)),
            }
        }
        self.gather(loose, report, &mut || true)?;
        Ok(())
    }

    /// What `lit` has of the sources whose rows are kept, the last one first: those that send
    /// little are added up before the strongest.
    fn kept_rows(&self, lit: impl Fn(&Ledger, usize, f32) -> Option<LitRow>) -> Vec<LitRow> {
        let sources = self.ledger.sources.iter().enumerate();
        let of = |(s, drawn): (usize, &Drawn)| {
            let Kept { scale, order } = drawn.row?;
            Some((order, lit(&self.ledger, s, scale)?))
        };
        let mut rows: Vec<(u32, LitRow)> = sources.filter_map(of).collect();
        rows.sort_by_key(|(order, _)| Reverse(*order));
        rows.into_iter().map(|(_, lit)| lit).collect()
    }

    /// Sends through rows what they have to send. Whether `go_on` never said no.
    fn gather(
        &mut self,
        mut rows: Vec<LitRow>,
        report: &mut Report,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<bool> {
        let start = Instant::now();
        self.brought |= !rows.is_empty();
        // Those that send by direction come first: shaders add them up apart from the others.
        rows.sort_by_key(|lit| !self.ledger.sources[lit.source as usize].relief);
        let mut whole = true;
        for some in rows.chunks(self.team.most_rows()) {
            self.team.gather(some)?;
            some.iter().for_each(|lit| self.ledger.sent_by(lit));
            report.gathered_rows += some.len() as u64;
            whole = go_on();
            if !whole {
                break;
            }
        }
        report.seconds.gather += start.elapsed().as_secs_f64();
        Ok(whole)
    }

    fn solve(&mut self, most: f64, sweeps: usize, report: &mut Report) {
        let start = Instant::now();
        self.ledger.system.solve(most, sweeps);
        report.seconds.solve += start.elapsed().as_secs_f64();
    }

    /// Lets rows carry what undrawn sources send, and solves by coupling.
    pub fn carry(&mut self, on: &Problem, report: &mut Report) {
        let start = Instant::now();
        if on.settings.carries {
            self.ledger.carry(on);
        }
        report.seconds.solve += start.elapsed().as_secs_f64();
        let most = UNSOLVED * self.ledger.bound.stop_power();
        self.solve(most, MOST_SWEEPS, report);
    }

    /// Goes on from the light that the elements have.
    fn measure(&mut self, on: &Problem) -> Result<()> {
        let reflected = self.team.measure()?;
        let sent: Vec<DVec3> = self
            .ledger
            .sources
            .iter()
            .map(|drawn| drawn.gathered)
            .collect();
        self.ledger.system.measured(&reflected, &sent);
        self.near.measured();
        self.turns.forget();
        self.ledger.system.set_near(&self.reflected_near(on));
        Ok(())
    }

    /// See [`super::Solver::draw`].
    pub fn draw_alone(&mut self, on: &Problem, sources: &[u32]) -> Result<DrawnBatch> {
        self.prepare()?;
        let batch = Batch {
            sources: sources.to_vec(),
            kind: RowKind::Common,
        };
        self.team.submit(batch, None)?;
        let taken = self
            .team
            .take(&on.sources.list)?
            .expect("a batch was submitted");
        let (made, words) = (taken.made, self.ledger.system.targets.words());
        Ok(DrawnBatch {
            stages: made.stages,
            facing_away: made.rows.iter().map(|row| row.facing_away).collect(),
            counts: made.rows.iter().map(|row| row.counts.clone()).collect(),
            coupling: (made.rows.into_iter())
                .map(|row| row.coupling.words(words))
                .collect(),
            items: self.team.items()?,
            slots: self.team.slots(RowKind::Common) as u32,
        })
    }

    /// Kinds of the sources without a row.
    fn kinds_to_draw(&self) -> Vec<RowKind> {
        let without_row = |drawn: &&Drawn| drawn.row.is_none();
        kinds_of(self.ledger.sources.iter().filter(without_row))
    }

    /// Lets the team make what draws, when a source is first to be drawn.
    fn prepare(&mut self) -> Result<()> {
        let without_row = |drawn: &&Drawn| drawn.row.is_none();
        let undrawn = self.ledger.sources.iter().filter(without_row);
        self.team.prepare(|| kinds_of(undrawn))
    }
}

fn kinds_of<'a>(sources: impl Iterator<Item = &'a Drawn>) -> Vec<RowKind> {
    let mut kinds: Vec<RowKind> = sources.map(|drawn| drawn.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    kinds
}
