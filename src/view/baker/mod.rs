//! The bake on its own thread and its own Vulkan device, so that no frame waits for it.
//!
//! ```text
//! window ── Order ─► thread: Solver ── Snapshot ─► Latest ─► window
//! ```

mod first_light;
mod relighting;
mod saves;

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::orders::{Given, Latest, Order, Stage};
use super::snapshot::{About, Progress, Snapshot, is_done};
use super::{DeviceChoice, Wake};
use crate::bake;
use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::scene::Scene;
use crate::solver::{Settings, Solver, StopReason, Update, Visibility};
use first_light::{first_light, first_stage, flat, raises};
use relighting::Relit;
pub use saves::Saves;
use saves::Saving;

/// The window's end of the thread.
pub struct Baker {
    orders: Option<Sender<Order>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    latest: Mutex<Latest>,
    saving: Saving,
    /// Orders wait, or the window closes: stop at the next batch.
    interrupt: AtomicBool,
}

impl Shared {
    fn latest(&self) -> MutexGuard<'_, Latest> {
        self.latest.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Baker {
    /// Starts the thread, which opens its device with the first order.
    /// `given` is what a relighting without a bake before it is of; `kept` are its rows.
    pub fn new(
        choice: &DeviceChoice,
        given: Given,
        kept: Option<Visibility>,
        saves: Saves,
        wake: Wake,
    ) -> Self {
        let (orders, received) = channel();
        let shared = Arc::new(Shared {
            latest: Mutex::default(),
            saving: Saving::default(),
            interrupt: AtomicBool::new(false),
        });
        let work = Work {
            shared: Arc::clone(&shared),
            choice: choice.clone(),
            wake,
            kept,
            given,
            saves,
            solving: None,
            looked_at: None,
            shown: None,
            shown_at: Instant::now(),
        };
        Self {
            orders: Some(orders),
            shared,
            thread: Some(super::background("bake", move || work.run(&received))),
        }
    }

    pub fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            // A thread that has failed has said so.
            let _ = orders.send(order);
            // Earlier, the thread might clear it before the order is there.
            self.shared.interrupt.store(true, Ordering::SeqCst);
        }
    }

    /// Saves the bake as it is.
    pub fn save(&self, path: PathBuf) {
        self.shared.saving.ask(path);
        self.order(Order::Save);
    }

    /// Bakes that were saved, or not, since the last call.
    pub fn saved(&self) -> Vec<(PathBuf, Result<()>)> {
        self.shared.saving.done()
    }

    /// Whether there is a solution that can be saved.
    pub fn has_solved(&self) -> bool {
        self.shared.saving.is_possible()
    }

    /// Whether there is a snapshot that has not been taken.
    pub fn has_light(&self) -> bool {
        self.shared.latest().snapshot.is_some()
    }

    /// What is new.
    pub fn take(&self) -> Latest {
        std::mem::take(&mut self.shared.latest())
    }
}

impl Drop for Baker {
    fn drop(&mut self) {
        self.orders = None;
        self.shared.interrupt.store(true, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Shortest and longest time between two snapshots of a bake.
const SLICES: [Duration; 2] = [Duration::from_millis(100), Duration::from_secs(2)];
/// A snapshot costs no more than this share of the bake's time, one over it, unless that makes it
/// wait too long.
const SHARE: u32 = 8;

/// How long a scene has a first light, coarse and as if its relief were flat, before the bake that
/// was asked for begins.
const FIRST: Duration = Duration::from_secs(2);

/// Between two frames that show nothing new but how far the bake is.
const TELLING: Duration = Duration::from_millis(100);

struct Work {
    shared: Arc<Shared>,
    choice: DeviceChoice,
    wake: Wake,
    /// Form factors of the scene, of a bake from a file.
    kept: Option<Visibility>,
    /// The bake that was asked for last.
    given: Given,
    saves: Saves,
    solving: Option<Solving>,
    /// Of a bake from a file: its sources, which nobody solves.
    looked_at: Option<Solver>,
    /// The last light that was found, and when.
    shown: Option<Arc<Snapshot>>,
    shown_at: Instant,
}

/// A bake under way or done.
struct Solving {
    scene: Arc<Scene>,
    about: Arc<About>,
    solver: Solver,
    epoch: u64,
    start: Instant,
    slice: Duration,
    budget: Duration,
    done: bool,
    /// A first light, after which the bake begins that was asked for.
    first: bool,
    /// After its lights were changed: what is shown next.
    relit: Option<Relit>,
    /// Whether what its lights emit is shown already.
    sketched: bool,
    /// Share of unshot light from which on there is more to be seen than before this was begun.
    shown_from: f64,
}

impl Solving {
    fn is_busy(&self) -> bool {
        self.first || !self.done
    }

    /// What the solver reports; the rest is of its `last` update.
    fn progress(&self, last: Update, done: bool) -> Progress {
        let report = self.solver.report();
        Progress {
            update: Update {
                shots: report.shots,
                sources: report.sources as u32,
                unshot_share: report.unshot_share,
                error_bound: report.error_bound,
                elapsed: self.start.elapsed(),
                ..last
            },
            done,
        }
    }
}

impl Work {
    fn run(mut self, orders: &Receiver<Order>) {
        loop {
            self.save();
            let busy = self.solving.as_ref().is_some_and(Solving::is_busy);
            // An order that comes from here on sets it again.
            self.shared.interrupt.store(false, Ordering::SeqCst);
            let next = match busy {
                true => orders.try_recv(),
                false => orders.recv().map_err(|_| TryRecvError::Disconnected),
            };
            let done = match next {
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => self.go_on(),
                Ok(order) => {
                    let order = latest(order, orders);
                    // A light that is dragged is shown on its way, however fast orders come.
                    let lights = matches!(order, Order::Relight { .. });
                    let done = self.obey(order);
                    match lights {
                        true => done.and_then(|()| self.go_on()),
                        false => done,
                    }
                }
            };
            if let Err(error) = done {
                self.solving = None;
                self.shared.latest().error = Some(error);
                (self.wake)();
            }
        }
    }

    fn obey(&mut self, order: Order) -> Result<()> {
        match order {
            Order::Bake {
                scene,
                settings,
                epoch,
            } => {
                // Frees its memory before the new one asks for more.
                (self.solving, self.looked_at, self.shown) = (None, None, None);
                self.given = Given {
                    scene: Arc::clone(&scene),
                    settings: (*settings).clone(),
                };
                self.kept = None;
                self.bake(scene, &settings, epoch)
            }
            Order::Relight {
                scene,
                epoch,
                sketched,
            } => self.relight(scene, epoch, sketched),
            // At the next turn.
            Order::Save => Ok(()),
            Order::Sources => self.sources().map(|_| ()),
            Order::Items { source } => {
                let picture = self.sources()?.item_picture(source)?;
                self.shared.latest().items = Some(picture);
                (self.wake)();
                Ok(())
            }
        }
    }

    /// A solver with the sources of what is shown: the one under way; of a bake from a file one
    /// that is never run, of elements without relief, whose preparation would take long.
    fn sources(&mut self) -> Result<&Solver> {
        if let Some(solving) = &self.solving {
            return Ok(&solving.solver);
        }
        let solver = match self.looked_at.take() {
            Some(solver) => solver,
            None => {
                let device = self.choice.open_baking()?;
                let Given { scene, settings } = &self.given;
                let settings = Settings {
                    visibility_memory: Some(0),
                    ..flat(settings)
                };
                let elements = Elements::new(scene);
                let solver = Solver::new(&device, elements, &scene.lights, &settings)?;
                self.shared.latest().sources = Some(solver.source_of_triangles());
                (self.wake)();
                solver
            }
        };
        Ok(self.looked_at.insert(solver))
    }

    fn tell(&self, epoch: u64, stage: Option<Stage>) {
        self.shared.latest().stage = Some((epoch, stage));
        (self.wake)();
    }

    fn bake(&mut self, scene: Arc<Scene>, settings: &Settings, epoch: u64) -> Result<()> {
        self.tell(epoch, Some(Stage::Device));
        let device = self.choice.open_baking()?;
        self.tell(epoch, Some(Stage::Scene));
        let lights = &scene.lights;
        if let Some(quick) = first_light(&scene, settings) {
            // What takes longest comes after the first light.
            let elements = Elements::about(&scene);
            let solver = Solver::new(&device, elements, lights, &quick)?;
            let stage = first_stage(&scene, settings);
            self.start(scene, solver, epoch, None);
            if let Some(solving) = &mut self.solving {
                solving.first = true;
            }
            self.tell(epoch, Some(stage));
            return Ok(());
        }
        let elements = bake::elements(&device, &scene, settings)?;
        let solver = Solver::new(&device, elements, lights, settings)?;
        self.start(scene, solver, epoch, None);
        Ok(())
    }

    /// Begins the bake that was asked for, of what has its first light.
    fn raise(&mut self) -> Result<()> {
        let Some(first) = self.solving.take() else {
            return Ok(());
        };
        let unshot = first.solver.report().unshot_share;
        let Solving {
            scene,
            about,
            epoch,
            ..
        } = first;
        let settings = self.given.settings.clone();
        self.tell(
            epoch,
            Some(match raises(&scene, &settings) {
                true => Stage::Relief,
                false => Stage::Scene,
            }),
        );
        let device = self.choice.open_baking()?;
        let elements = bake::elements(&device, &scene, &settings)?;
        let lights = &scene.lights;
        let solver = Solver::new(&device, elements, lights, &settings)?;
        self.start(scene, solver, epoch, Some(about));
        if let Some(solving) = &mut self.solving {
            solving.shown_from = unshot;
        }
        Ok(())
    }

    /// `about` is of the scene, where it is known.
    fn start(&mut self, scene: Arc<Scene>, solver: Solver, epoch: u64, about: Option<Arc<About>>) {
        self.shared.latest().sources = Some(solver.source_of_triangles());
        self.tell(epoch, None);
        self.looked_at = None;
        self.solving = Some(Solving {
            budget: self.given.settings.budget.unwrap_or(Duration::MAX),
            first: false,
            relit: None,
            sketched: false,
            about: about.unwrap_or_else(|| Arc::new(About::new(&scene))),
            shown_from: f64::INFINITY,
            scene,
            solver,
            epoch,
            start: Instant::now(),
            slice: Duration::ZERO,
            done: false,
        });
    }

    fn show(&mut self, epoch: u64, progress: Progress, snapshot: Snapshot) {
        let snapshot = Arc::new(snapshot);
        self.shown = Some(Arc::clone(&snapshot));
        self.shown_at = Instant::now();
        {
            let mut latest = self.shared.latest();
            latest.progress = Some((epoch, progress));
            latest.snapshot = Some(snapshot);
        }
        (self.wake)();
    }

    /// Solves until the next snapshot is due, and makes it.
    fn go_on(&mut self) -> Result<()> {
        if self.show_relit()? {
            return Ok(());
        }
        let Some(solving) = &mut self.solving else {
            return Ok(());
        };
        if solving.first && (solving.done || solving.start.elapsed() >= FIRST) {
            return self.raise();
        }
        let begin = Instant::now();
        let (slice, start, epoch) = (solving.slice, solving.start, solving.epoch);
        let budget = solving.budget;
        let shared = &self.shared;
        let mut last = Update::default();
        let mut told = begin;
        solving.solver.turn(|update| {
            last = Update {
                elapsed: start.elapsed(),
                ..*update
            };
            let done = false;
            shared.latest().progress = Some((epoch, Progress { update: last, done }));
            if told.elapsed() >= TELLING {
                told = Instant::now();
                (self.wake)();
            }
            (!update.draws || begin.elapsed() < slice)
                && start.elapsed() < budget
                && !shared.interrupt.load(Ordering::SeqCst)
        })?;
        // The budget is that of the bake, not of a slice.
        let stop = solving.solver.report().stop;
        solving.done = is_done(stop) || start.elapsed() >= budget;
        shared.saving.allow(!solving.first);
        // What was asked meanwhile comes first; of other lights this would be out of date.
        if stop == StopReason::Interrupted && shared.interrupt.load(Ordering::SeqCst) {
            return Ok(());
        }
        let progress = solving.progress(last, solving.done && !solving.first);
        if !solving.done && progress.update.unshot_share > solving.shown_from {
            solving.slice = SLICES[0];
            shared.latest().progress = Some((epoch, progress));
            (self.wake)();
            return Ok(());
        }
        let solved = Instant::now();
        solving.solver.gather()?;
        let (scene, solver) = (&solving.scene, &solving.solver);
        let snapshot = Snapshot::of_solver(epoch, scene, &solving.about, solver, progress)?;
        let cost = solved.elapsed();
        // The first snapshot is there after one batch; later ones come less and less often.
        let [shortest, longest] = SLICES;
        let fair = (cost * SHARE).max(2 * slice).clamp(shortest, longest);
        solving.slice = fair.max(cost);
        self.show(epoch, progress, snapshot);
        Ok(())
    }
}

/// Of orders to light or to bake that wait, the last: a light that is dragged leaves many behind.
fn latest(first: Order, orders: &Receiver<Order>) -> Order {
    let mut wanted = first;
    while let Ok(next) = orders.try_recv() {
        wanted = match (wanted, next) {
            // A bake is of another scene; what is to be lit is that one then.
            (Order::Bake { settings, .. }, Order::Relight { scene, epoch, .. }) => Order::Bake {
                scene,
                settings,
                epoch,
            },
            // Its sources will be told.
            (
                wanted @ (Order::Bake { .. } | Order::Relight { .. }),
                Order::Items { .. } | Order::Sources,
            ) => wanted,
            (wanted, Order::Save) => wanted,
            (_, next) => next,
        };
    }
    wanted
}
