//! Light from near sources part by part, in turns with what the rows bring.

use std::time::Instant;

use glam::DVec3;

use super::{MOST_SWEEPS, Phase, Spine, UNSOLVED};
use crate::error::Result;
use crate::mesh::sources::Source;
use crate::solver::ledger::Ledger;
use crate::solver::progress::Watch;
use crate::solver::{Problem, Report};

/// What a last sweep over near sources may change of an element's light, over the mean of all, as a
/// share of the residual.
const UNSETTLED: f64 = 0.01;

/// Of the unshot power that turns into what may be missing: what near sources may still move.
const UNMOVED: f64 = 0.2;

/// Times that light is brought and solved by turns, at most.
pub(super) const MOST_TURNS: usize = 24;

impl Spine {
    /// Brings the elements what all kept rows send, of those with a relief, `by_direction`, also
    /// what changes its direction alone, and what near sources send beyond their means. The power
    /// that the sources reflect more or less for it, internal units; none once `go_on` says no.
    pub fn bring(
        &mut self,
        on: &Problem,
        by_direction: bool,
        report: &mut Report,
        go_on: &mut dyn FnMut() -> bool,
    ) -> Result<Option<f64>> {
        let rows = self.kept_rows(|ledger, s, scale| ledger.to_send(s, scale, by_direction));
        if !self.gather(rows, report, go_on)? {
            return Ok(None);
        }
        if self.near.is_empty() || !std::mem::replace(&mut self.brought, false) {
            return Ok(Some(0.0));
        }
        let start = Instant::now();
        let [direct, indirect] = self.team.irradiance()?;
        let brought = direct.iter().zip(&indirect);
        let brought: Vec<DVec3> = brought.map(|(d, i)| d.as_dvec3() + i.as_dvec3()).collect();
        let sum: DVec3 = brought.iter().sum();
        let mean = sum.max_element() / brought.len() as f64;
        let most = UNSETTLED * on.settings.residual * mean;
        let sent = self.ledger.sent(on);
        self.near.solve(on, &brought, &sent, most);
        let to_relief = self.near.send_to_relief(on, &sent);
        self.team.near(to_relief)?;
        let moved = self.turn_near(on);
        report.seconds.near += start.elapsed().as_secs_f64();
        report.near.sweeps = self.near.sweeps;
        Ok(Some(moved))
    }

    /// Brings the elements what sources emit, after drawing those that were not, and nothing of what
    /// surfaces reflect. A near source sends evenly until its parts are solved.
    pub fn bring_emitted(&mut self, on: &Problem, report: &mut Report) -> Result<()> {
        self.ledger.system.release();
        loop {
            while self.ledger.lacks_emitters() {
                let Some(batch) = self.choose(on, Phase::First, report, None)? else {
                    break;
                };
                self.submit(batch)?;
            }
            if !self.take(on, Phase::First, report)? {
                break;
            }
        }
        let rows = self.kept_rows(Ledger::emitted_to_send);
        self.gather(rows, report, &mut || true)?;
        Ok(())
    }

    /// What the sources reflect of light from near ones, `[source]`.
    pub(super) fn reflected_near(&self, on: &Problem) -> Vec<DVec3> {
        let of = |source: &Source| match source.is_surface() {
            true => self.near.reflected(on, source),
            false => DVec3::ZERO,
        };
        on.sources.list.iter().map(of).collect()
    }

    /// Takes what the sources are to reflect of light from near ones for the next turn. The power
    /// by which what they do reflect is other than in this one.
    fn turn_near(&mut self, on: &Problem) -> f64 {
        let areas: Vec<f64> = on.sources.list.iter().map(|source| source.area).collect();
        let (before, found) = (self.ledger.system.near(), self.reflected_near(on));
        let apart = before.iter().zip(&found).zip(&areas);
        let moved = apart.map(|((a, b), area)| area * (*a - *b).abs().element_sum());
        let moved = moved.sum();
        // What has settled takes no step further.
        let next = match self.is_still(moved) {
            true => found,
            false => self.turns.next(before, found, &areas),
        };
        self.ledger.system.set_near(&next);
        moved
    }

    /// Whether so little power has moved that the solution has settled.
    fn is_still(&self, moved: f64) -> bool {
        moved <= UNMOVED * self.ledger.bound.stop_power()
    }

    /// Brings light and solves by turns, until what near sources send fits the rest, or the watch
    /// says stop.
    pub(super) fn settle(
        &mut self,
        on: &Problem,
        by_direction: bool,
        report: &mut Report,
        watch: &mut Watch<'_>,
    ) -> Result<()> {
        let mut turns = 0;
        self.turns.forget();
        while !self.is_settled(on, by_direction, report, watch)? && watch.stop.is_none() {
            turns += 1;
            if turns == MOST_TURNS {
                tracing::warn!("light between close surfaces does not settle");
                break;
            }
        }
        self.turns.forget();
        Ok(())
    }

    /// Brings light, and solves if what near sources send has moved the rest.
    pub(super) fn is_settled(
        &mut self,
        on: &Problem,
        by_direction: bool,
        report: &mut Report,
        watch: &mut Watch<'_>,
    ) -> Result<bool> {
        let mut go_on = self.looks(report, watch);
        let Some(moved) = self.bring(on, by_direction, report, &mut go_on)? else {
            return Ok(false);
        };
        let settled = self.is_still(moved);
        if !settled {
            let most = UNSOLVED * self.ledger.bound.stop_power();
            self.solve(most, MOST_SWEEPS, report);
        }
        Ok(settled)
    }
}
