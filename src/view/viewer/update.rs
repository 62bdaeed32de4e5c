//! Results of the baker and the detailer, taken once a frame.

use std::sync::atomic::Ordering;

use super::Viewer;
use crate::error::{Error, Result};
use crate::solver::Update;
use crate::view::compare::Left;

/// Largest error of the exposure of a bake under way, stops.
const MOST_CHANGE: f32 = 0.2;

impl Viewer {
    /// Takes the results of the other threads.
    pub(super) fn update(&mut self) -> Result<()> {
        let latest = self.baker.take();
        if let Some(error) = latest.error {
            self.progress.done = true;
            self.edited = None;
            self.fail(error)?;
        }
        if let Some(sources) = latest.sources {
            self.surfaces.set_sources(&self.scene, sources.clone());
            self.overlays.sources = sources;
            self.overlays.lists += 1;
        }
        if let Some((epoch, progress)) = latest.progress
            && epoch == self.epoch
        {
            if progress.done && !self.progress.done {
                let seconds = progress.update.elapsed.as_secs_f64();
                self.say(format!("baked in {seconds:.1} s"));
            }
            self.progress = progress;
            let Update {
                error_bound,
                elapsed,
                ..
            } = progress.update;
            if let Some(bound) = error_bound {
                self.bounds.push([elapsed.as_secs_f64(), bound]);
            }
        }
        if let Some(items) = latest.items {
            self.overlays.items = Some(items);
        }
        if let Some(snapshot) = latest.snapshot {
            // A sketch of later lights stays until it has been repeated over this light.
            let older = snapshot.epoch < self.epoch;
            if !(older && self.sketched.is_some()) {
                let light = &snapshot.at_corners;
                self.surfaces.set_light(&snapshot.scene, light);
                self.sketched = None;
            }
            // Stages of one bake have one exposure: else a picture of one would not fit the next.
            let change = (snapshot.exposure - self.metered).abs();
            let same = snapshot.epoch == self.snapshot.epoch && self.is_lit();
            if self.metering && (snapshot.progress.done || !same || change > MOST_CHANGE) {
                self.metered = snapshot.exposure;
            }
            self.snapshot = snapshot;
            self.lights += 1;
            self.sketch();
        }
        self.take_sketch()?;
        if let Some((epoch, stage)) = latest.stage
            && epoch == self.epoch
        {
            self.stage = stage;
        }
        self.ask_sources();
        let [left, drawn] = self.detailer.take();
        if let Some(left) = left.filter(|_| matches!(self.left, Some(Left::Held(_)))) {
            self.take_left(left)?;
        }
        if let Some(drawn) = drawn {
            self.take_picture(drawn)?;
        }
        self.take_traced()?;
        for (path, saved) in self.baker.saved() {
            match saved {
                Ok(()) => {
                    tracing::info!("saved {}", path.display());
                    self.say(format!("saved {}", path.display()));
                    self.saving.retain(|under_way| *under_way != path);
                }
                Err(error) => {
                    self.saving.retain(|under_way| *under_way != path);
                    self.fail(error)?;
                }
            }
        }
        if self.watched.swap(false, Ordering::SeqCst) {
            let name = self.name.clone();
            self.say(format!("{name} has changed: it is read again"));
            self.open(name);
        }
        for (path, saved) in self.detailer.saved() {
            self.saving.retain(|under_way| *under_way != path);
            match saved {
                Ok(exposure) => {
                    tracing::info!("saved {}, exposure {exposure}", path.display());
                    self.say(format!("saved {}", path.display()));
                }
                Err(error) => self.fail(error)?,
            }
        }
        match self.detailer.error() {
            Some(error) => self.fail(error),
            None => Ok(()),
        }
    }

    /// Shows an error to the user; a script ends with it.
    pub(in crate::view) fn fail(&mut self, error: Error) -> Result<()> {
        match self.input.scripted {
            true => Err(error),
            false => {
                tracing::error!("{error}");
                self.notes.warn(error.to_string());
                Ok(())
            }
        }
    }
}
