//! A frame of the window: what it asks of the other threads, and what it draws.

use std::time::{Duration, Instant};

use super::Viewer;
use crate::error::Result;
use crate::picture::{Light, write_png};
use crate::view::panel_pass::Prepared;
use crate::view::screen::Captured;
use crate::view::surface_pass::{self, Laid};
use crate::vk::Shown;

/// Times of one frame that is being drawn.
struct Started {
    at: Instant,
    /// Time of the first input that this frame answers.
    unanswered: Option<Instant>,
    /// What taking the other threads' results took.
    update: Duration,
    /// When all was ready to be recorded.
    prepared: Instant,
}

impl Viewer {
    /// Draws a frame if the window has an area. Returns whether one was shown.
    ///
    /// # Errors
    /// A device or a display that fails; a picture of the frame that cannot be written.
    pub fn frame(&mut self) -> Result<bool> {
        let begin = Instant::now();
        let unanswered = self.unanswered.take();
        self.dirty = false;
        if !self.switches.slots {
            self.input.hovered = None;
        }
        self.update()?;
        let update = begin.elapsed();
        let seconds = begin.duration_since(self.last_frame).as_secs_f64();
        self.last_frame = begin;
        self.fly(seconds.min(0.1));
        let Some(size) = self.screen.fit(self.size, self.stale)? else {
            return Ok(false);
        };
        let primitives = self.panel(size)?;
        self.want_detail(size);
        let panel = self.panel_pass.prepare(&primitives, size, self.scale)?;
        let shown = self.shown();
        let started = Started {
            at: begin,
            unanswered,
            update,
            prepared: Instant::now(),
        };
        let (answer, captured) = self.draw(size, &panel, &shown)?;
        self.stale = answer != Shown::Yes;
        if !answer.is_seen() {
            self.unanswered = unanswered;
            return Ok(false);
        }
        self.count(&started);
        if let (Some(path), Some(captured)) = (self.capture.take(), captured) {
            write_png(&path, captured.size, &captured.codes)?;
        }
        Ok(true)
    }

    /// What the surfaces show in this frame.
    fn shown(&mut self) -> surface_pass::Shown {
        let [all, direct, emission] = match self.switches.part {
            Light::Global => [1.0, 0.0, 1.0],
            Light::Direct => [0.0, 1.0, 1.0],
            Light::Indirect => [1.0, -1.0, 0.0],
        };
        let picture = match (self.shown_detail().is_some(), self.kept_detail()) {
            (true, _) => Laid::Exactly,
            (false, kept) if kept != [false; 2] => {
                self.surfaces.lay(kept);
                Laid::FromElsewhere
            }
            _ => Laid::No,
        };
        surface_pass::Shown {
            exposure: self.exposure().exp2(),
            ambient: self.ambient(),
            parts: [all, direct, emission],
            elements: self.switches.elements,
            sources: self.switches.sources,
            picture,
            chosen: self.input.chosen.or(self.input.hovered),
        }
    }

    /// Records and shows the frame; what was read back of it, where that was asked for.
    fn draw(
        &mut self,
        size: (u32, u32),
        panel: &Prepared,
        shown: &surface_pass::Shown,
    ) -> Result<(Shown, Option<Captured>)> {
        let rows = self.eye.rows(&self.scene, size);
        let (surfaces, panel_pass) = (&self.surfaces, &self.panel_pass);
        // A software driver compiles a shader at its first draw: all are drawn in the first frame.
        let unseen = [
            (Laid::No, false),
            (Laid::FromElsewhere, false),
            (Laid::No, true),
        ];
        let unseen = unseen.map(|(picture, elements)| surface_pass::Shown {
            picture,
            elements,
            ..*shown
        });
        let first = !self.timing.has_begun();
        self.screen.show(self.capture.is_some(), |cmd| {
            if first {
                cmd.scissor(0, 0, 1, 1);
                for unseen in &unseen {
                    surfaces.record(cmd, &rows, unseen);
                }
                cmd.scissor(0, 0, size.0, size.1);
            }
            if shown.picture == Laid::Exactly {
                panel_pass.record_picture(cmd, panel);
            }
            // Over a picture that covers the frame, only the overlays.
            surfaces.record(cmd, &rows, shown);
            panel_pass.record(cmd, panel);
        })
    }

    /// Counts the times of a frame that was shown.
    fn count(&mut self, started: &Started) {
        let Started {
            at,
            unanswered,
            update,
            prepared,
        } = *started;
        self.timing.frame(at.elapsed(), self.is_baking());
        tracing::debug!(
            "frame: waited {:?}, updated in {:?}, prepared in {:?}, shown in {:?}",
            unanswered.map(|since| at - since),
            update,
            prepared - at - update,
            prepared.elapsed()
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
    }
}
