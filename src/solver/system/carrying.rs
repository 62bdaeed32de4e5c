//! Light of sources without rows, which the rows of others carry.

use glam::DVec3;

use super::System;

/// A source whose row carries the light of one without a row.
#[derive(Debug, Clone, Copy)]
pub(in crate::solver) struct Carrier {
    pub source: usize,
    /// Radiosity of the carrier for a unit of radiosity that it carries: the areas' ratio.
    pub share: f64,
}

impl System {
    /// Lets the row of another source carry what a source without a row reflects. For the error
    /// bound that light stays unshot: it may arrive elsewhere than it should.
    pub fn carry(&mut self, s: usize, carrier: Carrier) {
        self.sources[s].carrier = Some(carrier);
        self.shoot(s);
    }

    /// Takes back what rows of other sources have carried.
    pub fn release(&mut self) {
        for s in 0..self.sources.len() {
            let source = &mut self.sources[s];
            source.carried = DVec3::ZERO;
            let Some(carrier) = source.carrier.take() else {
                continue;
            };
            let back = -carrier.share * std::mem::take(&mut source.shot);
            if let Some(row) = &self.sources[carrier.source].row {
                self.arrived.add(row, back);
            }
        }
    }

    /// Radiosity that the row of a source carries for others.
    pub fn carried(&self, s: usize) -> DVec3 {
        self.sources[s].carried
    }

    /// Whose row a source shoots through: its own where it is no carrier's.
    pub(super) fn through(&self, s: usize) -> Carrier {
        self.sources[s].carrier.unwrap_or(Carrier {
            source: s,
            share: 1.0,
        })
    }

    /// Whether it shoots through a row.
    pub(super) fn has_way(&self, s: usize) -> bool {
        self.sources[self.through(s).source].row.is_some()
    }
}
