//! Views by the path tracer, on threads of the CPU, pass by pass for as long as a view stays.

use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::Duration;

use super::detailer::{Drawn, Wanted, codes};
use super::{Wake, background};
use crate::error::{Error, Result};
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
pub struct Tracer {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    wanted: Option<Wanted>,
    /// Number of requests so far: a new one stops the picture in progress.
    asked: u64,
    traced: Option<Traced>,
    error: Option<Error>,
    closing: bool,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn is_overtaken(&self, asked: u64) -> bool {
        let state = self.state();
        state.closing || state.asked != asked
    }
}

impl Tracer {
    pub fn new(wake: Wake) -> Self {
        let shared = Arc::<Shared>::default();
        let work = Arc::clone(&shared);
        let thread = background("path tracer", move || run(&work, &wake));
        Self {
            shared,
            thread: Some(thread),
        }
    }

    /// Replaces the wanted picture; None wants none.
    pub fn want(&self, wanted: Option<Wanted>) {
        {
            let mut state = self.shared.state();
            state.asked += 1;
            state.wanted = wanted;
        }
        self.shared.changed.notify_all();
    }

    /// The latest picture since the last call.
    pub fn take(&self) -> Option<Traced> {
        self.shared.state().traced.take()
    }

    /// What ended the last picture.
    pub fn error(&self) -> Option<Error> {
        self.shared.state().error.take()
    }
}

impl Drop for Tracer {
    fn drop(&mut self) {
        self.shared.state().closing = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn run(shared: &Shared, wake: &Wake) {
    // The scene with its relief as geometry.
    let mut ready: Option<(Arc<Scene>, Scene)> = None;
    loop {
        let (wanted, asked) = {
            let mut state = shared.state();
            loop {
                if state.closing {
                    return;
                }
                if let Some(wanted) = state.wanted.take() {
                    break (wanted, state.asked);
                }
                state = (shared.changed.wait(state)).unwrap_or_else(|e| e.into_inner());
            }
        };
        let scene = &wanted.snapshot.scene;
        let same = ready.as_ref().is_some_and(|(of, _)| Arc::ptr_eq(of, scene));
        let done = match same {
            true => Ok(()),
            false => geometry(scene).map(|fine| ready = Some((Arc::clone(scene), fine))),
        };
        let done = done.and_then(|()| match &ready {
            Some((_, fine)) => trace(fine, (&wanted, asked), shared, wake),
            None => Ok(()),
        });
        if let Err(error) = done {
            shared.state().error = Some(error);
            wake();
        }
    }
}

fn geometry(scene: &Scene) -> Result<Scene> {
    match scene.materials.iter().any(|m| m.has_relief()) {
        true => displace(scene),
        false => Ok(scene.clone()),
    }
}

fn trace(
    scene: &Scene,
    (wanted, asked): (&Wanted, u64),
    shared: &Shared,
    wake: &Wake,
) -> Result<()> {
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
        if shared.is_overtaken(asked) {
            return false;
        }
        let picture = film.picture();
        shared.state().traced = Some(Traced {
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
        wake();
        !shared.is_overtaken(asked)
    })?;
    Ok(())
}
