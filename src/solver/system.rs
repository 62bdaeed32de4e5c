//! Radiosity of the sources: B_t = M_t + Σ_s G[s,t] B_s, solved by Gauss–Seidel in f64 among the
//! sources whose coupling is known.
//!
//! The iteration is kept in its shooting form (Gortler et al. 1994): each source has shot part of
//! its radiosity through its row, and what it has not shot is the residual of its equation. So rows
//! can join at any time, and the sum of what is unshot bounds what is missing.

use glam::DVec3;

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
    drawn: bool,
    row: Option<CouplingRow>,
    emission_shot: bool,
    /// Reflected radiosity that has been shot.
    shot: DVec3,
    /// Reflected radiosity that has not arrived by coupling, but was measured.
    measured: DVec3,
    /// Power that arrives at elements in the end for a unit of power that is sent, by colour, at most.
    importance: DVec3,
}

/// Sums of unshot power, internal units, over the colours.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Unshot {
    /// Of the sources that are not drawn, emission included.
    pub undrawn: f64,
    /// Of all sources: the residual of the system.
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
            drawn: false,
            row: None,
            emission_shot: false,
            shot: DVec3::ZERO,
            measured: DVec3::ZERO,
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
        self.sources[s].measured + self.arrived.reflected(&self.targets, s)
    }

    /// Unshot power of a source, and of it what is emitted.
    pub fn unshot_power(&self, s: usize) -> (f64, f64) {
        let source = &self.sources[s];
        let emitted = match source.emission_shot {
            true => 0.0,
            false => source.emitted_power,
        };
        let reflected = (self.reflected(s) - source.shot).abs().element_sum() * source.area;
        (emitted + reflected, emitted)
    }

    pub fn unshot(&self) -> Unshot {
        let mut sums = Unshot::default();
        for s in 0..self.sources.len() {
            let power = self.unshot_power(s).0;
            sums.all += power;
            if !self.sources[s].drawn {
                sums.undrawn += power;
            }
        }
        sums
    }

    /// Lowers the importance of each source to what its row says: v_s = 1 + Σ_t A_t G[s,t] v_t / A_s,
    /// the adjoint of the system. Where the light of a source without a row goes follows from the
    /// rows of others by reciprocity; the rest may go to whatever counts most. The iteration starts
    /// from above and falls, so that it can stop at any time.
    pub fn weigh(&mut self) {
        let mut brought = Arrived::none(&self.targets);
        let mut shares = Arrived::none(&self.targets);
        let mut most = DVec3::ZERO;
        for (s, source) in self.sources.iter().enumerate() {
            let counts = self.targets.reflectance(s) * source.importance;
            most = most.max(counts);
            if let Some(row) = &source.row {
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

    /// Power that is missing at the elements for what a source has not shot, at most.
    pub fn missing(&self, s: usize) -> f64 {
        let source = &self.sources[s];
        let emitted = match source.emission_shot {
            true => DVec3::ZERO,
            false => source.emitted,
        };
        let unshot = emitted + (self.reflected(s) - source.shot).abs();
        source.area * unshot.dot(source.importance)
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
        let Some(row) = row else { return };
        self.arrived.add(&row, emitted + reflected);
        // Without room the row is forgotten.
        if self.bytes + row.bytes() <= self.memory {
            self.bytes += row.bytes();
            self.sources[s].row = Some(row);
        }
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

    /// Unshot power of the sources with rows.
    fn left(&self) -> f64 {
        (0..self.sources.len())
            .filter(|&s| self.sources[s].row.is_some())
            .map(|s| self.unshot_power(s).0)
            .sum()
    }

    /// Every source with a row shoots what it has, unless that is less than `least`.
    fn sweep(&mut self, least: f64) {
        self.sweeps += 1;
        for s in 0..self.sources.len() {
            let reflected = self.reflected(s);
            let source = &mut self.sources[s];
            let Some(row) = &source.row else { continue };
            let unshot = reflected - source.shot;
            if unshot.abs().element_sum() * source.area > 0.5 * least {
                source.shot = reflected;
                self.arrived.add(row, unshot);
            }
        }
    }

    /// Scales what the sources with rows have shot, by colour, so that what they have left sums to
    /// none: where little is lost at a bounce, that is the error which sweeps are slow to remove.
    fn shift(&mut self) {
        let mut through = Arrived::none(&self.targets);
        for source in &self.sources {
            if let Some(row) = &source.row {
                through.add(row, source.shot);
            }
        }
        let (mut shot, mut unshot, mut lost) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        for s in 0..self.sources.len() {
            let source = &self.sources[s];
            if source.row.is_some() {
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
        for source in &mut self.sources {
            if source.row.is_some() {
                source.shot += source.shot * share;
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
            source.shot = sent;
        }
    }

    /// Sources that were drawn and have no row shoot what they have: measuring will find what
    /// arrived.
    pub fn shoot_unknown(&mut self) {
        for s in 0..self.sources.len() {
            let reflected = self.reflected(s);
            let source = &mut self.sources[s];
            if source.drawn && source.row.is_none() {
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
mod tests {
    use glam::DVec3;
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::mesh::elements::Elements;
    use crate::mesh::sources::{self, Grouping};
    use crate::scene::shapes::Shapes;

    /// A closed room whose sources exchange light at random, so that all that is sent arrives.
    struct Room {
        elements: Elements,
        sources: Vec<Source>,
        /// Form factors times areas over the target's area, `[source][target]`.
        coupling: Vec<Vec<f64>>,
    }

    const SCALINGS: usize = 60;

    /// Half of the elements are coloured, in turns where `mixed`.
    fn room(white: f32, mixed: bool) -> Room {
        let mut shapes = Shapes::new();
        shapes.room(DVec3::ZERO, DVec3::ONE, 12, 0);
        let mut elements = Elements::new(&shapes.scene);
        for e in 0..elements.len() {
            let coloured = if mixed {
                e % 2 == 1
            } else {
                e >= elements.len() / 2
            };
            elements.reflectance[e] = match coloured {
                true => glam::Vec3::new(white, 0.5, 0.1),
                false => glam::Vec3::splat(white),
            };
            // So evenly that no element is cut into several sources.
            elements.emitted[e] = glam::Vec3::new(1.0, 2.0, 3.0) * (1 + e % 2) as f32;
        }
        let (sources, _) = sources::build(&mut elements, &[], &Grouping::default(), 0);
        let list = sources.list;
        let mut state = 1_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 40) as f64 / (1 << 24) as f64
        };
        // Symmetric weights, scaled until all that each source sends arrives.
        let mut pairs = DMatrix::from_fn(list.len(), list.len(), |_, _| random());
        pairs = &pairs + pairs.transpose();
        let mut scale = vec![1.0; list.len()];
        for _ in 0..SCALINGS {
            for s in 0..list.len() {
                let sent: f64 = (0..list.len()).map(|t| pairs[(s, t)] * scale[t]).sum();
                scale[s] = f64::sqrt(scale[s] * list[s].area / sent);
            }
        }
        let share = |s: usize, t: usize| scale[s] * pairs[(s, t)] * scale[t] / list[t].area;
        let coupling = (0..list.len())
            .map(|s| (0..list.len()).map(|t| share(s, t)).collect())
            .collect();
        Room {
            elements,
            sources: list,
            coupling,
        }
    }

    fn system(room: &Room, memory: u64) -> System {
        let mut system = undrawn(room, memory, 1e3);
        draw(room, &mut system, 1);
        system
    }

    fn undrawn(room: &Room, memory: u64, importance: f64) -> System {
        let targets = Targets::new(&room.elements, &room.sources);
        System::new(targets, &room.sources, memory, importance)
    }

    /// Draws one source in `every`.
    fn draw(room: &Room, system: &mut System, every: usize) {
        let all = (0..room.sources.len()).step_by(every);
        for s in all.filter(|&s| !system.is_drawn(s)).collect::<Vec<_>>() {
            let words = words(room, system, s);
            system.draw(s, Some(CouplingRow::new(&words, 1.0)));
        }
    }

    /// What the coupling pass would write.
    fn words(room: &Room, system: &System, s: usize) -> Vec<f32> {
        let even = room.elements.even_reflectance();
        let mut words = vec![0.0; system.targets.words()];
        for target in &system.targets.list {
            let t = (room.sources.iter())
                .position(|t| t.first_element == target.first_element)
                .expect("a target is a source");
            let g = room.coupling[s][t];
            let at = target.first_word as usize;
            match target.word_count {
                1 => words[at] = g as f32,
                _ => {
                    let mean = mean_reflectance(room, &even, t);
                    (0..3).for_each(|c| words[at + c] = (g * mean[c]) as f32);
                }
            }
        }
        words
    }

    fn mean_reflectance(room: &Room, even: &[glam::Vec3], t: usize) -> DVec3 {
        let source = &room.sources[t];
        let first = source.first_element as usize;
        let members = first..first + source.element_count as usize;
        let area: f64 = members.clone().map(|e| room.elements.area[e]).sum();
        let of = |e: usize| even[e].as_dvec3() * (room.elements.area[e] / area);
        members.map(of).sum()
    }

    /// I − Gᵀ of one colour, `[target][source]`.
    fn matrix(room: &Room, colour: usize) -> DMatrix<f64> {
        let even = room.elements.even_reflectance();
        let n = room.sources.len();
        DMatrix::from_fn(n, n, |t, s| {
            let here = f64::from(u8::from(s == t));
            here - room.coupling[s][t] * mean_reflectance(room, &even, t)[colour]
        })
    }

    /// B = M + Gᵀ B of one colour, by LU.
    fn exact(room: &Room, colour: usize) -> DVector<f64> {
        let emitted = (room.sources.iter()).map(|s| f64::from(s.emitted[colour]));
        let emitted = DVector::from_iterator(room.sources.len(), emitted);
        (matrix(room, colour).lu())
            .solve(&emitted)
            .expect("light is lost at each bounce")
    }

    /// Power that arrives in the end for a unit of power sent, of one colour, by LU: what arrives
    /// at once is what is sent.
    fn exact_importance(room: &Room, colour: usize) -> DVector<f64> {
        let areas = DVector::from_iterator(room.sources.len(), room.sources.iter().map(|s| s.area));
        let weights = (matrix(room, colour).transpose().lu())
            .solve(&areas)
            .expect("light is lost at each bounce");
        weights.component_div(&areas)
    }

    /// Largest ratio of a source's importance to the exact one of each colour, and the smallest.
    fn importance_ratios(system: &System, exact: &[DVector<f64>]) -> (f64, f64) {
        let mut ratios = (0.0_f64, f64::INFINITY);
        for (c, exact) in exact.iter().enumerate() {
            for s in 0..exact.len() {
                let ratio = system.importance(s)[c] / exact[s];
                ratios = (ratios.0.max(ratio), ratios.1.min(ratio));
            }
        }
        ratios
    }

    /// Also where next to nothing is lost at a bounce, and sweeps alone would take thousands.
    #[test]
    fn sweeps_give_the_exact_solution() {
        // Coupling is kept in f32, and a loss of 1/1000 magnifies its rounding. Measured: 13 and 16
        // sweeps, 3.3e-9 and 2.6e-8.
        for (white, mixed, most_sweeps, tolerance) in [
            (0.7, false, 26, 7e-9),
            (0.7, true, 26, 7e-9),
            (0.999, false, 32, 6e-8),
            (0.999, true, 32, 6e-8),
        ] {
            let room = room(white, mixed);
            let mut system = system(&room, u64::MAX);
            assert_eq!(system.targets.list.iter().any(|t| t.word_count == 3), mixed);
            assert!(system.is_whole());
            let emitted: f64 = room.sources.iter().map(Source::emitted_power).sum();
            assert!(system.solve(1e-10 * emitted, 100));
            assert!(system.unshot().all <= 1e-10 * emitted);
            let apart = (0..3).map(|c| {
                let exact = exact(&room, c);
                let found = |s: usize| system.emitted(s)[c] + system.reflected(s)[c];
                let errors = (0..exact.len()).map(|s| (found(s) / exact[s] - 1.0).abs());
                errors.fold(0.0, f64::max)
            });
            let apart = apart.fold(0.0, f64::max);
            println!(
                "{white}, mixed {mixed}: {} sweeps, {apart:.1e}",
                system.sweeps
            );
            assert!(system.sweeps <= most_sweeps && apart <= tolerance);
        }
    }

    /// A bound from the first weighing on, and exact once all rows are known.
    #[test]
    fn importance_falls_to_the_exact_one() {
        for mixed in [false, true] {
            let room = room(0.7, mixed);
            let mut system = undrawn(&room, u64::MAX, 1.0 / (1.0 - 0.7));
            let exact: Vec<_> = (0..3).map(|c| exact_importance(&room, c)).collect();
            let mut last = f64::INFINITY;
            for (every, weighings) in [(7, 1), (7, 50), (2, 50), (1, 50)] {
                draw(&room, &mut system, every);
                (0..weighings).for_each(|_| system.weigh());
                let (most, least) = importance_ratios(&system, &exact);
                println!("mixed {mixed}, one in {every}: {most:.6} to {least:.9}");
                assert!(least >= 1.0 - 1e-6 && most <= last);
                last = most;
            }
            assert!(last <= 1.0 + 1e-6, "{last}");
        }
    }

    /// Rows beyond the memory shoot once, when they are drawn, and count as unshot after that.
    #[test]
    fn rows_beyond_the_memory_are_forgotten() {
        let room = room(0.7, false);
        let half = system(&room, u64::MAX).bytes() / 2;
        let mut system = system(&room, half);
        assert!(!system.is_whole() && system.bytes() <= half);
        assert!(system.solve(0.0, 10) || system.unshot().all > 0.0);
        let known = system.rows().filter(Option::is_some).count();
        assert!(known > 0 && known < room.sources.len());
        system.shoot_unknown();
        let measured: Vec<DVec3> = (0..room.sources.len())
            .map(|s| system.reflected(s))
            .collect();
        let sent: Vec<DVec3> = (0..room.sources.len()).map(|s| system.shot(s)).collect();
        system.measured(&measured, &sent);
        assert!(system.reflected(0).distance(measured[0]) == 0.0);
    }
}
