//! Light of point lights that have just been changed, and of emitters that have moved: what they
//! bring to the middle of each triangle, by rays on the CPU, in place of what they brought before.
//! It is there before a frame is drawn, and shown until the baker has solved the same lights.

mod lights;
mod rays;
#[cfg(test)]
mod tests;

use std::sync::Arc;
use std::time::Instant;

use rayon::{ThreadPool, ThreadPoolBuilder};

use super::corner_light::CornerLight;
use super::snapshot::Snapshot;
use super::worker::{self, Worker};
use super::{Wake, foreground};
use crate::error::{Error, Result};
use crate::scene::Scene;
pub use lights::is_possible;
use lights::{changes, moved};
use rays::Rays;

/// Lights to be sketched.
pub struct Wanted {
    /// The last light that was solved, of other lights on the same triangles.
    pub base: Arc<Snapshot>,
    /// The scene with its lights as they are now.
    pub scene: Arc<Scene>,
    pub epoch: u64,
    /// When they were changed.
    pub since: Instant,
}

/// Light of the lights of `epoch`.
pub struct Sketch {
    pub epoch: u64,
    /// When they were changed.
    pub since: Instant,
    pub light: CornerLight,
}

/// The window's end of the thread.
pub type Sketcher = Worker<Wanted, Sketch>;

/// A thread of the window's own priority: it works for the next frame.
pub fn sketcher(wake: Wake) -> Sketcher {
    Worker::new(|work| foreground("sketch", work), wake, run)
}

fn run(desk: &worker::Desk<Wanted, Sketch>) {
    let mut ready: Option<(ThreadPool, Rays)> = None;
    while let Some((wanted, _)) = desk.next() {
        let moved = moved(&wanted.base.scene, &wanted.scene);
        match &ready {
            // Emitters that may move next are found when they do.
            Some((_, rays)) if moved.iter().all(|m| rays.without.contains(m)) => {}
            _ => match start(ready.take(), &wanted.scene, moved) {
                Ok(started) => ready = Some(started),
                Err(error) => {
                    desk.fail(error);
                    continue;
                }
            },
        }
        let Some((pool, rays)) = &mut ready else {
            continue;
        };
        let changes = changes(&wanted);
        if changes.is_empty() {
            pool.install(|| rays.prepare(&wanted.base));
            continue;
        }
        let light = pool.install(|| rays.sketch(&wanted.base, &changes));
        desk.give(Sketch {
            epoch: wanted.epoch,
            since: wanted.since,
            light,
        });
    }
}

/// Threads of the priority of this one, and the triangles that they ask: all but those of these
/// materials, and of those that were left out before.
fn start(
    before: Option<(ThreadPool, Rays)>,
    scene: &Scene,
    mut without: Vec<usize>,
) -> Result<(ThreadPool, Rays)> {
    let pool = match before {
        Some((pool, rays)) => {
            without.extend(rays.without);
            pool
        }
        None => ThreadPoolBuilder::new()
            .build()
            .map_err(|error| Error::Usage(format!("threads for the window: {error}")))?,
    };
    let rays = pool.install(|| Rays::new(scene, without));
    Ok((pool, rays))
}
