//! How far a solution has come, and when it stops.

use std::time::{Duration, Instant};

use super::makers::RowKind;
use super::{Problem, StopReason};
use crate::mesh::sources::Source;

/// How far a solution has come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Update {
    /// Sources drawn so far.
    pub shots: u32,
    pub sources: u32,
    /// Unshot power as a share of all that was emitted.
    pub unshot_share: f64,
    /// Power that can still be missing, as a share of all that was emitted; none where a
    /// reflectance is 1.
    pub error_bound: Option<f64>,
    /// Whether sources are being drawn. Otherwise their light is brought to the elements; stopping
    /// there makes the next turn begin that again.
    pub draws: bool,
    /// Since the start of the solution.
    pub elapsed: Duration,
    /// An estimate, from how fast the bound has fallen lately.
    pub left: Option<Duration>,
}

/// Bounds the light that is missing by what is unshot.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    /// 1/(1 − ρ) for the largest reflectance ρ; none at ρ = 1.
    factor: Option<f64>,
    /// Emitted power, internal units.
    emitted: f64,
    /// Of all elements, internal units.
    area: f64,
    /// The bound at which the solution is done.
    residual: f64,
}

/// The rms of the light that undrawn sources fail to bring, over the mean of what is emitted, for a
/// residual of 1: they may stand close together.
const LOCAL: f64 = 10.0;

impl Bound {
    pub fn new(problem: &Problem) -> Self {
        let rho = f64::from(problem.elements.max_reflectance());
        let sources = problem.sources.list.iter();
        Self {
            factor: (rho < 1.0).then(|| 1.0 / (1.0 - rho)),
            emitted: sources.map(Source::emitted_power).sum(),
            area: problem.elements.area.iter().sum(),
            residual: problem.settings.residual,
        }
    }

    /// Unshot power as a share of what is emitted.
    pub fn share(&self, unshot: f64) -> f64 {
        match self.emitted > 0.0 {
            true => unshot / self.emitted,
            false => 0.0,
        }
    }

    /// What a unit of power that is sent can turn into at the elements: it arrives and is reflected
    /// again, 1 + ρ + ρ² + … = 1/(1 − ρ) times; at a reflectance of 1 as at 0.999.
    pub fn importance(&self) -> f64 {
        self.factor.unwrap_or(1e3)
    }

    /// Power that is missing at the elements, as a share of what is emitted: what unshot power can
    /// turn into; and a sum in f32 may lose half a step of what arrives, which lacks as many
    /// bounces.
    pub fn of(&self, missing: f64) -> Option<f64> {
        let rounding = f64::from(f32::EPSILON) / 2.0;
        (self.factor).map(|factor| self.share(missing) + rounding * factor * factor)
    }

    /// Missing power at which the solution is done, internal units; rounding apart.
    pub fn most_missing(&self) -> f64 {
        self.residual * self.emitted
    }

    /// Unshot power that turns into so much, at most.
    pub fn stop_power(&self) -> f64 {
        self.most_missing() / self.importance()
    }

    /// What undrawn sources may have of area times unshot radiosity squared, summed over the
    /// colours. With form factors F_es from an element, ∫ (Σ_s F_es b_s)² ≤ Σ_s A_s b_s², since
    /// Σ_s F_es ≤ 1 (Jensen) and A_e F_es = A_s F_se.
    pub fn most_squared(&self) -> f64 {
        (LOCAL * self.residual * self.emitted).powi(2) / (3.0 * self.area)
    }
}

/// How long sources take to be drawn, so that no more are begun than a budget has time for.
#[derive(Debug, Default)]
pub(super) struct Pace {
    /// When the oldest batch under way was the only one.
    since: Option<Instant>,
    /// Seconds a source, of the kind that was drawn last.
    source: Option<(RowKind, f64)>,
}

/// Sources times elements that are begun before it is known how long they take, at most.
const UNKNOWN_PAIRS: usize = 1 << 20;

impl Pace {
    /// A batch has begun.
    pub fn begin(&mut self) {
        self.since.get_or_insert_with(Instant::now);
    }

    /// The oldest batch has ended, with so many sources `drawn`. `under_way`: there are others.
    pub fn end(&mut self, kind: RowKind, drawn: usize, under_way: bool) {
        if let Some(since) = self.since.take().filter(|_| drawn > 0) {
            let seconds = since.elapsed().as_secs_f64();
            self.source = Some((kind, seconds / drawn as f64));
        }
        self.since = under_way.then(Instant::now);
    }

    /// Sources that can begin and end in the time that is left, beside those `under_way`; one at
    /// least where there are none.
    pub fn fitting(
        &self,
        kind: RowKind,
        left: Duration,
        under_way: usize,
        elements: usize,
    ) -> usize {
        let known = self.source.filter(|(of, _)| *of == kind);
        let most = match known {
            Some((_, seconds)) => (left.as_secs_f64() / seconds) as usize,
            None => UNKNOWN_PAIRS / elements.max(1),
        };
        let least = usize::from(under_way == 0);
        most.saturating_sub(under_way).max(least)
    }
}

/// Asks after every batch whether to go on.
pub(super) struct Watch<'a> {
    start: Instant,
    budget: Duration,
    bound: Bound,
    sources: u32,
    history: Vec<(f64, f64)>,
    go_on: &'a mut dyn FnMut(&Update) -> bool,
    /// Why to stop, once it is to stop.
    pub stop: Option<StopReason>,
}

impl<'a> Watch<'a> {
    pub fn new(problem: &Problem, bound: Bound, go_on: &'a mut dyn FnMut(&Update) -> bool) -> Self {
        Self {
            start: Instant::now(),
            budget: problem.settings.budget.unwrap_or(Duration::MAX),
            bound,
            sources: problem.sources.list.len() as u32,
            history: Vec::new(),
            go_on,
            stop: None,
        }
    }

    /// Whether to go on with so many sources drawn and so much power unshot and missing, internal
    /// units.
    pub fn look(&mut self, shots: u32, unshot: f64, missing: f64) -> bool {
        let now = (
            self.start.elapsed().as_secs_f64(),
            self.bound.share(missing),
        );
        self.history.push(now);
        self.ask(shots, unshot, missing, true)
    }

    /// Of the budget; none without one.
    pub fn left(&self) -> Option<Duration> {
        (self.budget != Duration::MAX).then(|| self.budget.saturating_sub(self.start.elapsed()))
    }

    /// As [`Self::look`], again and again during work that draws nothing.
    pub fn looks(&mut self, shots: u32, unshot: f64, missing: f64) -> impl FnMut() -> bool {
        move || self.ask(shots, unshot, missing, false)
    }

    fn ask(&mut self, shots: u32, unshot: f64, missing: f64, draws: bool) -> bool {
        if self.stop.is_some() {
            return false;
        }
        let elapsed = self.start.elapsed();
        let update = Update {
            shots,
            sources: self.sources,
            unshot_share: self.bound.share(unshot),
            error_bound: self.bound.of(missing),
            draws,
            elapsed,
            left: time_left(&self.history, self.bound.residual),
        };
        if !(self.go_on)(&update) {
            self.stop = Some(StopReason::Interrupted);
        } else if elapsed >= self.budget {
            self.stop = Some(StopReason::Budget);
        }
        self.stop.is_none()
    }
}

/// Time until the missing share falls to `target`, if it goes on falling as over the last half of
/// the run.
fn time_left(history: &[(f64, f64)], target: f64) -> Option<Duration> {
    let &(now, share) = history.last()?;
    let &(then, share_then) = history.get(history.len() / 2)?;
    if share <= 0.0 || share >= share_then || now <= then {
        return None;
    }
    let rate = (share_then / share).ln() / (now - then);
    let left = ((share / target).ln() / rate).max(0.0);
    (left.is_finite() && left < 1e6).then(|| Duration::from_secs_f64(left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_more_is_begun_than_there_is_time_for() {
        let mut pace = Pace::default();
        let fitting = |pace: &Pace, kind, seconds, under_way| {
            pace.fitting(kind, Duration::from_secs(seconds), under_way, 1 << 18)
        };
        // Of an unknown pace 2²⁰ pairs.
        assert_eq!(fitting(&pace, RowKind::Common, 100, 0), 4);
        assert_eq!(fitting(&pace, RowKind::Common, 100, 4), 0);
        pace.source = Some((RowKind::Common, 3.0));
        assert_eq!(fitting(&pace, RowKind::Common, 100, 0), 33);
        assert_eq!(fitting(&pace, RowKind::Common, 100, 20), 13);
        assert_eq!(fitting(&pace, RowKind::Common, 2, 0), 1);
        assert_eq!(fitting(&pace, RowKind::Common, 2, 1), 0);
        assert_eq!(fitting(&pace, RowKind::Strong, 100, 0), 4);
        // What was recorded says nothing of it.
        pace.begin();
        pace.end(RowKind::Common, 0, false);
        assert_eq!(fitting(&pace, RowKind::Common, 100, 0), 33);
        pace.begin();
        pace.end(RowKind::Common, 5, false);
        assert!(fitting(&pace, RowKind::Common, 100, 0) > 33);
    }
}
