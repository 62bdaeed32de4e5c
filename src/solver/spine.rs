//! The method: rows, coupling, solve, gather.
//!
//! Sources are drawn once, the strongest emitters first and then by unshot power (Southwell). What a
//! row brings to every other source is summed while the row is at hand, so that bounces are solved
//! among the sources. In the end the rows bring what the sources send to the elements.

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};

use super::coupling::{CouplingRow, Targets};
use super::gather::{Gathering, Lit, LitRow};
use super::progress::Watch;
use super::rows::{Factors, Made, looks_closer};
use super::scene_parts::SceneParts;
use super::system::System;
use super::team::{Batch, Team, TeamParts};
use super::visibility::Visibility;
use super::{DrawnBatch, Report, Settings, StopReason};
use crate::constants::KIND_POINT;
use crate::error::Result;
use crate::mesh::sources::least_strong;
use crate::passes::buffers::{SceneBuffers, State};
use crate::passes::fresh_rows::RowShape;
use crate::passes::kept_rows::{KeptRows, KeptSize};
use crate::passes::relief_buffers::{ReliefBuffers, meso_elements};
use crate::passes::types::KeptRow;
use crate::vk::Device;

/// A solution under way.
pub(super) struct Spine {
    devices: Vec<Arc<Device>>,
    /// Made when a source is first to be drawn.
    team: Option<Team>,
    pub system: System,
    pub kept: KeptRows,
    gathering: Gathering,
    /// `[source]`
    sources: Vec<Drawn>,
    size: SpineSize,
}

/// What a solution is made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct SpineSize {
    /// Bytes for kept rows, at most.
    pub memory: u64,
    /// Sources of a batch.
    pub slots: u32,
    /// Unshot power at which the solution is done, internal units.
    pub stop_power: f64,
}

/// What a solution is of, and where its light lies.
#[derive(Clone, Copy)]
pub(super) struct On<'a> {
    pub settings: &'a Settings,
    pub parts: &'a SceneParts<'a>,
    pub scene: &'a SceneBuffers,
    pub state: &'a State,
    pub relief: Option<&'a ReliefBuffers>,
}

/// What has been done with a source.
#[derive(Debug, Clone, Copy, Default)]
struct Drawn {
    /// It emits strongly.
    strong: bool,
    /// Its elements have a relief.
    relief: bool,
    under_way: bool,
    /// Times that it was drawn.
    times: u32,
    /// Where its row is kept.
    row: Option<KeptRow>,
    emission_gathered: bool,
    /// Reflected radiosity that the elements have received.
    gathered: DVec3,
    /// With a relief: what it sends has been corrected by direction.
    directed: bool,
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// Sources that were not drawn yet.
    First,
    /// Sources whose rows found no room, to send what they owe the elements.
    Again,
}

/// Of the unshot power at which the solution is done: what undrawn sources may have, what sweeps may
/// leave, and what need not be drawn again.
const UNDRAWN: f64 = 0.9;
const UNSOLVED: f64 = 0.01;
const UNGATHERED: f64 = 0.04;

/// Between batches sweeps leave this share of what the undrawn sources have: it orders them well enough.
const ORDERED: f64 = 0.1;

/// Times that light is measured and corrected, at most.
const CORRECTIONS: u32 = 50;

/// About the share of a relief's light that leaves in other directions than if it left evenly.
const UNEVEN: f64 = 0.1;

impl Spine {
    /// With the rows of `restored`, which lie behind one another in the order of the sources.
    pub fn new(
        devices: &[Arc<Device>],
        on: On<'_>,
        size: SpineSize,
        restored: Option<&Visibility>,
    ) -> Result<Self> {
        let device = &devices[0];
        let shape = RowShape::new(on.scene, on.relief.map_or(0, |r| r.element_count));
        let kept_size = KeptSize {
            memory: size.memory,
            sources: on.scene.source_count,
            slots: size.slots,
        };
        let kept = KeptRows::new(device, shape, kept_size, restored.map(Visibility::size))?;
        let list = &on.parts.sources.list;
        let targets = Targets::new(on.parts.elements, list);
        let mut system = System::new(targets, list, on.settings.coupling_memory);
        let least = least_strong(list, &on.settings.grouping);
        let of_relief = &on.parts.sources.relief;
        let looks = looks_closer(device, on.settings);
        let drawn = |(s, source): (usize, &crate::mesh::sources::Source)| Drawn {
            strong: looks && least > 0.0 && source.emitted_power() >= least,
            relief: of_relief.contains(&s),
            ..Drawn::default()
        };
        let mut sources: Vec<Drawn> = list.iter().enumerate().map(drawn).collect();
        if let Some(restored) = restored {
            kept.restore(device, restored.state(), &restored.chunks)?;
            for (s, (source, drawn)) in list.iter().zip(&mut sources).enumerate() {
                if let Some(row) = restored.row(s).filter(|_| source.kind != KIND_POINT) {
                    drawn.row = Some(row);
                    system.draw(s, restored.coupling(s, system.targets.words()));
                }
            }
        }
        let lit = Lit {
            scene: on.scene,
            state: on.state,
            kept: &kept,
            relief: on.relief,
        };
        let most = on.scene.source_count.max(size.slots);
        Ok(Self {
            gathering: Gathering::new(device, lit, most)?,
            devices: devices.to_vec(),
            team: None,
            system,
            kept,
            sources,
            size,
        })
    }

    /// Goes on until the solution is done, which the elements have then, or the watch says stop.
    pub fn run(&mut self, on: On<'_>, report: &mut Report, watch: &mut Watch<'_>) -> Result<()> {
        let mut corrections = 0;
        while self.draw(on, Phase::First, report, watch)? {
            self.solve(UNSOLVED * self.size.stop_power, report);
            self.gather_kept(on, corrections > 0, report)?;
            if !self.draw(on, Phase::Again, report, watch)? {
                break;
            }
            // By coupling alone the light is solved where every source has its row, and sends evenly.
            if on.relief.is_none() && self.system.is_whole() {
                break;
            }
            self.measure(on)?;
            let left = self.unshot();
            if corrections > u32::from(on.relief.is_some()) && left <= self.size.stop_power {
                break;
            }
            if corrections == CORRECTIONS {
                tracing::warn!("light by direction does not settle: {left:.1e} of it is unshot");
                break;
            }
            corrections += 1;
            self.system.shoot_unknown();
        }
        if watch.stop.is_some() {
            self.solve(UNSOLVED * self.size.stop_power, report);
        }
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        let reached = report.shots >= limit && self.unshot() > self.size.stop_power;
        let done = match reached {
            true => StopReason::Shots,
            false => StopReason::Residual,
        };
        watch.stop.get_or_insert(done);
        report.kept_sources = self.sources.iter().filter(|d| d.row.is_some()).count() as u64;
        report.coupling_bytes = self.system.bytes();
        report.sweeps = self.system.sweeps;
        Ok(())
    }

    /// Brings to the elements what has been solved and has a row.
    pub fn gather_solved(&mut self, on: On<'_>, report: &mut Report) -> Result<()> {
        self.gather_kept(on, false, report)
    }

    /// Draws what the phase asks for. Whether nothing stopped it.
    fn draw(
        &mut self,
        on: On<'_>,
        phase: Phase,
        report: &mut Report,
        watch: &mut Watch<'_>,
    ) -> Result<bool> {
        loop {
            while let Some(batch) = self.choose(on, phase, report)? {
                for &source in &batch.sources {
                    self.sources[source as usize].under_way = true;
                }
                if let Some(team) = &mut self.team {
                    team.submit(batch)?;
                }
            }
            if !self.take(on, phase, report)? {
                return Ok(watch.stop.is_none());
            }
            let share = watch.share(self.unshot());
            if !watch.look(report.shots, share) {
                while self.take(on, phase, report)? {}
                return Ok(false);
            }
        }
    }

    /// Takes in the oldest batch under way. Whether there was one.
    fn take(&mut self, on: On<'_>, phase: Phase, report: &mut Report) -> Result<bool> {
        let Some(team) = &mut self.team else {
            return Ok(false);
        };
        let Some(made) = team.take(&self.kept)? else {
            return Ok(false);
        };
        self.take_in(on, made, report)?;
        if phase == Phase::First {
            let undrawn = self.system.unshot().undrawn;
            self.solve(ORDERED * undrawn.max(self.size.stop_power), report);
        }
        Ok(true)
    }

    /// The sources of the next batch, if one is to be drawn and can begin.
    fn choose(&mut self, on: On<'_>, phase: Phase, report: &Report) -> Result<Option<Batch>> {
        let under_way = self.sources.iter().filter(|d| d.under_way).count() as u32;
        let limit = on.settings.shots.unwrap_or(u32::MAX);
        let left = limit.saturating_sub(report.shots + under_way) as usize;
        let candidates = match phase {
            Phase::First => self.undrawn(),
            Phase::Again => self.owing(),
        };
        let Some((mut candidates, strong)) = candidates.filter(|_| left > 0) else {
            return Ok(None);
        };
        let slots = self.size.slots;
        let kept = &self.kept;
        let team = Self::team(&mut self.team, on, &self.devices, &self.system, kept, slots)?;
        if !team.has_room(strong) {
            return Ok(None);
        }
        // Powers that differ by rounding alone are equal.
        let power = |(_, power): &(u32, f64)| *power as f32;
        candidates.sort_by(|a, b| power(b).total_cmp(&power(a)).then(a.0.cmp(&b.0)));
        candidates.truncate(team.slots(strong).min(left));
        let sources = candidates.into_iter().map(|(s, _)| s).collect();
        Ok(Some(Batch { sources, strong }))
    }

    /// Sources that are to be drawn first, with their unshot power: the strong emitters, and after them
    /// all others, until all emission is drawn and little is left. And whether they are strong.
    fn undrawn(&self) -> Option<(Vec<(u32, f64)>, bool)> {
        let mut strong = Vec::new();
        let mut others = Vec::new();
        let (mut emitted_left, mut power_left) = (0.0, 0.0);
        for (s, drawn) in self.sources.iter().enumerate() {
            if self.system.is_drawn(s) || drawn.under_way {
                continue;
            }
            let (power, emitted) = self.system.unshot_power(s);
            if power > 0.0 {
                emitted_left += emitted;
                power_left += power;
                let list = if drawn.strong {
                    &mut strong
                } else {
                    &mut others
                };
                list.push((s as u32, power));
            }
        }
        if !strong.is_empty() {
            return Some((strong, true));
        }
        let done = emitted_left == 0.0 && power_left <= UNDRAWN * self.size.stop_power;
        (!done).then_some((others, false))
    }

    /// Sources without rows that owe the elements light, with its power, unless little is left.
    fn owing(&self) -> Option<(Vec<(u32, f64)>, bool)> {
        let owes = |(s, drawn): (usize, &Drawn)| {
            let loose = self.system.is_drawn(s) && drawn.row.is_none() && !drawn.under_way;
            let power = self.owed_power(s);
            (loose && power > 0.0).then_some((s as u32, power))
        };
        let mut owing: Vec<(u32, f64)> = self.sources.iter().enumerate().filter_map(owes).collect();
        owing.sort_by(|a, b| b.1.total_cmp(&a.1));
        // The last ones may keep what is little together.
        let mut kept_back = 0.0;
        while let Some(&(_, power)) = owing.last()
            && kept_back + power <= UNGATHERED * self.size.stop_power
        {
            kept_back += power;
            owing.pop();
        }
        let strong = owing.iter().any(|&(s, _)| self.sources[s as usize].strong);
        owing.retain(|&(s, _)| self.sources[s as usize].strong == strong);
        (!owing.is_empty()).then_some((owing, strong))
    }

    /// What a source has to send the elements: emitted and reflected radiosity.
    fn owed(&self, s: usize) -> (Vec3, DVec3) {
        let drawn = &self.sources[s];
        let emitted = match self.system.emission_is_shot(s) && !drawn.emission_gathered {
            true => self.system.emitted(s).as_vec3(),
            false => Vec3::ZERO,
        };
        let shot = self.system.shot(s);
        let reflected = shot - drawn.gathered;
        // What rounding to f32 has left is nothing.
        let rounding = f64::from(f32::EPSILON) * shot.abs();
        let reflected = DVec3::select(reflected.abs().cmpgt(rounding), reflected, DVec3::ZERO);
        (emitted, reflected)
    }

    fn owed_power(&self, s: usize) -> f64 {
        let drawn = &self.sources[s];
        let (emitted, reflected) = self.owed(s);
        let turned = match drawn.relief && !drawn.directed {
            true => UNEVEN * drawn.gathered.abs(),
            false => DVec3::ZERO,
        };
        let light = emitted.as_dvec3() + reflected.abs() + turned;
        self.system.area(s) * light.element_sum()
    }

    /// Solves the system, keeps the rows of a batch, and gathers by those that find no room.
    fn take_in(&mut self, on: On<'_>, made: Made, report: &mut Report) -> Result<()> {
        report.add_stages(made.stages);
        let mut loose = Vec::new();
        for row in made.rows {
            let s = row.source as usize;
            report.add(&row, self.sources[s].strong, self.sources[s].times > 0);
            let Factors::Kept(place) = row.factors else {
                unreachable!("a team keeps its rows");
            };
            let drawn = &mut self.sources[s];
            drawn.under_way = false;
            drawn.times += 1;
            if !self.system.is_drawn(s) {
                let coupling = CouplingRow::new(&row.coupling, row.scale);
                self.system.draw(s, Some(coupling));
            }
            match place.chunk < self.kept.chunk_count() {
                true => self.sources[s].row = Some(place),
                false => loose.extend(self.send(s, place, true)),
            }
        }
        self.gather(on, &loose, report)
    }

    /// What a source has to send through its row, which counts as sent from now on.
    fn send(&mut self, s: usize, row: KeptRow, by_direction: bool) -> Option<LitRow> {
        let (emitted, reflected) = self.owed(s);
        let sent = reflected.as_vec3();
        let drawn = &mut self.sources[s];
        let turns = drawn.relief && by_direction;
        if emitted == Vec3::ZERO && sent == Vec3::ZERO && !turns {
            return None;
        }
        // As it was rounded, so that nothing is lost.
        drawn.gathered += sent.as_dvec3();
        drawn.emission_gathered |= self.system.emission_is_shot(s);
        drawn.directed |= drawn.relief && drawn.times > 1;
        Some(LitRow {
            row,
            source: s as u32,
            emitted,
            reflected: sent,
        })
    }

    /// Sends what all sources owe through the rows that are kept; of those with a relief, `by_direction`,
    /// also what changes its direction alone.
    fn gather_kept(&mut self, on: On<'_>, by_direction: bool, report: &mut Report) -> Result<()> {
        let rows: Vec<LitRow> = (0..self.sources.len())
            .filter_map(|s| {
                let row = self.sources[s].row?;
                self.send(s, row, by_direction)
            })
            .collect();
        self.gather(on, &rows, report)
    }

    fn gather(&self, on: On<'_>, rows: &[LitRow], report: &mut Report) -> Result<()> {
        let start = Instant::now();
        self.gathering.run(self.lit(on), rows)?;
        report.gathered_rows += rows.len() as u64;
        report.seconds.gather += start.elapsed().as_secs_f64();
        Ok(())
    }

    fn lit<'a>(&'a self, on: On<'a>) -> Lit<'a> {
        Lit {
            scene: on.scene,
            state: on.state,
            kept: &self.kept,
            relief: on.relief,
        }
    }

    fn solve(&mut self, most: f64, report: &mut Report) {
        let start = Instant::now();
        self.system.solve(most);
        report.seconds.solve += start.elapsed().as_secs_f64();
    }

    /// Goes on from the light that the elements have.
    fn measure(&mut self, on: On<'_>) -> Result<()> {
        let reflected = self.gathering.measure(self.lit(on))?;
        let sent: Vec<DVec3> = self.sources.iter().map(|drawn| drawn.gathered).collect();
        self.system.measured(&reflected, &sent);
        Ok(())
    }

    /// Power that is in no element's light yet, nor bounced: the residual of the system, and what is owed
    /// to the elements by sources without rows, with its first bounce.
    pub fn unshot(&self) -> f64 {
        let loose = |s: &usize| self.system.is_drawn(*s) && self.sources[*s].row.is_none();
        let owed: f64 = (0..self.sources.len())
            .filter(loose)
            .map(|s| {
                let (emitted, reflected) = self.owed(s);
                let light = emitted.as_dvec3() + reflected.abs();
                2.0 * self.system.area(s) * light.element_sum()
            })
            .sum();
        self.system.unshot().all + owed
    }

    /// Unshot power by colour.
    pub fn unshot_by_colour(&self) -> DVec3 {
        let left = |s: usize| {
            let emitted = match self.system.emission_is_shot(s) {
                true => DVec3::ZERO,
                false => self.system.emitted(s),
            };
            let reflected = self.system.reflected(s) - self.system.shot(s);
            (emitted + reflected) * self.system.area(s)
        };
        (0..self.sources.len()).map(left).sum()
    }

    /// Where each source's row is kept.
    pub fn rows(&self) -> Vec<Option<KeptRow>> {
        self.sources.iter().map(|drawn| drawn.row).collect()
    }

    /// See [`super::Solver::draw`].
    pub fn draw_alone(&mut self, on: On<'_>, sources: &[u32]) -> Result<DrawnBatch> {
        let slots = self.size.slots;
        let kept = &self.kept;
        let team = Self::team(&mut self.team, on, &self.devices, &self.system, kept, slots)?;
        team.submit(Batch {
            sources: sources.to_vec(),
            strong: false,
        })?;
        let made = team.take(kept)?.expect("a batch was submitted");
        Ok(DrawnBatch {
            stages: made.stages,
            facing_away: made.rows.iter().map(|row| row.facing_away).collect(),
            counts: made.rows.iter().map(|row| row.counts.clone()).collect(),
            coupling: (made.rows.into_iter())
                .map(|row| row.coupling.iter().map(|word| word * row.scale).collect())
                .collect(),
            items: team.items()?,
            slots: team.slots(false) as u32,
        })
    }

    /// The team, which is made when it is first asked for.
    fn team<'a>(
        team: &'a mut Option<Team>,
        on: On<'_>,
        devices: &[Arc<Device>],
        system: &System,
        kept: &KeptRows,
        slots: u32,
    ) -> Result<&'a mut Team> {
        match team {
            Some(team) => Ok(team),
            none => {
                let meso = match &on.parts.elements.relief {
                    Some(relief) => meso_elements(on.parts.elements, relief),
                    None => Vec::new(),
                };
                let least = least_strong(&on.parts.sources.list, &on.settings.grouping);
                let parts = TeamParts {
                    settings: on.settings,
                    scene: on.parts,
                    targets: &system.targets.list,
                    meso: &meso,
                    strong: least > 0.0,
                    slots,
                };
                Ok(none.insert(Team::new(devices, parts, on.scene, kept)?))
            }
        }
    }

    /// The last rows that were gathered with their light, for comparison with the twins.
    pub fn gathered_slots(&self, count: usize) -> Result<Vec<crate::passes::types::Slot>> {
        self.gathering.slots(count)
    }
}
