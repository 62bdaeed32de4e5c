//! A frame of the window: what it asks of the other threads, and what it draws.

use std::sync::Arc;
use std::time::Instant;

use super::Viewer;
use crate::error::Result;
use crate::render::{Light, write_png};
use crate::view::detailer::{PAUSE, Wanted};
use crate::view::surface_pass::{self, Laid};
use crate::vk::Shown;

impl Viewer {
    /// Draws a frame if the window has an area; returns what was read back of it, where that was asked for.
    ///
    /// # Errors
    /// A device or a display that fails.
    pub fn frame(&mut self) -> Result<bool> {
        let begin = Instant::now();
        let unanswered = self.unanswered.take();
        self.dirty = false;
        if !self.switches.slots {
            self.input.hovered = None;
        }
        self.update()?;
        let updated = Instant::now();
        let seconds = begin.duration_since(self.last_frame).as_secs_f64();
        self.last_frame = begin;
        self.fly(seconds.min(0.1));
        let Some(size) = self.screen.fit(self.size, self.stale)? else {
            return Ok(false);
        };
        self.stale = false;
        let primitives = self.panel(size)?;
        self.want_detail(size);
        let prepared = self.panel_pass.prepare(&primitives, size, self.scale)?;
        let rows = self.eye.rows(&self.scene, size);
        let [all, direct, emission] = match self.switches.part {
            Light::Global => [1.0, 0.0, 1.0],
            Light::Direct => [0.0, 1.0, 1.0],
            Light::Indirect => [1.0, -1.0, 0.0],
        };
        let laid = match (self.shown_detail().is_some(), self.kept_detail()) {
            (true, _) => Laid::Exactly,
            (false, kept) if kept != [false; 2] => {
                self.surfaces.lay(kept);
                Laid::FromElsewhere
            }
            _ => Laid::No,
        };
        let shown = surface_pass::Shown {
            exposure: self.exposure().exp2(),
            ambient: self.ambient(),
            parts: [all, direct, emission],
            elements: self.switches.elements,
            sources: self.switches.sources,
            picture: laid,
            chosen: self.input.chosen.or(self.input.hovered),
        };
        let capture = self.capture.is_some();
        let prepared_at = Instant::now();
        let (surfaces, panel_pass) = (&self.surfaces, &self.panel_pass);
        // A software driver compiles a shader when something is drawn by it first: not while a person waits.
        let unseen = [
            (Laid::No, false),
            (Laid::FromElsewhere, false),
            (Laid::No, true),
        ];
        let unseen = unseen.map(|(picture, elements)| surface_pass::Shown {
            picture,
            elements,
            ..shown
        });
        let first = !self.timing.has_begun();
        let (answer, captured) = self.screen.show(capture, |cmd| {
            if first {
                cmd.scissor(0, 0, 1, 1);
                unseen
                    .iter()
                    .for_each(|unseen| surfaces.record(cmd, &rows, unseen));
                cmd.scissor(0, 0, size.0, size.1);
            }
            if shown.picture == Laid::Exactly {
                panel_pass.record_picture(cmd, &prepared);
            }
            // Of surfaces that the picture shows, what lies over them alone.
            surfaces.record(cmd, &rows, &shown);
            panel_pass.record(cmd, &prepared);
        })?;
        if answer != Shown::Yes {
            self.stale = true;
            self.unanswered = unanswered;
            return Ok(false);
        }
        self.timing.frame(begin.elapsed(), self.is_baking());
        tracing::debug!(
            "frame: waited {:?}, updated in {:?}, prepared in {:?}, shown in {:?}",
            unanswered.map(|since| begin - since),
            updated - begin,
            prepared_at - updated,
            prepared_at.elapsed()
        );
        if let Some(since) = unanswered {
            self.timing.answer(since);
        }
        if let Some((epoch, since)) = self.edited
            && self.snapshot.epoch >= epoch
        {
            self.timing.relit(since);
            self.edited = None;
        }
        if self.is_lit() {
            self.timing.first_light(self.start);
        }
        if let (Some(path), Some(captured)) = (self.capture.take(), captured) {
            write_png(&path, captured.size, &captured.codes)?;
        }
        Ok(true)
    }

    /// Asks for coarse pictures of a view that changes, and for a whole one once it has stayed for a while.
    fn want_detail(&mut self, size: (u32, u32)) {
        let now = self.wanted_now(size);
        let drawn = self.switches.detail && self.is_lit();
        match &self.seen {
            Some((before, _)) if before.looks_like(&now) => {}
            _ => {
                self.seen = Some((now.clone(), Instant::now()));
                let before = self.wanted.take();
                if drawn {
                    self.detailer.want(Some(now), true);
                } else if before.is_some() {
                    self.detailer.want(None, false);
                }
                return;
            }
        }
        let since = self.seen.as_ref().map(|(_, since)| since.elapsed());
        let stays = since.is_some_and(|since| since >= PAUSE);
        if !(drawn && stays) {
            return;
        }
        // While a bake goes on, a picture is finished before a brighter one is begun.
        let same = |wanted: &Wanted| Arc::ptr_eq(&wanted.snapshot, &now.snapshot);
        let finished = self
            .detail
            .as_ref()
            .is_some_and(|drawn| drawn.size == size && drawn.of.looks_like(&now));
        let ask = match &self.wanted {
            None => true,
            Some(wanted) => !same(wanted) && (finished || now.snapshot.progress.done),
        };
        if ask {
            self.wanted = Some(now.clone());
            self.detailer.want(Some(now), false);
        }
    }
}
