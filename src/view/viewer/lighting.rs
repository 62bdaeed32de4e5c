//! What the user changes of the light: lamps, their history, the exposure, and how a scene is baked.

use std::sync::Arc;
use std::time::Instant;

use super::{SKETCHING, Viewer};
use crate::bake::quality::{self, Quality};
use crate::error::Result;
use crate::math::directions::Directions;
use crate::solver::{Estimator, Settings};
use crate::view::lamps::{Lamp, lit};
use crate::view::orders::Order;
use crate::view::sketch::{self, Sketch};

/// Changed lights that are not all shown yet.
pub(in crate::view) struct Edited {
    epoch: u64,
    since: Instant,
    /// Whether what they emit is shown.
    pub(in crate::view) shown_direct: bool,
}

impl Viewer {
    /// Starts a new bake with the chosen directions and relief.
    pub(in crate::view) fn bake(&mut self) {
        self.settings = match self.wanted_settings() {
            Ok(settings) => settings,
            Err(error) => {
                self.notes.warn(error.to_string());
                return;
            }
        };
        for (material, before) in self
            .base
            .materials
            .iter()
            .zip(Arc::make_mut(&mut self.scene).materials.iter_mut())
        {
            before.height_scale = material.height_scale * self.relief_scale as f32;
        }
        self.surfaces.set_about(&self.scene);
        self.metering = true;
        self.start_epoch();
        self.order_bake();
    }

    fn order_bake(&mut self) {
        self.ordered = Arc::clone(&self.scene);
        self.baker.order(Order::Bake {
            scene: Arc::clone(&self.scene),
            settings: Box::new(self.settings.clone()),
            epoch: self.epoch,
        });
    }

    /// Whether a surface has moved since a bake was ordered.
    pub(super) fn is_moved(&self) -> bool {
        self.ordered.vertices != self.scene.vertices
    }

    /// Relights the scene by the lamps as they are now, which can be undone.
    pub(in crate::view) fn relight(&mut self) {
        // What is moved is one edit, at its end.
        if self.input.grabbed.is_none() && self.lamps != self.lit_lamps {
            let before = self.lit_lamps.clone();
            self.history.edited(before, Instant::now());
        }
        self.light_anew();
    }

    pub(super) fn undo(&mut self) {
        match self.history.undo(&self.lamps) {
            Some(before) => self.set_lamps(before),
            None => self.say("nothing to undo".into()),
        }
    }

    pub(super) fn redo(&mut self) {
        match self.history.redo(&self.lamps) {
            Some(after) => self.set_lamps(after),
            None => self.say("nothing to redo".into()),
        }
    }

    fn set_lamps(&mut self, lamps: Vec<Lamp>) {
        self.lamps = lamps;
        self.light_anew();
    }

    /// Exposes by the light as it is.
    pub(super) fn meter(&mut self) {
        self.metering = true;
        self.metered = self.snapshot.exposure;
        self.dirty = true;
    }

    pub(super) fn light_anew(&mut self) {
        self.lit_lamps = self.lamps.clone();
        self.metering = false;
        let home = (&self.base, &self.first_lamps[..]);
        let scene = Arc::new(lit(&self.scene, home, &self.lamps));
        let before = std::mem::replace(&mut self.scene, scene);
        self.surfaces.set_emission(&self.scene);
        if before.vertices != self.scene.vertices {
            let device = self.screen.device();
            if let Err(error) = self.surfaces.set_places(device, &self.scene) {
                self.notes.warn(error.to_string());
            }
        }
        self.start_epoch();
        self.edited = Some(Edited {
            epoch: self.epoch,
            since: Instant::now(),
            shown_direct: false,
        });
        match (self.is_moved(), self.input.grabbed.is_some()) {
            (false, _) => self.baker.order(Order::Relight {
                scene: Arc::clone(&self.scene),
                epoch: self.epoch,
                sketched: self.can_sketch(),
            }),
            // Form factors to a surface that has moved are others, which are found where it stays.
            (true, false) => self.order_bake(),
            (true, true) => {}
        }
        self.sketch();
        // It would take the time of what is to be shown next.
        if self.pictures.wanted.take().is_some() {
            self.detailer.want(Vec::new());
        }
    }

    fn can_sketch(&self) -> bool {
        self.is_lit() && sketch::is_possible(&self.snapshot.scene, &self.scene)
    }

    /// Asks for a sketch of the lights as they are now; where none has changed, for what the next
    /// sketch needs.
    pub(super) fn sketch(&self) {
        if self.can_sketch() {
            self.sketcher.ask(Some(sketch::Wanted {
                base: Arc::clone(&self.snapshot),
                scene: Arc::clone(&self.scene),
                epoch: self.epoch,
                since: self.edited.as_ref().map_or_else(Instant::now, |e| e.since),
            }));
        }
    }

    /// Until when a frame waits for a sketch that is under way: one of lights before the last frame
    /// would show them a frame late.
    pub(super) fn sketch_due(&self) -> Option<Instant> {
        let edited = self.edited.as_ref().filter(|edited| !edited.shown_direct)?;
        let newer = |found: &Sketch| found.epoch > self.framed;
        let under_way = self.can_sketch() && !self.sketcher.has_found(newer);
        // Of several changes since the last frame, from the first.
        under_way.then(|| self.unanswered.unwrap_or(edited.since) + SKETCHING)
    }

    /// Shows the last sketch until there is light of the same lights or later ones.
    pub(super) fn take_sketch(&mut self) -> Result<()> {
        if let Some(error) = self.sketcher.error() {
            self.fail(error)?;
        }
        let found = self.sketcher.take();
        if let Some(Sketch {
            epoch,
            since,
            light,
        }) = found.filter(|found| found.epoch > self.snapshot.epoch)
        {
            self.surfaces.set_light(&self.scene, &light);
            // One over other light before is no first one.
            if self.sketched.replace(epoch) != Some(epoch) {
                self.timing.relit_direct_next(since);
            }
            if let Some(edited) = self.edited.as_mut().filter(|edited| edited.epoch == epoch) {
                edited.shown_direct = true;
            }
        }
        Ok(())
    }

    /// Notes when changed lights are on the screen.
    pub(super) fn note_edited(&mut self) {
        self.timing.relit_direct_shown();
        let shown = |edited: &&mut Edited| self.snapshot.epoch >= edited.epoch;
        let Some(edited) = self.edited.as_mut().filter(shown) else {
            return;
        };
        let since = edited.since;
        if !std::mem::replace(&mut edited.shown_direct, true) {
            self.timing.relit_direct(since);
        }
        if !self.snapshot.lags {
            self.timing.relit(since);
            let seconds = since.elapsed().as_secs_f64();
            self.say(format!("lit anew after {seconds:.2} s"));
            self.edited = None;
        }
    }

    /// Those that were asked for, with what the panel has changed since.
    fn wanted_settings(&self) -> Result<Settings> {
        let first = &self.first_settings;
        if self.paper && first.estimator != Estimator::Paper {
            let paper = quality::paper(self.directions)?;
            return Ok(Settings {
                budget: first.budget,
                shots: first.shots,
                seed: first.seed,
                ..paper
            });
        }
        let mut settings = first.clone();
        if !self.paper && first.estimator == Estimator::Paper {
            settings = Quality::Normal.settings();
        }
        settings.relief.directions = Directions::new(self.directions)?;
        Ok(settings)
    }
}
