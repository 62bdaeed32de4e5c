//! Detailed pictures: which are wanted, and which are shown.

use std::sync::Arc;
use std::time::Instant;

use super::Viewer;
use crate::error::Result;
use crate::view::compare::Left;
use crate::view::detailer::{Drawn, PAUSE, Wanted};
use crate::view::panel_pass::Layer;
use crate::view::snapshot::Snapshot;

/// Detailed pictures of the view.
#[derive(Default)]
pub(super) struct Pictures {
    /// The last one, or as much of it as there is.
    pub detail: Option<Drawn>,
    /// The same of the left side of a comparison.
    pub left: Option<Drawn>,
    /// The one that was last ordered for the view as it is.
    pub wanted: Option<Wanted>,
    /// The view as it is.
    pub seen: Option<Seen>,
}

/// A view that the window shows.
pub(super) struct Seen {
    pub of: Wanted,
    /// When it became so.
    pub since: Instant,
}

/// A picture of a bake under way is shown until the light has come so much further: its unshot share
/// over the present one.
const FURTHER: f64 = 2.0;

/// Whether a picture of light `of` may stand in place of the light `now`, of the same bake.
pub(super) fn is_fresh(of: &Snapshot, now: &Snapshot) -> bool {
    let unshot = |light: &Snapshot| match light.progress.done {
        true => 0.0,
        false => light.progress.update.unshot_share,
    };
    let (before, now) = (unshot(of), unshot(now));
    before <= (FURTHER * now).max(0.05)
}

impl Viewer {
    /// What a picture of `size` pixels of the view as it is would be of.
    pub(super) fn wanted_now(&self, size: (u32, u32)) -> Wanted {
        Wanted {
            snapshot: Arc::clone(&self.snapshot),
            camera: self.eye.camera.clone(),
            size,
            part: self.switches.part,
            shading: self.switches.shading,
            direct: self.switches.direct,
            show: self.switches.show,
            ambient: self.ambient(),
            exposure: self.exposure(),
            left: false,
        }
    }

    /// The detailed picture if it is of what the window shows.
    pub(super) fn shown_detail(&self) -> Option<&Drawn> {
        let drawn = self.pictures.detail.as_ref()?;
        let now = &self.pictures.seen.as_ref()?.of;
        // A sketch is of later lights.
        let shown = self.switches.detail && self.sketched.is_none() && drawn.of.looks_like(now);
        (shown && is_fresh(&drawn.of.snapshot, &self.snapshot)).then_some(drawn)
    }

    /// Takes a detailed picture, or a part of one.
    pub(super) fn take_picture(&mut self, drawn: Drawn) -> Result<()> {
        let size = drawn.of.size;
        self.panel_pass
            .set_layer(Layer::Picture, size, &drawn.codes)?;
        self.pictures.detail = Some(drawn);
        self.compare();
        Ok(())
    }

    /// Orders a picture of a view that has stayed for [`PAUSE`].
    pub(super) fn want_detail(&mut self, size: (u32, u32)) {
        let now = self.wanted_now(size);
        let seen = self.pictures.seen.as_ref();
        let Some(seen) = seen.filter(|before| before.of.looks_like(&now)) else {
            let since = Instant::now();
            self.pictures.seen = Some(Seen { of: now, since });
            if self.pictures.wanted.take().is_some() {
                self.detailer.want(Vec::new());
            }
            self.want_traced(size, false);
            return;
        };
        let stays = seen.since.elapsed() >= PAUSE && self.edited.is_none();
        self.want_traced(size, stays);
        if !(self.refines() && stays) {
            return;
        }
        // During a bake, a picture is finished before the next stage's is begun.
        let ask = match &self.pictures.wanted {
            None => true,
            Some(wanted) => {
                let drawn = self.pictures.detail.as_ref();
                let finished = drawn.is_some_and(|drawn| {
                    drawn.is_whole && Arc::ptr_eq(&drawn.of.snapshot, &wanted.snapshot)
                });
                !Arc::ptr_eq(&wanted.snapshot, &now.snapshot)
                    && (finished || now.snapshot.progress.done)
            }
        };
        if ask {
            self.pictures.wanted = Some(now.clone());
            let held = matches!(self.left, Some(Left::Held(_)));
            let left = self.left_wanted(size).filter(|_| held);
            // One that is there already stays.
            let left = left.filter(|left| {
                let drawn = self.shown_left();
                !drawn.is_some_and(|drawn| drawn.is_whole && drawn.of.looks_like(left))
            });
            self.detailer
                .want([Some(now), left].into_iter().flatten().collect());
        }
    }
}
