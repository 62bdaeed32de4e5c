//! Changed lights: shown by what they emit first, then by what coupling makes of it, then solved.

use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use super::first_light::first_stage;
use super::{Snapshot, Work};
use crate::bake;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::solver::{Solver, Update};

/// What is shown of changed lights before they are solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Relit {
    /// What they emit.
    Emitted,
    /// What coupling makes of it.
    Coupled,
}

/// While lights keep changing, all of their light is shown about this often.
const OVERDUE: Duration = Duration::from_secs(1);

impl Work {
    /// By what has been drawn, or what a file has kept; where there is nothing, or another source
    /// emits than did, from nothing.
    pub(super) fn relight(&mut self, scene: Arc<Scene>, epoch: u64, sketched: bool) -> Result<()> {
        if let Some(mut before) = self.solving.take() {
            match before.solver.relight(&scene) {
                Ok(()) => {
                    let stage = first_stage(&scene, &self.given.settings);
                    self.start(scene, before.solver, epoch, Some(before.about));
                    if let Some(solving) = &mut self.solving {
                        (solving.first, solving.sketched) = (before.first, sketched);
                        solving.relit = Some(Relit::Emitted);
                    }
                    if before.first {
                        self.tell(epoch, Some(stage));
                    }
                    return Ok(());
                }
                // What was black and now emits has no source.
                Err(Error::Usage(_)) => {}
                Err(error) => return Err(error),
            }
        }
        let settings = self.given.settings.clone();
        let kept = self.kept.as_ref();
        let Some(kept) = kept.filter(|kept| kept.check(&scene, &settings).is_ok()) else {
            return self.bake(scene, &settings, epoch);
        };
        let device = self.choice.open_baking()?;
        let elements = bake::elements(&device, &scene, &settings)?;
        match Solver::relit(&device, elements, &scene.lights, &settings, kept) {
            Ok(solver) => self.start(scene, solver, epoch, None),
            Err(Error::Usage(_)) => return self.bake(scene, &settings, epoch),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Shows the next step of a relighting. Whether there was one. Lights that go on changing stop
    /// it, but for one in a while.
    pub(super) fn show_relit(&mut self) -> Result<bool> {
        let Some(solving) = &mut self.solving else {
            return Ok(false);
        };
        let Some(mut step) = solving.relit else {
            return Ok(false);
        };
        let overdue = self.shown_at.elapsed() >= OVERDUE;
        let interrupt = &self.shared.interrupt;
        let go_on = || overdue || !interrupt.load(Ordering::SeqCst);
        if step == Relit::Emitted {
            solving.solver.gather_emitted()?;
            if solving.sketched {
                step = Relit::Coupled;
                solving.relit = Some(step);
            }
        }
        let whole = step != Relit::Coupled || (go_on() && solving.solver.gather_coupled(go_on)?);
        if !whole {
            return Ok(true);
        }
        let progress = solving.progress(Update::default(), false);
        let (scene, about) = (&solving.scene, &solving.about);
        let (epoch, solver) = (solving.epoch, &solving.solver);
        let snapshot = match (step, &self.shown) {
            (Relit::Emitted, Some(before)) => {
                let of = (epoch, scene, progress);
                Snapshot::of_emitted(of, about, solver, before)?
            }
            (Relit::Emitted, None) => None,
            (Relit::Coupled, _) => {
                Some(Snapshot::of_solver(epoch, scene, about, solver, progress)?)
            }
        };
        solving.relit = match step {
            Relit::Emitted => Some(Relit::Coupled),
            Relit::Coupled => None,
        };
        if let Some(snapshot) = snapshot {
            self.show(epoch, progress, snapshot);
        }
        Ok(true)
    }
}
