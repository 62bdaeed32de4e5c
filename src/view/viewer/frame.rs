//! A frame of the window: what it asks of the other threads, and what it draws.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::Viewer;
use crate::error::Result;
use crate::passes::pass_parts::PartedPass;
use crate::picture::{Light, write_png};
use crate::render::{ReliefShading, Show};
use crate::view::backdrop;
use crate::view::camera::Rows;
use crate::view::compare::Left;
use crate::view::panel_pass::{Layer, PanelPass, Prepared};
use crate::view::screen::Captured;
use crate::view::snapshot::Snapshot;
use crate::view::surface_pass::{self, SurfacePass};
use crate::view::switches::Switches;
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

/// One side of the view, or all of it.
struct Side {
    /// Whether it is what is held.
    held: bool,
    shown: surface_pass::Shown,
    /// Where its picture is, if there is one.
    picture: Option<Layer>,
    /// Whether the picture leaves nothing of the surfaces to be seen.
    covered: bool,
    /// Left, top, width, height, pixels.
    clip: [u32; 4],
}

impl Side {
    fn record(
        &self,
        pass: &mut PartedPass<'_>,
        rows: &Rows,
        surfaces: &SurfacePass,
        (panel_pass, panel): (&PanelPass, &Prepared),
        sky: bool,
        first: bool,
    ) {
        if first {
            // A software driver compiles a shader at its first draw: all are drawn in the first
            // frame.
            pass.clip([0, 0, 1, 1]);
            surfaces.record(pass, rows, &self.shown);
            surfaces.record_overlays(pass, rows, &self.shown);
        }
        if sky && !self.covered {
            panel_pass.record_layer(pass.commands(), panel, Layer::Backdrop, self.clip);
        }
        pass.clip(self.clip);
        if !self.covered {
            surfaces.record(pass, rows, &self.shown);
        }
        if let Some(layer) = self.picture {
            panel_pass.record_layer(pass.commands(), panel, layer, self.clip);
        }
        if self.shown.has_overlays() {
            surfaces.record_overlays(pass, rows, &self.shown);
        }
    }
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
        self.framed = self.epoch;
        self.fly(seconds.min(0.1));
        let Some(size) = self.screen.fit(self.size, self.stale)? else {
            return Ok(false);
        };
        let primitives = self.panel(size)?;
        self.want_detail(size);
        let panel = self.panel_pass.prepare(&primitives, size, self.scale)?;
        self.set_backdrop(size)?;
        let started = Started {
            at: begin,
            unanswered,
            update,
            prepared: Instant::now(),
        };
        let (answer, captured) = self.draw(size, &panel)?;
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

    /// Draws the sky of the view as it is, coarsely; nothing where pictures show none.
    fn set_backdrop(&mut self, size: (u32, u32)) -> Result<()> {
        let shows = self.switches.part != Light::Direct && self.switches.show == Show::Shaded;
        let sky = self.scene.lights.sky.as_ref().filter(|_| shows);
        let subject = sky.map(|_| backdrop::Subject {
            camera: self.eye.camera.clone(),
            size,
            exposure: self.exposure(),
        });
        if let (Some(sky), Some(subject)) = (sky, &subject)
            && self.backdrop.as_ref() != Some(subject)
        {
            let (size, codes) = subject.drawn(sky, &self.eye);
            self.panel_pass.set_layer(Layer::Backdrop, size, &codes)?;
        }
        self.backdrop = subject;
        Ok(())
    }

    /// What the surfaces show in this frame, by these switches.
    fn shown(&self, snapshot: &Snapshot, switches: &Switches) -> surface_pass::Shown {
        let [all, direct, emission] = match switches.part {
            Light::Global => [1.0, 0.0, 1.0],
            Light::Direct => [0.0, 1.0, 1.0],
            Light::Indirect => [1.0, -1.0, 0.0],
        };
        surface_pass::Shown {
            exposure: self.exposure().exp2(),
            ambient: self.ambient_of(snapshot, switches),
            parts: [all, direct, emission],
            relief: switches.shading != ReliefShading::None,
            elements: self.switches.elements,
            sources: self.switches.sources,
            chosen: self.input.chosen.or(self.input.hovered),
        }
    }

    /// What is drawn between these columns.
    fn side(&self, columns: Range<u32>, height: u32, is_left: bool) -> Side {
        let (snapshot, switches, held) = match (&self.left, is_left) {
            (Some(Left::Held(held)), true) => (&held.snapshot, &held.switches, true),
            _ => (&self.snapshot, &self.switches, false),
        };
        let (drawn, layer) = match is_left {
            true => (self.shown_left(), Layer::Left),
            false => (self.shown_detail(), Layer::Picture),
        };
        let shown = self.shown(snapshot, switches);
        Side {
            held,
            picture: drawn.map(|_| layer),
            covered: drawn.is_some_and(|drawn| drawn.is_whole) && !shown.has_overlays(),
            shown,
            clip: [columns.start, 0, columns.len() as u32, height],
        }
    }

    /// Records and shows the frame; what was read back of it, where that was asked for.
    fn draw(
        &mut self,
        (width, height): (u32, u32),
        panel: &Prepared,
    ) -> Result<(Shown, Option<Captured>)> {
        let line = self.left.as_ref().map(|_| self.line.column(width));
        let line = line.unwrap_or(0);
        let sides = [(0..line, true), (line..width, false)];
        let sides = sides.into_iter().filter(|(columns, _)| !columns.is_empty());
        let sides: Vec<Side> = sides
            .map(|(columns, is_left)| self.side(columns, height, is_left))
            .collect();
        let sky = self.backdrop.is_some();
        let first = !self.timing.has_begun();
        let Self {
            screen,
            surfaces,
            left,
            eye,
            panel_pass,
            capture,
            ..
        } = self;
        screen.show(capture.is_some(), |pass| {
            for side in &sides {
                let surfaces = match left {
                    Some(Left::Held(held)) if side.held => &held.surfaces,
                    _ => &*surfaces,
                };
                let rows = eye.rows(surfaces.frame(), (width, height));
                side.record(pass, &rows, surfaces, (&*panel_pass, panel), sky, first);
            }
            pass.clip([0, 0, width, height]);
            panel_pass.record(pass.commands(), panel);
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
        self.note_edited();
        if self.is_lit() {
            self.timing.first_light(self.start);
        }
    }
}
