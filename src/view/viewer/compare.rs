//! Two sides of the view with a line between them: what is held or traced, and what is now.

use std::sync::Arc;

use egui::{Align2, Color32, FontId, Painter, Stroke, pos2};

use super::Viewer;
use super::pictures::is_fresh;
use crate::error::Result;
use crate::render::{Comparison, Show};
use crate::view::compare::{Against, Held, Left, Traced};
use crate::view::detailer::{Drawn, Wanted};
use crate::view::panel_pass::Layer;
use crate::view::surface_pass::SurfacePass;
use crate::view::switches::{PARTS, SHADINGS};
use crate::view::tracer::tracer;

impl Viewer {
    /// Holds the view as it is on the left, or ends that.
    pub(super) fn hold(&mut self) {
        if matches!(self.left, Some(Left::Held(_))) {
            self.part();
            return;
        }
        let device = self.screen.device();
        let surfaces = SurfacePass::new(device, self.screen.pass(), &self.snapshot.scene);
        let mut surfaces = match surfaces {
            Ok(surfaces) => surfaces,
            Err(error) => {
                self.notes.warn(error.to_string());
                return;
            }
        };
        surfaces.set_light(&self.snapshot.scene, &self.snapshot.at_corners);
        self.set_left(Left::Held(Box::new(Held {
            snapshot: Arc::clone(&self.snapshot),
            switches: self.switches,
            surfaces,
            name: self.name_of_side(),
        })));
        self.say("held on the left: what is changed now shows on the right".into());
    }

    /// Traces paths on the left, or ends that.
    pub(super) fn trace(&mut self) {
        if matches!(self.left, Some(Left::Traced(_))) {
            self.part();
            return;
        }
        self.set_left(Left::Traced(Box::new(Traced {
            tracer: tracer(Arc::clone(&self.wake)),
            wanted: None,
            differences: Vec::new(),
            progress: String::new(),
        })));
    }

    /// Compares the view to what a script names.
    pub(in crate::view) fn compare_to(&mut self, against: Option<Against>) {
        self.part();
        match against {
            None => {}
            Some(Against::Held) => self.hold(),
            Some(Against::Traced) => self.trace(),
        }
    }

    /// Whether the picture of the left side is shown with all its pixels.
    pub(in crate::view) fn is_compared(&self) -> bool {
        self.shown_left().is_some_and(|drawn| drawn.is_whole)
    }

    /// Ends the comparison.
    pub(super) fn part(&mut self) {
        self.left = None;
        self.pictures.left = None;
        self.apart.clear();
        self.dirty = true;
    }

    fn set_left(&mut self, left: Left) {
        self.part();
        self.left = Some(left);
        // Both sides are drawn again.
        self.pictures.wanted = None;
    }

    /// What the switches and the bake are now, in a few words.
    fn name_of_side(&self) -> String {
        let name = |list: &[(&str, bool)]| {
            let found = list.iter().find(|(_, is_so)| *is_so);
            found.map_or("", |(name, _)| name).to_owned()
        };
        let part = PARTS.map(|(name, part)| (name, part == self.switches.part));
        let mut words = vec![name(&part)];
        if self.snapshot.relief.is_some() {
            let shading = SHADINGS.map(|(name, shading)| (name, shading == self.switches.shading));
            words.push(name(&shading));
            words.push(format!("K {}", self.directions));
        }
        if self.paper {
            words.push("paper".into());
        }
        words.join(", ")
    }

    /// What the picture of the left side would be of; the camera and the exposure are those of now.
    pub(super) fn left_wanted(&self, size: (u32, u32)) -> Option<Wanted> {
        let now = self.wanted_now(size);
        Some(match self.left.as_ref()? {
            Left::Traced(_) => Wanted {
                show: Show::Shaded,
                left: true,
                ..now
            },
            Left::Held(held) => Wanted {
                part: held.switches.part,
                shading: held.switches.shading,
                direct: held.switches.direct,
                show: held.switches.show,
                ambient: self.ambient_of(&held.snapshot, &held.switches),
                snapshot: Arc::clone(&held.snapshot),
                left: true,
                ..now
            },
        })
    }

    /// The picture of the left side if it is of the view as it is.
    pub(super) fn shown_left(&self) -> Option<&Drawn> {
        let drawn = self.pictures.left.as_ref()?;
        let now = self.left_wanted(drawn.of.size)?;
        let shown = self.switches.detail || matches!(self.left, Some(Left::Traced(_)));
        let fresh = is_fresh(&drawn.of.snapshot, &now.snapshot);
        (shown && fresh && drawn.of.looks_like(&now)).then_some(drawn)
    }

    /// Asks the path tracer for a view that stays.
    pub(super) fn want_traced(&mut self, size: (u32, u32), stays: bool) {
        let wanted = self.left_wanted(size);
        let Some(Left::Traced(traced)) = &mut self.left else {
            return;
        };
        let same = |a: &Option<Wanted>| match (a, &wanted) {
            (Some(a), Some(b)) => {
                a.looks_like(b) && Arc::ptr_eq(&a.snapshot.scene, &b.snapshot.scene)
            }
            _ => false,
        };
        if !stays {
            if traced.wanted.take().is_some() {
                traced.tracer.ask(None);
            }
            return;
        }
        if same(&traced.wanted) {
            return;
        }
        traced.differences.clear();
        traced.progress.clear();
        traced.tracer.ask(wanted.clone());
        traced.wanted = wanted;
    }

    /// Takes what the path tracer has found.
    pub(super) fn take_traced(&mut self) -> Result<()> {
        let Some(Left::Traced(traced)) = &mut self.left else {
            return Ok(());
        };
        if let Some(error) = traced.tracer.error() {
            self.part();
            return self.fail(error);
        }
        let Some(found) = traced.tracer.take() else {
            return Ok(());
        };
        traced.progress = format!(
            "{} paths a pixel in {:.0} s, noise {:.1} %",
            found.paths,
            found.elapsed.as_secs_f64(),
            100.0 * found.noise
        );
        self.take_left(found.drawn)
    }

    /// Takes a picture of the left side.
    pub(super) fn take_left(&mut self, drawn: Drawn) -> Result<()> {
        let size = drawn.of.size;
        self.panel_pass.set_layer(Layer::Left, size, &drawn.codes)?;
        self.pictures.left = Some(drawn);
        self.compare();
        Ok(())
    }

    /// Finds how far the two sides are apart, once there are pictures of both.
    pub(super) fn compare(&mut self) {
        self.apart.clear();
        if let Some(Left::Traced(traced)) = &self.left {
            self.apart.push(traced.progress.clone());
        }
        let (Some(left), Some(now)) = (self.shown_left(), self.shown_detail()) else {
            return;
        };
        let (Some(reference), Some(picture)) = (&left.picture, &now.picture) else {
            return;
        };
        let Ok(found) = Comparison::new(picture, reference) else {
            return;
        };
        let seconds = left.seconds;
        self.apart.push(format!(
            "right over left: {:+.2} %, rms {:.2} % of the mean",
            100.0 * found.bias,
            100.0 * found.rms
        ));
        if let Some(Left::Traced(traced)) = &mut self.left {
            traced.differences.push([seconds, found.rms]);
        }
    }

    /// The line between the sides, and their names.
    pub(super) fn draw_line(&self, painter: &Painter, size: (u32, u32)) {
        let Some(left) = &self.left else {
            return;
        };
        let scale = self.scale;
        let x = self.line.column(size.0) as f32 / scale;
        let height = size.1 as f32 / scale;
        painter.line_segment(
            [pos2(x, 0.0), pos2(x, height)],
            Stroke::new(2.0, Color32::from_white_alpha(220)),
        );
        painter.circle_filled(pos2(x, height / 2.0), 7.0, Color32::from_white_alpha(220));
        let names = [
            (Align2::RIGHT_TOP, -10.0, left.name().to_owned()),
            (
                Align2::LEFT_TOP,
                10.0,
                format!("now: {}", self.name_of_side()),
            ),
        ];
        for (align, aside, name) in names {
            let font = FontId::proportional(13.0);
            let text = painter.layout_no_wrap(name, font, Color32::WHITE);
            let place = align.anchor_size(pos2(x + aside, 10.0), text.size());
            painter.rect_filled(place.expand(4.0), 3.0, Color32::from_black_alpha(190));
            painter.galley(place.min, text, Color32::WHITE);
        }
    }
}
