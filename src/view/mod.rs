//! A window that shows a scene while it bakes.
//!
//! ```text
//! system, script ─► Event ─► Viewer ─┬─► Panel (egui) ─────────┐
//!                                    ├─► SurfacePass ──────────┼─► Screen ─► the window
//!            Baker ─► Snapshot ─────►┤                         │
//!                     Sketcher ─────►┤                         │
//!                      Detailer ────►┴─► the detailed picture ─┘
//! ```
//!
//! Three threads, each with a Vulkan device of its own, exchange results in host memory. The
//! window's thread draws frames with the light at the corners; the baker's thread solves; the
//! detailer's thread draws the view as `render` does while it stays. No frame waits for the other
//! two threads. A software driver shares its own threads between the devices of an instance, so
//! that each device has its own instance too; and the other two threads, with all that they start,
//! run at a lower priority. What a light that is moved brings directly is found by rays on the CPU
//! first, by a thread of the window's priority (`sketch`).

mod backdrop;
mod baker;
mod camera;
mod compare;
mod corner_light;
mod detailer;
mod event;
mod history;
mod lamps;
mod listing;
mod meter;
mod notes;
mod orders;
mod overlay;
mod panel;
mod panel_pass;
mod pick;
mod recent;
mod runner;
mod screen;
mod script;
mod sketch;
mod slopes;
mod snapshot;
mod surface_mesh;
mod surface_pass;
mod switches;
mod timing;
mod tracer;
mod viewer;
mod watch;
mod window;
mod worker;

use std::path::Path;
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Instant;

use crate::bake::solution::{Bake, Solution};
use crate::error::Result;
use crate::scene::{Camera, Scene};
use crate::solver::{self, Settings, Visibility};
use crate::vk::{Device, Instance};

pub use script::{Step, read as read_script};
pub use window::run;

/// Options of the window.
pub struct Options {
    pub opened: Opened,
    pub session: Session,
    /// Pixels across and down.
    pub size: (u32, u32),
    /// Steps done in place of the user; the window closes at their end.
    pub script: Option<Vec<Step>>,
    /// When the program started.
    pub start: Instant,
}

/// A scene, read for the window.
pub struct Opened {
    /// What [`Session::open`] takes for it.
    pub name: String,
    pub scene: Scene,
    /// A solution; None bakes the scene.
    pub bake: Option<Bake>,
    /// Visibility kept with the solution, for relighting.
    pub kept: Option<Visibility>,
    pub camera: Camera,
}

/// What stays while one scene of a window follows another.
#[derive(Clone)]
pub struct Session {
    pub settings: Settings,
    pub device: DeviceChoice,
    /// Scenes that the panel offers, by what `open` takes.
    pub offered: Arc<[String]>,
    /// Reads a scene or a bake: a name of `offered`, or a file dropped on the window.
    pub open: Open,
    pub save: Save,
}

/// Reads a scene by its name or path.
pub type Open = Arc<dyn Fn(&str) -> Result<Opened> + Send + Sync>;

/// Writes a solution of a scene, opened by its name and solved by these settings, to a file.
pub type Save = Arc<dyn Fn(&Path, &str, &Scene, &Solution, &Settings) -> Result<()> + Send + Sync>;

/// Tells the window that there is something new.
type Wake = Arc<dyn Fn() + Send + Sync>;

/// The choice of device, validation, and the baking device once it is open.
#[derive(Clone, Default)]
pub struct DeviceChoice {
    /// Index or part of the name; None chooses the best one.
    pub wanted: Option<String>,
    pub validation: bool,
    baking: Arc<Mutex<Option<Arc<Device>>>>,
}

impl DeviceChoice {
    pub fn new(wanted: Option<String>, validation: bool) -> Self {
        Self {
            wanted,
            validation,
            baking: Arc::default(),
        }
    }

    /// The device that bakes; it is tested when it is first opened.
    fn open_baking(&self) -> Result<Arc<Device>> {
        let mut baking = self.baking.lock().unwrap_or_else(|e| e.into_inner());
        match &*baking {
            Some(device) => Ok(Arc::clone(device)),
            None => {
                let device = solver::open_device(self.wanted.as_deref(), self.validation)?;
                Ok(Arc::clone(baking.insert(device)))
            }
        }
    }

    /// A device that draws detailed pictures.
    fn open_drawing(&self) -> Result<Arc<Device>> {
        let instance = Instance::new(self.validation)?;
        let candidate = solver::choose_device(&instance, self.wanted.as_deref())?;
        Device::new(&instance, &candidate)
    }
}

/// Niceness of the threads that no frame waits for.
#[cfg(target_os = "linux")]
const NICENESS: i32 = 10;

/// Gives this thread a lower priority than frames have; threads that it starts, and those of
/// drivers that it loads, inherit it. Threads that share work are to call it as they start.
pub fn give_way() {
    // On Linux this applies to this thread only; if it is refused, frames are slower.
    #[cfg(target_os = "linux")]
    let _ = rustix::process::setpriority_process(None, NICENESS);
}

/// Starts a thread that gives way.
fn background(name: &str, work: impl FnOnce() + Send + 'static) -> JoinHandle<()> {
    foreground(name, move || {
        give_way();
        work();
    })
}

/// Starts a thread of the priority of this one.
fn foreground(name: &str, work: impl FnOnce() + Send + 'static) -> JoinHandle<()> {
    let started = std::thread::Builder::new()
        .name(name.to_owned())
        .spawn(work);
    started.expect("the system has room for another thread")
}
