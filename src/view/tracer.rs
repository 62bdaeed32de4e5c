//! Views by the path tracer, on threads of the CPU, pass by pass for as long as a view stays.

use std::sync::Arc;
use std::time::Duration;

use super::detailer::{Drawn, Wanted, codes};
use super::worker::{self, Worker};
use super::{Wake, background};
use crate::error::Result;
use crate::path_tracer::{PathTracer, Settings};
use crate::picture::View;
use crate::scene::{Scene, displace};

/// Paths of each pixel, at most.
const PATHS: u32 = 1 << 16;

/// A picture so far.
pub struct Traced {
    pub drawn: Drawn,
    /// Paths of each pixel.
    pub paths: u32,
    pub elapsed: Duration,
    /// Root mean square of the pixels' relative standard error.
    pub noise: f64,
}

/// The window's end of the thread.
pub type Tracer = Worker<Wanted, Traced>;

type Desk = worker::Desk<Wanted, Traced>;

pub fn tracer(wake: Wake) -> Tracer {
    Worker::new(|work| background("path tracer", work), wake, run)
}

fn run(desk: &Desk) {
    // The scene with its relief as geometry.
    let mut ready: Option<(Arc<Scene>, Scene)> = None;
    while let Some((wanted, number)) = desk.next() {
        let scene = &wanted.snapshot.scene;
        let same = ready.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, scene));
        let done = match same {
            true => Ok(()),
            false => geometry(scene).map(|fine| ready = Some((Arc::clone(scene), fine))),
        };
        let done = done.and_then(|()| match &ready {
            Some((_, fine)) => trace(fine, &wanted, number, desk),
            None => Ok(()),
        });
        if let Err(error) = done {
            desk.fail(error);
        }
    }
}

fn geometry(scene: &Scene) -> Result<Scene> {
    match scene.materials.iter().any(|m| m.has_relief()) {
        true => displace(scene),
        false => Ok(scene.clone()),
    }
}

fn trace(scene: &Scene, wanted: &Wanted, number: u64, desk: &Desk) -> Result<()> {
    let tracer = PathTracer::new(scene)?;
    let view = View {
        camera: &wanted.camera,
        width: wanted.size.0,
        height: wanted.size.1,
    };
    let settings = Settings {
        paths: PATHS,
        light: wanted.part,
        ..Settings::default()
    };
    tracer.render(&view, &settings, |progress, film| {
        if desk.is_overtaken(number) {
            return false;
        }
        let picture = film.picture();
        desk.give(Traced {
            drawn: Drawn {
                of: wanted.clone(),
                codes: codes(&picture, [0, 0], wanted.exposure),
                picture: Some(Arc::new(picture)),
                is_whole: true,
                seconds: progress.elapsed.as_secs_f64(),
            },
            paths: progress.paths,
            elapsed: progress.elapsed,
            noise: film.relative_error(),
        });
        !desk.is_overtaken(number)
    })?;
    Ok(())
}
