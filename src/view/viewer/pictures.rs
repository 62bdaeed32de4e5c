//! Detailed pictures: which are wanted, and which are shown.

use std::sync::Arc;
use std::time::Instant;

use super::Viewer;
use crate::error::Result;
use crate::view::camera::Eye;
use crate::view::detailer::{Drawn, PAUSE, Wanted};

/// Detailed pictures of the view.
#[derive(Default)]
pub(super) struct Pictures {
    /// The last one.
    pub detail: Option<Drawn>,
    /// What the last whole one is of.
    pub whole: Option<Wanted>,
    /// The whole one that was last ordered for the view as it is.
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
        }
    }

    /// The detailed picture if it is of what the window shows.
    pub(super) fn shown_detail(&self) -> Option<&Drawn> {
        let drawn = self.pictures.detail.as_ref()?;
        let now = &self.pictures.seen.as_ref()?.of;
        (self.switches.detail && drawn.of.looks_like(now)).then_some(drawn)
    }

    /// Whether the last whole picture, and a coarse one after it, colour surfaces as the window
    /// does now.
    pub(super) fn kept_detail(&self) -> [bool; 2] {
        let seen = self.pictures.seen.as_ref();
        let Some(Seen { of: now, .. }) = seen.filter(|_| self.switches.detail) else {
            return [false; 2];
        };
        let whole = self
            .pictures
            .whole
            .as_ref()
            .is_some_and(|of| of.colours_like(now));
        let coarse = self
            .pictures
            .detail
            .as_ref()
            .filter(|drawn| !drawn.is_whole());
        [
            whole,
            coarse.is_some_and(|drawn| drawn.of.colours_like(now)),
        ]
    }

    /// Takes a detailed picture, unless it is a coarse one of a view whose whole picture is shown.
    pub(super) fn take_picture(&mut self, drawn: Drawn) -> Result<()> {
        let last = self.pictures.detail.as_ref();
        let whole = last.filter(|last| last.is_whole() && !drawn.is_whole());
        // The coarse one would be of brighter light.
        if whole.is_some_and(|whole| whole.of.looks_like(&drawn.of)) {
            return Ok(());
        }
        let rows = Eye::new(&self.scene, &drawn.of.camera).rows(&self.scene, drawn.size);
        let (picture, share) = self.surfaces.set_picture(&drawn, &rows)?;
        self.panel_pass.set_picture(picture, share)?;
        if drawn.is_whole() {
            self.pictures.whole = Some(drawn.of.clone());
        }
        self.pictures.detail = Some(drawn);
        Ok(())
    }

    /// Orders coarse pictures of a view that changes, and a whole one of a view that has stayed for
    /// [`PAUSE`].
    pub(super) fn want_detail(&mut self, size: (u32, u32)) {
        let now = self.wanted_now(size);
        let drawn = self.switches.detail && self.is_lit();
        match &self.pictures.seen {
            Some(before) if before.of.looks_like(&now) => {}
            _ => {
                self.pictures.seen = Some(Seen {
                    of: now.clone(),
                    since: Instant::now(),
                });
                let before = self.pictures.wanted.take();
                if drawn {
                    self.detailer.want(Some(now), true);
                } else if before.is_some() {
                    self.detailer.want(None, false);
                }
                return;
            }
        }
        let seen = self.pictures.seen.as_ref();
        let stays = seen.is_some_and(|seen| seen.since.elapsed() >= PAUSE);
        if !(drawn && stays) {
            return;
        }
        // During a bake, a picture is finished before the next stage's is begun.
        let same = |wanted: &Wanted| Arc::ptr_eq(&wanted.snapshot, &now.snapshot);
        let finished = self
            .pictures
            .detail
            .as_ref()
            .is_some_and(|drawn| drawn.size == size && drawn.of.looks_like(&now));
        let ask = match &self.pictures.wanted {
            None => true,
            Some(wanted) => !same(wanted) && (finished || now.snapshot.progress.done),
        };
        if ask {
            self.pictures.wanted = Some(now.clone());
            self.detailer.want(Some(now), false);
        }
    }
}
