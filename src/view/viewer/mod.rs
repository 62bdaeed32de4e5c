//! The window's state: what it shows, and how it changes.

mod compare;
mod files;
mod frame;
mod input;
mod layout;
mod lighting;
mod moving;
mod overlays;
mod pictures;
mod update;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use glam::Vec3;
use winit::window::Window;

use super::backdrop::Subject;
use super::baker::{Baker, Saves};
use super::camera::Eye;
use super::compare::{Left, Line};
use super::detailer::{Detailer, PAUSE};
use super::event::Event;
use super::history::History;
use super::lamps::{Lamp, lamps};
use super::notes::Notes;
use super::orders::{Given, Order, Stage};
use super::panel_pass::PanelPass;
use super::screen::Screen;
use super::sketch::{Sketcher, sketcher};
use super::snapshot::{Progress, Snapshot};
use super::surface_pass::SurfacePass;
use super::switches::Switches;
use super::timing::Timing;
use super::watch::{self, Watch};
use super::{Opened, Session, Wake};
use crate::error::Result;
use crate::render::Light;
use crate::scene::{Camera, Scene};
use crate::solver::{Estimator, Settings};
use files::Files;
use input::Input;
use lighting::Edited;
use overlays::Overlays;
use pictures::Pictures;

pub struct Viewer {
    baker: Baker,
    detailer: Detailer,
    sketcher: Sketcher,
    surfaces: SurfacePass,
    panel_pass: PanelPass,
    pub(super) screen: Screen,
    /// Pixels of the window, across and down.
    pub(super) size: (u32, u32),
    /// Whether the window's images must be recreated.
    stale: bool,
    pub(super) scale: f32,

    /// The scene as it was read.
    base: Scene,
    /// The scene with the lights and the scale of relief as they are now.
    pub(super) scene: Arc<Scene>,
    /// The scene of the bake that was ordered last, or that was opened.
    ordered: Arc<Scene>,
    /// Of the bake as it is, and as it was asked for.
    settings: Settings,
    first_settings: Settings,
    pub(super) eye: Eye,
    pub(super) next_camera: usize,
    pub(super) switches: Switches,
    pub(super) lamps: Vec<Lamp>,
    pub(super) lamp: usize,
    pub(super) directions: u32,
    /// Whether the bake is by the paper's method.
    pub(super) paper: bool,
    pub(super) relief_scale: f64,

    snapshot: Arc<Snapshot>,
    /// Of what a sketch is shown in place of the snapshot's light.
    sketched: Option<u64>,
    pub(super) epoch: u64,
    progress: Progress,
    bounds: Vec<[f64; 2]>,
    overlays: Overlays,
    stage: Option<Stage>,
    /// Stops of the exposure, without those set by the user.
    metered: f32,
    /// Number of lights shown so far.
    lights: u64,
    pictures: Pictures,
    /// What the view is compared to, and where the two meet.
    left: Option<Left>,
    pub(super) line: Line,
    /// How far they are apart.
    apart: Vec<String>,
    /// What the sky behind the surfaces was drawn for.
    backdrop: Option<Subject>,
    notes: Notes,
    history: History,
    /// The lights as they were last lit, and as they were read.
    lit_lamps: Vec<Lamp>,
    first_lamps: Vec<Lamp>,
    /// Whether the exposure follows the light: not while lights are edited.
    metering: bool,
    /// The scene that is shown, as [`Session::open`] takes it.
    pub(super) name: String,
    files: Files,
    /// Looks at the files of the scene, and whether they have changed.
    #[expect(dead_code, reason = "it works until it is dropped")]
    watch: Option<Watch>,
    watched: Arc<AtomicBool>,
    wake: Wake,
    /// Scenes that the panel offers.
    offered: Arc<[String]>,
    /// The scene that is to replace this one.
    pub(super) opening: Option<String>,
    /// Paths of pictures that are being saved.
    pub(super) saving: Vec<PathBuf>,

    pub(super) egui: egui::Context,
    pub(super) input: Input,
    /// When the panel asks to be redrawn.
    repaint: Option<Instant>,
    pub(super) dirty: bool,
    pub(super) edited: Option<Edited>,
    /// Time of the first input that no frame has answered yet.
    pub(super) unanswered: Option<Instant>,
    last_frame: Instant,
    /// The epoch when it began.
    framed: u64,
    start: Instant,
    pub(super) timing: Timing,
    pub(super) capture: Option<PathBuf>,
    /// Where the next frame writes what it shows.
    pub(super) listing: Option<PathBuf>,
    pub(super) closing: bool,
}

/// Shortest time between frames while there is no light to show: a software device draws them with
/// the cores that the bake needs.
const DARK: Duration = Duration::from_millis(300);
/// Time that a frame waits for the sketch of changed lights, which is to be seen in it.
const SKETCHING: Duration = Duration::from_millis(50);
/// Name of pictures that are saved by a key, in the working directory.
const PICTURE: &str = "mesolux";

/// Index of the camera that the first key press shows: the one after `camera`.
fn camera_after(scene: &Scene, camera: &Camera) -> usize {
    let shown = scene.cameras.iter().position(|c| c == camera);
    shown.map_or(0, |i| (i + 1) % scene.cameras.len())
}

impl Viewer {
    /// # Errors
    /// A display or a device that fails; a scene that does not fit the device.
    pub fn new(
        opened: Opened,
        session: &Session,
        window: &Arc<Window>,
        size: (u32, u32),
        start: Instant,
        wake: Wake,
    ) -> Result<Self> {
        let Opened {
            name,
            scene: base,
            bake,
            kept,
            camera,
        } = opened;
        let Session {
            settings, device, ..
        } = session.clone();
        let scene = Arc::new(base.clone());
        let shown_lamps = lamps(&base);
        // The bake begins while the window opens its device.
        let given = Given {
            scene: Arc::clone(&scene),
            settings: settings.clone(),
        };
        let saves = Saves {
            name: name.clone(),
            save: Arc::clone(&session.save),
        };
        let baker = Baker::new(&device, given, kept, saves, Arc::clone(&wake));
        let snapshot = Arc::new(match bake {
            Some(bake) => Snapshot::of_bake(&scene, bake),
            None => {
                baker.order(Order::Bake {
                    scene: Arc::clone(&scene),
                    settings: Box::new(settings.clone()),
                    epoch: 0,
                });
                Snapshot::unlit(&scene)
            }
        });
        let screen = Screen::new(window, size, &device)?;
        let surfaces = SurfacePass::new(screen.device(), screen.pass(), &scene)?;
        let watched = Arc::new(AtomicBool::new(false));
        let on_change: Wake = {
            let (watched, wake) = (Arc::clone(&watched), Arc::clone(&wake));
            Arc::new(move || {
                watched.store(true, Ordering::SeqCst);
                wake();
            })
        };
        let egui = egui::Context::default();
        egui.set_theme(egui::Theme::Dark);
        let mut viewer = Self {
            baker,
            detailer: Detailer::new(&device, settings.relief.cache.clone(), Arc::clone(&wake)),
            sketcher: sketcher(Arc::clone(&wake)),
            surfaces,
            panel_pass: PanelPass::new(screen.device(), screen.pass())?,
            screen,
            size,
            stale: false,
            scale: 1.0,
            eye: Eye::new(&scene, &camera),
            next_camera: camera_after(&scene, &camera),
            switches: Switches::default(),
            lamps: shown_lamps.clone(),
            lamp: 0,
            directions: settings.relief.directions.count() as u32,
            paper: settings.estimator == Estimator::Paper,
            relief_scale: 1.0,
            wake: Arc::clone(&wake),
            watch: Watch::new(watch::files(&name, &base), on_change),
            watched,
            files: Files::default(),
            first_lamps: shown_lamps.clone(),
            first_settings: settings.clone(),
            base,
            ordered: Arc::clone(&scene),
            scene,
            settings,
            progress: snapshot.progress,
            epoch: 0,
            bounds: Vec::new(),
            overlays: Overlays::default(),
            stage: None,
            metered: snapshot.exposure,
            lights: 0,
            snapshot,
            sketched: None,
            pictures: Pictures::default(),
            left: None,
            line: Line::default(),
            apart: Vec::new(),
            backdrop: None,
            notes: Notes::default(),
            history: History::default(),
            lit_lamps: shown_lamps.clone(),
            metering: true,
            offered: Arc::clone(&session.offered),
            name,
            opening: None,
            saving: Vec::new(),
            egui,
            input: Input::default(),
            repaint: None,
            dirty: true,
            edited: None,
            unanswered: None,
            last_frame: Instant::now(),
            framed: 0,
            start,
            timing: Timing::default(),
            capture: None,
            listing: None,
            closing: false,
        };
        let snapshot = &viewer.snapshot;
        viewer
            .surfaces
            .set_light(&snapshot.scene, &snapshot.at_corners);
        viewer.remember();
        Ok(viewer)
    }

    /// Whether a bake is under way.
    pub fn is_baking(&self) -> bool {
        !self.progress.done
    }

    /// Whether the light shown is that of a finished bake, and no other scene is to be shown.
    pub fn is_baked(&self) -> bool {
        self.opening.is_none() && self.snapshot.epoch == self.epoch && self.snapshot.progress.done
    }

    /// Whether there is any light to show.
    fn is_lit(&self) -> bool {
        let progress = &self.snapshot.progress;
        self.snapshot.lags || progress.done || progress.update.shots > 0
    }

    /// Whether a view that stays is refined: not while more of the light is about to come.
    fn refines(&self) -> bool {
        self.switches.detail && self.is_lit() && !self.snapshot.lags && self.edited.is_none()
    }

    /// Whether the detailed picture of the view is shown, with all its pixels and the last light.
    pub fn is_detailed(&self) -> bool {
        // With the switches as they are now, which may differ from the last frame's.
        let now = self.wanted_now(self.size);
        self.shown_detail().is_some_and(|drawn| {
            drawn.is_whole
                && drawn.of.looks_like(&now)
                && Arc::ptr_eq(&drawn.of.snapshot, &self.snapshot)
        })
    }

    /// Whether the sources and the item buffer have arrived, if they are to be shown.
    pub fn has_overlays(&self) -> bool {
        let Switches { sources, items, .. } = self.switches;
        let items = items && self.input.chosen.is_some();
        !self.dirty
            && (!(sources || items) || !self.overlays.sources.is_empty())
            && (!items || self.overlays.items.is_some())
    }

    /// When the next frame is due without any event; None: only after an event.
    pub fn next_frame(&self, now: Instant) -> Option<Instant> {
        if self.size.0 == 0 || self.size.1 == 0 {
            return None;
        }
        let changed = (self.dirty || self.stale || self.input.flies()).then_some(now);
        let Pictures { seen, wanted, .. } = &self.pictures;
        let paused = seen.as_ref().map(|seen| seen.since + PAUSE);
        let paused = paused.filter(|_| self.refines() && wanted.is_none());
        let next = [changed, self.repaint, paused, self.notes.next_end()];
        let next = next.into_iter().flatten().min();
        let held = match self.awaits_light() {
            true => Some(self.last_frame + DARK),
            false => self.sketch_due(),
        };
        next.map(|at| held.map_or(at, |held| at.max(held)))
    }

    /// Whether nothing but the progress of the bake would be new in a frame.
    fn awaits_light(&self) -> bool {
        let is_dark = !self.is_lit() && self.is_baking() && !self.baker.has_light();
        is_dark && self.timing.has_begun() && self.unanswered.is_none() && !self.stale
    }

    pub fn handle(&mut self, event: Event) {
        // Input before the first frame has no answer to measure.
        if event.is_input() && self.timing.has_begun() {
            self.unanswered.get_or_insert_with(Instant::now);
        }
        self.dirty = true;
        match event {
            Event::Close => self.closing = true,
            Event::Resized { width, height } => {
                self.stale |= self.size != (width, height);
                self.size = (width, height);
            }
            Event::Scale(scale) => self.scale = scale,
            Event::Dropped(path) => self.open(path),
            other => self.take_input(other),
        }
    }

    /// Called when another thread has a new result.
    pub fn wake(&mut self) {
        self.dirty = true;
    }

    pub(super) fn say(&mut self, note: String) {
        self.notes.say(note);
        self.dirty = true;
    }

    /// Asks the window for another scene, by what [`Session::open`] takes.
    pub(super) fn open(&mut self, name: String) {
        self.opening = Some(name);
        self.dirty = true;
    }

    fn start_epoch(&mut self) {
        self.epoch += 1;
        self.progress = Progress::default();
        self.bounds.clear();
        self.overlays.items = None;
        self.overlays.asked = None;
        self.stage = None;
        self.dirty = true;
    }

    /// Saves the view to a file, drawn as by `render`; None picks a free name.
    pub(super) fn save(&mut self, path: Option<PathBuf>) {
        let path = path.unwrap_or_else(|| {
            let numbered = (1..).map(|i| PathBuf::from(format!("{PICTURE}-{i:04}.png")));
            let mut free = numbered.filter(|path| !path.exists() && !self.saving.contains(path));
            free.next().unwrap_or_default()
        });
        let wanted = self.wanted_now(self.size);
        self.saving.push(path.clone());
        self.detailer.save(wanted, path);
    }

    fn ambient(&self) -> Vec3 {
        self.ambient_of(&self.snapshot, &self.switches)
    }

    /// W·m⁻².
    fn ambient_of(&self, snapshot: &Snapshot, switches: &Switches) -> Vec3 {
        match switches.ambient && switches.part != Light::Direct {
            true => snapshot.ambient.irradiance,
            false => Vec3::ZERO,
        }
    }

    /// Stops.
    fn exposure(&self) -> f32 {
        self.metered + self.switches.exposure
    }
}
