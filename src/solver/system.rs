//! Radiosity of the sources: B_t = M_t + Σ_s G[s,t] B_s, solved by Gauss–Seidel in f64 among the
//! sources whose coupling is known.
//!
//! The iteration is kept in its shooting form (Gortler et al. 1994): each source has shot part of
//! its radiosity through its row, and what it has not shot is the residual of its equation. So rows
//! can join at any time, and the sum of what is unshot bounds what is missing.

mod carrying;

use glam::DVec3;

pub(super) use carrying::Carrier;

use super::coupling::{Arrived, CouplingRow, Targets, Weights};
use crate::constants::KIND_POINT;
use crate::mesh::sources::Source;

/// The sources of a scene as unknowns.
pub(super) struct System {
    pub targets: Targets,
    sources: Vec<Unknown>,
    arrived: Arrived,
    /// Bytes that coupling rows may take, and take.
    memory: u64,
    bytes: u64,
    /// Gauss–Seidel sweeps so far.
    pub sweeps: u64,
    weights: Weights,
}

struct Unknown {
    emitted: DVec3,
    emitted_power: f64,
    /// That radiosity is multiplied by for power: a surface's area, half the sphere of a point
    /// light.
    area: f64,
    /// It has elements, so that its row also says what they see of it.
    is_surface: bool,
    drawn: bool,
    row: Option<CouplingRow>,
    /// Of a source that was not drawn, see [`System::carry`].
    carrier: Option<Carrier>,
    /// Radiosity that its row carries for others.
    carried: DVec3,
    emission_shot: bool,
    /// Reflected radiosity that has been shot.
    shot: DVec3,
    /// Reflected radiosity that has not arrived by coupling, but was measured.
    measured: DVec3,
    /// Reflected radiosity beside that of the rows: of light from near sources.
    near: DVec3,
    /// Radiosity that has been shot, but neither arrived by coupling nor was measured yet.
    unmeasured: DVec3,
    /// Power that arrives at elements in the end for a unit of power that is sent, at most; RGB.
    importance: DVec3,
}

impl Unknown {
    /// What it has shot through a row of its own.
    fn shot_itself(&self) -> DVec3 {
        match self.carrier {
            Some(_) => DVec3::ZERO,
            None => self.shot,
        }
    }
}

/// Sums of unshot power, internal units, over the colours.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Unshot {
    /// Of the sources that are not drawn, emission included.
    pub undrawn: f64,
    /// Of all sources: the residual of the system, and what was shot without being measured.
    pub all: f64,
}

impl System {
    /// `importance`: what a unit of power that is sent can turn into at most, anywhere.
    pub fn new(targets: Targets, sources: &[Source], memory: u64, importance: f64) -> Self {
        let unknown = |source: &Source| Unknown {
            emitted: source.emitted.as_dvec3(),
            emitted_power: source.emitted_power(),
            area: match source.kind {
                KIND_POINT => std::f64::consts::TAU,
                _ => source.area,
            },
            is_surface: source.is_surface(),
            drawn: false,
            row: None,
            carrier: None,
            carried: DVec3::ZERO,
            emission_shot: false,
            shot: DVec3::ZERO,
            measured: DVec3::ZERO,
            near: DVec3::ZERO,
            unmeasured: DVec3::ZERO,
            importance: DVec3::splat(importance),
        };
        let mut weights = Weights::none(&targets);
        let areas = sources.iter().map(|source| source.area);
        for (t, area) in areas.enumerate() {
            weights.set(&targets, t, DVec3::splat(area * importance));
        }
        Self {
            arrived: Arrived::none(&targets),
            weights,
            targets,
            sources: sources.iter().map(unknown).collect(),
            memory,
            bytes: 0,
            sweeps: 0,
        }
    }

    pub fn is_drawn(&self, s: usize) -> bool {
        self.sources[s].drawn
    }

    pub fn emitted(&self, s: usize) -> DVec3 {
        self.sources[s].emitted
    }

    /// What radiosity is multiplied by for power: a surface's area, half the sphere of a point
    /// light.
    pub fn area(&self, s: usize) -> f64 {
        self.sources[s].area
    }

    /// Radiosity that a source reflects, as far as it is known.
    pub fn reflected(&self, s: usize) -> DVec3 {
        let source = &self.sources[s];
        source.measured + source.near + self.arrived.reflected(&self.targets, s)
    }

    /// Unshot power of a source, and of it what is emitted.
    pub fn unshot_power(&self, s: usize) -> (f64, f64) {
        let source = &self.sources[s];
        let emitted = match source.emission_shot {
            true => 0.0,
            false => source.emitted_power,
        };
        let unshot = self.reflected(s) - source.shot_itself();
        (emitted + unshot.abs().element_sum() * source.area, emitted)
    }

    pub fn unshot(&self) -> Unshot {
        let mut sums = Unshot::default();
        for s in 0..self.sources.len() {
            let source = &self.sources[s];
            let power = self.unshot_power(s).0;
            sums.all += power + source.area * source.unmeasured.element_sum();
            if !source.drawn {
                sums.undrawn += power;
            }
        }
        sums
    }

    /// Lowers the importance of each source to what its row says, by the adjoint of the system:
    /// v_s = 1 + Σ_t A_t G[s,t] v_t / A_s. Where the light of a source without a row goes follows
    /// from the rows of others by reciprocity; the rest may go to whatever counts most. The
    /// iteration starts from above and falls, so that it can stop at any time.
    pub fn weigh(&mut self) {
        let mut brought = Arrived::none(&self.targets);
        let mut shares = Arrived::none(&self.targets);
        let mut most = DVec3::ZERO;
        for (s, source) in self.sources.iter().enumerate() {
            let counts = self.targets.reflectance(s) * source.importance;
            most = most.max(counts);
            if let Some(row) = source.row.as_ref().filter(|_| source.is_surface) {
                brought.add(row, counts);
                shares.add(row, DVec3::ONE);
            }
        }
        for s in 0..self.sources.len() {
            let source = &mut self.sources[s];
            let known = |arrived: &Arrived| arrived.irradiance(&self.targets, s);
            let brought = match (&source.row, known(&brought), known(&shares)) {
                (Some(row), ..) => self.weights.of_row(row) / source.area,
                (None, Some(brought), Some(shares)) => {
                    brought + most * (DVec3::ONE - shares).max(DVec3::ZERO)
                }
                _ => most,
            };
            source.importance = source.importance.min(DVec3::ONE + brought);
            let weight = source.importance * source.area;
            self.weights.set(&self.targets, s, weight);
        }
    }

    /// Radiosity that a source has not shot.
    fn unshot_radiosity(&self, s: usize) -> DVec3 {
        let source = &self.sources[s];
        let emitted = match source.emission_shot {
            true => DVec3::ZERO,
            false => source.emitted,
        };
        emitted + (self.reflected(s) - source.shot_itself()).abs()
    }

    /// Power that is missing at the elements for what a source has not shot, or has shot without
    /// being measured, at most.
    pub fn missing(&self, s: usize) -> f64 {
        let source = &self.sources[s];
        let bounces = source.unmeasured.dot(source.importance - DVec3::ONE);
        source.area * (self.unshot_radiosity(s).dot(source.importance) + bounces)
    }

    /// Area times unshot radiosity squared, summed over the colours.
    pub fn unshot_squared(&self, s: usize) -> f64 {
        self.sources[s].area * self.unshot_radiosity(s).length_squared()
    }

    /// What a unit of power from a source can turn into at the elements, at most, by colour.
    pub fn importance(&self, s: usize) -> DVec3 {
        self.sources[s].importance
    }

    /// Takes in the row of a source that has been drawn, and shoots all that it has. What a source
    /// without a row sends is found by measuring.
    pub fn draw(&mut self, s: usize, row: Option<CouplingRow>) {
        self.sources[s].drawn = true;
        let emitted = match std::mem::replace(&mut self.sources[s].emission_shot, true) {
            true => DVec3::ZERO,
            false => self.sources[s].emitted,
        };
        let reflected = self.reflected(s) - self.sources[s].shot;
        self.sources[s].shot += reflected;
        let Some(row) = row else {
            self.sources[s].unmeasured += emitted + reflected.abs();
            return;
        };
        self.arrived.add(&row, emitted + reflected);
        // Without room the row is forgotten.
        if self.bytes + row.bytes() <= self.memory {
            self.bytes += row.bytes();
            self.sources[s].row = Some(row);
        }
    }

    /// Whether its coupling is known.
    pub fn has_row(&self, s: usize) -> bool {
        self.sources[s].row.is_some()
    }

    /// Shoots what a source has through its row, or through that of its carrier.
    fn shoot(&mut self, s: usize) {
        let reflected = self.reflected(s);
        let unshot = reflected - self.sources[s].shot;
        let through = self.through(s);
        let Some(row) = &self.sources[through.source].row else {
            return;
        };
        self.arrived.add(row, through.share * unshot);
        self.sources[s].shot = reflected;
        if through.source != s {
            self.sources[through.source].carried += through.share * unshot;
        }
    }

    /// The row of a source, which is not known any more.
    pub fn take_row(&mut self, s: usize) -> Option<CouplingRow> {
        self.sources[s].row.take()
    }

    /// Rows that are known, `[source]`.
    pub fn rows(&self) -> impl Iterator<Item = Option<&CouplingRow>> {
        self.sources.iter().map(|source| source.row.as_ref())
    }

    /// Bytes of the coupling rows.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Whether every drawn source has its row.
    pub fn is_whole(&self) -> bool {
        (self.sources.iter()).all(|source| !source.drawn || source.row.is_some())
    }

    /// Sweeps, so many times at most, until the sources with rows have no more than `most` unshot
    /// together, internal units. Whether they have.
    pub fn solve(&mut self, most: f64, sweeps: usize) -> bool {
        let mut left = self.left();
        for _ in 0..sweeps {
            if left <= most {
                return true;
            }
            let before = left;
            self.sweep(most / self.sources.len() as f64);
            left = self.left();
            if left > SLOW * before {
                self.shift();
                left = self.left();
            }
        }
        left <= most
    }

    /// Power that the sources which shoot through rows have not shot.
    fn left(&self) -> f64 {
        let left = |s: usize| {
            let emitted = match self.sources[s].emission_shot {
                true => 0.0,
                false => self.sources[s].emitted_power,
            };
            let reflected = (self.reflected(s) - self.sources[s].shot).abs();
            let carried = self.sources[s].carrier.is_some();
            reflected.element_sum() * self.sources[s].area + if carried { 0.0 } else { emitted }
        };
        (0..self.sources.len())
            .filter(|&s| self.has_way(s))
            .map(left)
            .sum()
    }

    /// Every source with a row shoots what it has, unless that is less than `least`.
    fn sweep(&mut self, least: f64) {
        self.sweeps += 1;
        for s in 0..self.sources.len() {
            if !self.has_way(s) {
                continue;
            }
            let source = &self.sources[s];
            let unshot = self.reflected(s) - source.shot;
            if unshot.abs().element_sum() * source.area > 0.5 * least {
                self.shoot(s);
            }
        }
    }

    /// Scales what the sources with rows have shot, by colour, so that what they have left sums to
    /// none: where little is lost at a bounce, that is the error which sweeps are slow to remove.
    fn shift(&mut self) {
        let mut through = Arrived::none(&self.targets);
        for source in &self.sources {
            if let Some(row) = &source.row {
                through.add(row, source.shot + source.carried);
            }
        }
        let (mut shot, mut unshot, mut lost) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for s in 0..self.sources.len() {
            let source = &self.sources[s];
            if self.has_way(s) {
                shot += source.shot * source.area;
                unshot += (self.reflected(s) - source.shot) * source.area;
                lost += (source.shot - through.reflected(&self.targets, s)) * source.area;
            }
        }
        let share = |c: usize| match lost[c] > LEAST_LOST * shot[c].abs() {
            true => unshot[c] / lost[c],
            false => 0.0,
        };
        let share = DVec3::new(share(0), share(1), share(2));
        self.arrived.add_scaled(&through, share);
        for s in 0..self.sources.len() {
            if self.has_way(s) {
                let source = &mut self.sources[s];
                source.shot += source.shot * share;
                source.carried += source.carried * share;
            }
        }
    }

    /// Goes on from light that was gathered: what each source reflects of it, and what it has sent.
    pub fn measured(&mut self, reflected: &[DVec3], sent: &[DVec3]) {
        self.arrived = Arrived::none(&self.targets);
        for (source, (&reflected, &sent)) in
            (self.sources.iter_mut()).zip(reflected.iter().zip(sent))
        {
            source.measured = reflected;
            source.unmeasured = DVec3::ZERO;
            if source.carrier.is_none() {
                source.shot = sent - source.carried;
            }
        }
    }

    /// The reflected radiosity of each source beside that of the rows, `[source]`.
    pub fn near(&self) -> Vec<DVec3> {
        self.sources.iter().map(|source| source.near).collect()
    }

    /// See [`Self::near`].
    pub fn set_near(&mut self, reflected: &[DVec3]) {
        for (source, near) in self.sources.iter_mut().zip(reflected) {
            source.near = *near;
        }
    }

    /// Sources that were drawn and have no row shoot what they have: measuring will find what
    /// arrived.
    pub fn shoot_unknown(&mut self) {
        for s in 0..self.sources.len() {
            let reflected = self.reflected(s);
            let source = &mut self.sources[s];
            if source.drawn && source.row.is_none() {
                source.unmeasured += (reflected - source.shot).abs();
                source.shot = reflected;
            }
        }
    }

    /// Reflected radiosity that a source has shot.
    pub fn shot(&self, s: usize) -> DVec3 {
        self.sources[s].shot
    }

    /// Whether a source has shot its emission.
    pub fn emission_is_shot(&self, s: usize) -> bool {
        self.sources[s].emission_shot
    }
}

/// A sweep that leaves more than this share is followed by a shift.
const SLOW: f64 = 0.3;

/// Where a smaller share than this is lost at a bounce, rounding says how much: nothing is shifted.
const LEAST_LOST: f64 = 1e-6;

#[cfg(test)]
mod tests;
