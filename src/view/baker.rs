//! The bake on its own thread and its own Vulkan device, so that no frame waits for it.
//!
//! ```text
//! window ── Order ─► thread: Solver ── Snapshot ─► Latest ─► window
//! ```

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use super::snapshot::{Progress, Snapshot, is_done};
use super::{DeviceChoice, Wake};
use crate::bake;
use crate::elements::Elements;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::solver::{ItemPicture, Settings, Solver, Visibility};

/// What the window asks for.
pub enum Order {
    /// Bakes from nothing.
    Bake {
        scene: Arc<Scene>,
        settings: Box<Settings>,
        epoch: u64,
    },
    /// Lights the scene of the last bake, of which emission and point lights have changed, by the form factors that are kept.
    Relight { scene: Arc<Scene>, epoch: u64 },
    /// Draws what a source sees.
    Items { source: u32 },
}

/// What the thread has found since it was last asked.
#[derive(Default)]
pub struct Latest {
    pub snapshot: Option<Arc<Snapshot>>,
    /// Newer than that of the snapshot, perhaps.
    pub progress: Option<(u64, Progress)>,
    /// `[triangle]` of the input; of a new bake.
    pub sources: Option<Vec<u32>>,
    pub items: Option<ItemPicture>,
    pub error: Option<Error>,
}

/// The window's end of the thread.
pub struct Baker {
    orders: Option<Sender<Order>>,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

struct Shared {
    latest: Mutex<Latest>,
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
    /// `given` is what a relighting without a bake before it is of, and `kept` what was kept with it.
    pub fn new(
        choice: &DeviceChoice,
        given: (Arc<Scene>, Settings),
        kept: Option<Visibility>,
        wake: Wake,
    ) -> Self {
        let (orders, received) = channel();
        let shared = Arc::new(Shared {
            latest: Mutex::default(),
            interrupt: AtomicBool::new(false),
        });
        let work = Work {
            shared: Arc::clone(&shared),
            choice: choice.clone(),
            wake,
            kept_is_whole: kept.is_some(),
            kept,
            given,
            solving: None,
        };
        Self {
            orders: Some(orders),
            shared,
            thread: Some(super::background("bake", move || work.run(&received))),
        }
    }

    pub fn order(&self, order: Order) {
        if let Some(orders) = &self.orders {
            self.shared.interrupt.store(true, Ordering::SeqCst);
            // A thread that has failed has said so.
            let _ = orders.send(order);
        }
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
/// A snapshot costs no more than this share of the bake's time, one over it, unless that makes it wait too long.
const SHARE: u32 = 8;

/// Between two frames that show nothing new but how far the bake is.
const TELLING: Duration = Duration::from_millis(100);

struct Work {
    shared: Arc<Shared>,
    choice: DeviceChoice,
    wake: Wake,
    /// Form factors of the scene, and whether they are those of a bake that was done.
    kept: Option<Visibility>,
    kept_is_whole: bool,
    /// The bake that was asked for last.
    given: (Arc<Scene>, Settings),
    solving: Option<Solving>,
}

/// A bake under way or done.
struct Solving {
    scene: Arc<Scene>,
    solver: Solver,
    /// Before the solver ordered them, with their relief.
    elements: Elements,
    epoch: u64,
    start: Instant,
    slice: Duration,
    done: bool,
}

impl Work {
    fn run(mut self, orders: &Receiver<Order>) {
        loop {
            let busy = self.solving.as_ref().is_some_and(|s| !s.done);
            // An order that comes from here on sets it again.
            self.shared.interrupt.store(false, Ordering::SeqCst);
            let next = match busy {
                true => orders.try_recv(),
                false => orders.recv().map_err(|_| TryRecvError::Disconnected),
            };
            let done = match next {
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) => self.go_on(),
                Ok(order) => self.obey(latest(order, orders)),
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
                self.solving = None;
                self.given = (Arc::clone(&scene), (*settings).clone());
                (self.kept, self.kept_is_whole) = (None, false);
                self.bake(scene, &settings, epoch)
            }
            Order::Relight { scene, epoch } => self.relight(scene, epoch),
            Order::Items { source } => match &self.solving {
                None => Ok(()),
                Some(solving) => {
                    let picture = solving.solver.item_picture(source)?;
                    self.shared.latest().items = Some(picture);
                    (self.wake)();
                    Ok(())
                }
            },
        }
    }

    fn bake(&mut self, scene: Arc<Scene>, settings: &Settings, epoch: u64) -> Result<()> {
        let device = self.choice.open_baking()?;
        let elements = bake::elements(&device, &scene, settings)?;
        let lights = &scene.point_lights;
        let solver = Solver::new(&device, elements.clone(), lights, settings)?;
        self.start(scene, solver, elements, epoch);
        Ok(())
    }

    fn start(&mut self, scene: Arc<Scene>, solver: Solver, elements: Elements, epoch: u64) {
        self.shared.latest().sources = Some(solver.source_of_triangles());
        self.solving = Some(Solving {
            scene,
            solver,
            elements,
            epoch,
            start: Instant::now(),
            slice: Duration::ZERO,
            done: false,
        });
    }

    /// By what is kept; where nothing is, or another source emits than did, from nothing.
    fn relight(&mut self, scene: Arc<Scene>, epoch: u64) -> Result<()> {
        let settings = self.given.1.clone();
        let before = self.solving.take();
        let device = self.choice.open_baking()?;
        if let Some(before) = &before
            && !self.kept_is_whole
        {
            self.kept = before.solver.visibility(&before.scene)?;
            self.kept_is_whole = before.done;
        }
        let Some(kept) = &self.kept else {
            return self.bake(scene, &settings, epoch);
        };
        if kept.check(&scene, &settings).is_err() {
            return self.bake(scene, &settings, epoch);
        }
        let mut elements = match before {
            Some(before) => before.elements,
            None => bake::elements(&device, &scene, &settings)?,
        };
        elements.set_emission(&scene);
        let lights = &scene.point_lights;
        match Solver::relit(&device, elements.clone(), lights, &settings, kept) {
            Ok(solver) => self.start(scene, solver, elements, epoch),
            // What was black and now emits has no source.
            Err(Error::Scene { .. }) => return self.bake(scene, &settings, epoch),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Solves until the next snapshot is due, and makes it.
    fn go_on(&mut self) -> Result<()> {
        let Some(solving) = &mut self.solving else {
            return Ok(());
        };
        let begin = Instant::now();
        let (slice, start, epoch) = (solving.slice, solving.start, solving.epoch);
        let shared = &self.shared;
        let mut last = Progress::default();
        let mut told = begin;
        solving.solver.run(|update| {
            last = Progress {
                shots: update.shots,
                sources: update.sources,
                unshot_share: update.unshot_share,
                error_bound: update.error_bound,
                elapsed: start.elapsed(),
                left: update.left,
                done: false,
            };
            shared.latest().progress = Some((epoch, last));
            if told.elapsed() >= TELLING {
                told = Instant::now();
                (self.wake)();
            }
            begin.elapsed() < slice && !shared.interrupt.load(Ordering::SeqCst)
        })?;
        let report = solving.solver.report();
        solving.done = is_done(report.stop);
        let progress = Progress {
            shots: report.shots,
            sources: report.sources as u32,
            unshot_share: report.unshot_share,
            error_bound: report.error_bound,
            elapsed: start.elapsed(),
            done: solving.done,
            ..last
        };
        let solved = Instant::now();
        let (scene, solver) = (&solving.scene, &solving.solver);
        let snapshot = Snapshot::of_solver(epoch, scene, solver, progress)?;
        let cost = solved.elapsed();
        // The first snapshot is there after one batch; later ones come less and less often.
        let [shortest, longest] = SLICES;
        let fair = (cost * SHARE).max(2 * slice).clamp(shortest, longest);
        solving.slice = fair.max(cost);
        {
            let mut latest = shared.latest();
            latest.progress = Some((epoch, progress));
            latest.snapshot = Some(Arc::new(snapshot));
        }
        (self.wake)();
        Ok(())
    }
}

/// Of orders to light or to bake that wait, the last: a light that is dragged leaves many behind.
fn latest(first: Order, orders: &Receiver<Order>) -> Order {
    let mut wanted = first;
    while let Ok(next) = orders.try_recv() {
        wanted = match (wanted, next) {
            // A bake is of another scene; what is to be lit is that one then.
            (Order::Bake { settings, .. }, Order::Relight { scene, epoch }) => Order::Bake {
                scene,
                settings,
                epoch,
            },
            (wanted, Order::Items { .. }) if !matches!(wanted, Order::Items { .. }) => wanted,
            (_, next) => next,
        };
    }
    wanted
}
