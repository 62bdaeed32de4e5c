//! The window's state: what it shows, and how it changes.

mod frame;
mod layout;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use winit::window::Window;

use super::baker::{Baker, Order, Stage};
use super::camera::Eye;
use super::detailer::{Detailer, Drawn, PAUSE, Wanted};
use super::event::Event;
use super::input::Input;
use super::lamps::{Lamp, lamps, lit};
use super::panel_pass::PanelPass;
use super::screen::Screen;
use super::snapshot::{Progress, Snapshot};
use super::surface_pass::SurfacePass;
use super::switches::Switches;
use super::timing::Timing;
use super::{Options, Wake};
use crate::error::{Error, Result};
use crate::render::Light;
use crate::scene::Scene;
use crate::solver::{ItemPicture, Settings, Update};
use layout::KeptTexture;

pub struct Viewer {
    baker: Baker,
    detailer: Detailer,
    surfaces: SurfacePass,
    panel_pass: PanelPass,
    pub(super) screen: Screen,
    /// Of the window, and whether its images are to be made anew.
    pub(super) size: (u32, u32),
    stale: bool,
    pub(super) scale: f32,

    /// As it was read.
    base: Scene,
    /// As it is lit and raised now.
    pub(super) scene: Arc<Scene>,
    settings: Settings,
    pub(super) eye: Eye,
    pub(super) next_camera: usize,
    pub(super) switches: Switches,
    pub(super) lamps: Vec<Lamp>,
    pub(super) lamp: usize,
    pub(super) directions: u32,
    pub(super) relief_scale: f64,

    snapshot: Arc<Snapshot>,
    pub(super) epoch: u64,
    progress: Progress,
    bounds: Vec<[f64; 2]>,
    sources: Vec<u32>,
    /// Counts the sources that have come, and what was asked for of which.
    source_lists: u64,
    asked: Option<(u64, Option<u32>)>,
    items: Option<ItemPicture>,
    slots_picture: KeptTexture,
    items_picture: KeptTexture,
    stage: Option<Stage>,
    /// Stops by which what is shown is exposed, without the person's own.
    metered: f32,
    /// Counts the lights that were shown.
    lights: u64,
    /// The last detailed picture, and what the last whole one is of.
    detail: Option<Drawn>,
    whole: Option<Wanted>,
    wanted: Option<Wanted>,
    /// What the view was when it last changed.
    seen: Option<(Wanted, Instant)>,
    messages: Vec<String>,
    /// Pictures on their way into files.
    pub(super) saving: Vec<PathBuf>,

    pub(super) egui: egui::Context,
    pub(super) input: Input,
    /// When the panel wants to be drawn again.
    repaint: Option<Instant>,
    pub(super) dirty: bool,
    /// When the lights were changed that are not shown yet, and their epoch.
    pub(super) edited: Option<(u64, Instant)>,
    /// When what was not answered yet was done.
    pub(super) unanswered: Option<Instant>,
    last_frame: Instant,
    start: Instant,
    pub(super) timing: Timing,
    pub(super) capture: Option<PathBuf>,
    pub(super) closing: bool,
}

/// Most messages that the panel keeps.
const MOST_MESSAGES: usize = 4;
/// Stops by which the exposure of a bake under way may be off.
const MOST_CHANGE: f32 = 0.2;
/// Directory of pictures that are saved by a key: the working one.
const PICTURE: &str = "mesolux";

impl Viewer {
    pub fn new(
        options: Options,
        window: &Arc<Window>,
        size: (u32, u32),
        wake: Wake,
    ) -> Result<Self> {
        let Options {
            scene: base,
            bake,
            kept,
            settings,
            camera,
            device,
            start,
            ..
        } = options;
        let screen = Screen::new(window, size, &device)?;
        let scene = Arc::new(base.clone());
        let surfaces = SurfacePass::new(screen.device(), screen.pass(), &scene)?;
        let panel_pass = PanelPass::new(screen.device(), screen.pass())?;
        let given = (Arc::clone(&scene), settings.clone());
        let baker = Baker::new(&device, given, kept, Arc::clone(&wake));
        let from_file = bake.is_some();
        let snapshot = Arc::new(match bake {
            Some(bake) => Snapshot::of_bake(&scene, bake),
            None => Snapshot::unlit(&scene),
        });
        if !from_file {
            baker.order(Order::Bake {
                scene: Arc::clone(&scene),
                settings: Box::new(settings.clone()),
                epoch: 0,
            });
        }
        let egui = egui::Context::default();
        egui.set_theme(egui::Theme::Dark);
        let mut viewer = Self {
            baker,
            detailer: Detailer::new(&device, wake),
            surfaces,
            panel_pass,
            screen,
            size,
            stale: false,
            scale: 1.0,
            eye: Eye::new(&scene, &camera),
            next_camera: {
                // The first key press goes on from the camera that is shown.
                let shown = scene.cameras.iter().position(|c| *c == camera);
                shown.map_or(0, |i| (i + 1) % scene.cameras.len())
            },
            switches: Switches::default(),
            lamps: lamps(&base),
            lamp: 0,
            directions: settings.relief.directions.count() as u32,
            relief_scale: 1.0,
            base,
            scene,
            settings,
            progress: snapshot.progress,
            epoch: 0,
            bounds: Vec::new(),
            sources: Vec::new(),
            source_lists: 0,
            asked: None,
            items: None,
            slots_picture: KeptTexture::default(),
            items_picture: KeptTexture::default(),
            stage: None,
            metered: snapshot.exposure,
            lights: 0,
            snapshot,
            detail: None,
            whole: None,
            wanted: None,
            seen: None,
            messages: Vec::new(),
            saving: Vec::new(),
            egui,
            input: Input::default(),
            repaint: None,
            dirty: true,
            edited: None,
            unanswered: None,
            last_frame: Instant::now(),
            start,
            timing: Timing::default(),
            capture: None,
            closing: false,
        };
        let light = (&viewer.snapshot.corners, &viewer.snapshot.corners_direct);
        viewer.surfaces.set_light(light.0, light.1);
        Ok(viewer)
    }

    /// Whether a bake is under way.
    pub fn is_baking(&self) -> bool {
        !self.progress.done
    }

    /// Whether what is shown is the light of a bake that is done.
    pub fn is_baked(&self) -> bool {
        self.snapshot.epoch == self.epoch && self.snapshot.progress.done
    }

    /// Whether there is any light to be shown.
    fn is_lit(&self) -> bool {
        self.snapshot.progress.done || self.snapshot.progress.update.shots > 0
    }

    /// Whether the detailed picture of the view is shown, with all its pixels and the last light.
    pub fn is_detailed(&self) -> bool {
        // What was switched since the last frame counts.
        let now = self.wanted_now(self.size);
        self.shown_detail().is_some_and(|drawn| {
            drawn.is_whole()
                && drawn.of.looks_like(&now)
                && Arc::ptr_eq(&drawn.of.snapshot, &self.snapshot)
        })
    }

    /// Whether the sources and the item buffer are there, where they are to be shown.
    pub fn has_overlays(&self) -> bool {
        let Switches { sources, items, .. } = self.switches;
        let items = items && self.input.chosen.is_some();
        !self.dirty
            && (!(sources || items) || !self.sources.is_empty())
            && (!items || self.items.is_some())
    }

    /// When a frame is to be drawn though nothing happens; none: only when something does.
    pub fn next_frame(&self, now: Instant) -> Option<Instant> {
        if self.size.0 == 0 || self.size.1 == 0 {
            return None;
        }
        if self.dirty || self.stale || self.input.flies() {
            return Some(now);
        }
        let paused = self.seen.as_ref().map(|(_, since)| *since + PAUSE);
        let paused =
            paused.filter(|_| self.switches.detail && self.wanted.is_none() && self.is_lit());
        [self.repaint, paused].into_iter().flatten().min()
    }

    pub fn handle(&mut self, event: Event) {
        // Before the first frame nobody sees what they do.
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
            other => self.take_input(other),
        }
    }

    /// Tells the window that another thread has something new.
    pub fn wake(&mut self) {
        self.dirty = true;
    }

    pub(super) fn say(&mut self, message: String) {
        if self.messages.len() == MOST_MESSAGES {
            self.messages.remove(0);
        }
        self.messages.push(message);
    }

    /// Bakes anew with the directions and the relief that are chosen.
    pub(super) fn bake(&mut self) {
        self.settings.relief.directions = crate::directions::Directions::new(self.directions)
            .unwrap_or(self.settings.relief.directions);
        for (material, before) in self
            .base
            .materials
            .iter()
            .zip(Arc::make_mut(&mut self.scene).materials.iter_mut())
        {
            before.height_scale = material.height_scale * self.relief_scale as f32;
        }
        self.surfaces.set_about(&self.scene);
        self.start_epoch();
        self.baker.order(Order::Bake {
            scene: Arc::clone(&self.scene),
            settings: Box::new(self.settings.clone()),
            epoch: self.epoch,
        });
    }

    /// Lights the scene by the lamps as they are now.
    pub(super) fn relight(&mut self) {
        self.scene = Arc::new(lit(&self.scene, &self.lamps));
        self.surfaces.set_emission(&self.scene);
        self.start_epoch();
        self.edited = Some((self.epoch, Instant::now()));
        self.baker.order(Order::Relight {
            scene: Arc::clone(&self.scene),
            epoch: self.epoch,
        });
    }

    fn start_epoch(&mut self) {
        self.epoch += 1;
        self.progress = Progress::default();
        self.bounds.clear();
        self.items = None;
        self.asked = None;
        self.stage = None;
        self.dirty = true;
    }

    /// Asks for the sources where they are to be shown and nobody has cut them, and for what the source of the marked element sees.
    fn ask_sources(&mut self) {
        let Switches { sources, items, .. } = self.switches;
        let chosen = self.input.chosen.filter(|_| items);
        if !sources && chosen.is_none() {
            return;
        }
        let source = chosen.and_then(|e| self.sources.get(e as usize).copied());
        let wanted = (self.source_lists, source);
        if self.asked == Some(wanted) || (source.is_none() && !self.sources.is_empty()) {
            return;
        }
        self.asked = Some(wanted);
        match source {
            // The bake that is under way tells them.
            None if self.is_baking() => {}
            None => self.baker.order(Order::Sources),
            Some(crate::constants::NONE) => {
                self.items = None;
                self.say("the element neither emits nor reflects: no source".into());
            }
            Some(source) => self.baker.order(Order::Items { source }),
        }
    }

    /// Has the view drawn in a file as `render` would.
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

    fn wanted_now(&self, size: (u32, u32)) -> Wanted {
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

    fn ambient(&self) -> Vec3 {
        match self.switches.ambient && self.switches.part != Light::Direct {
            true => self.snapshot.ambient.irradiance,
            false => Vec3::ZERO,
        }
    }

    /// Stops.
    fn exposure(&self) -> f32 {
        self.metered + self.switches.exposure
    }

    /// The detailed picture if it is of what the window shows.
    fn shown_detail(&self) -> Option<&Drawn> {
        let drawn = self.detail.as_ref()?;
        let (now, _) = self.seen.as_ref()?;
        (self.switches.detail && drawn.of.looks_like(now)).then_some(drawn)
    }

    /// Whether the last whole picture and a coarse one after it show surfaces as the window does now.
    fn kept_detail(&self) -> [bool; 2] {
        let Some((now, _)) = self.seen.as_ref().filter(|_| self.switches.detail) else {
            return [false; 2];
        };
        let whole = self.whole.as_ref().is_some_and(|of| of.colours_like(now));
        let coarse = self.detail.as_ref().filter(|drawn| !drawn.is_whole());
        [
            whole,
            coarse.is_some_and(|drawn| drawn.of.colours_like(now)),
        ]
    }

    /// Takes what the other threads have found.
    fn update(&mut self) -> Result<()> {
        let latest = self.baker.take();
        if let Some(error) = latest.error {
            self.progress.done = true;
            self.edited = None;
            self.fail(error)?;
        }
        if let Some(sources) = latest.sources {
            self.surfaces.set_sources(&self.scene, sources.clone());
            self.sources = sources;
            self.source_lists += 1;
        }
        if let Some((epoch, progress)) = latest.progress
            && epoch == self.epoch
        {
            self.progress = progress;
            let Update {
                error_bound,
                elapsed,
                ..
            } = progress.update;
            if let Some(bound) = error_bound {
                self.bounds.push([elapsed.as_secs_f64(), bound]);
            }
        }
        if let Some(items) = latest.items {
            self.items = Some(items);
        }
        if let Some(snapshot) = latest.snapshot {
            self.surfaces
                .set_light(&snapshot.corners, &snapshot.corners_direct);
            // Stages of one bake are exposed alike, or what was drawn of one would not fit the next.
            let change = (snapshot.exposure - self.metered).abs();
            let same = snapshot.epoch == self.snapshot.epoch && self.is_lit();
            if snapshot.progress.done || !same || change > MOST_CHANGE {
                self.metered = snapshot.exposure;
            }
            self.snapshot = snapshot;
            self.lights += 1;
        }
        if let Some((epoch, stage)) = latest.stage
            && epoch == self.epoch
        {
            self.stage = stage;
        }
        self.ask_sources();
        if let Some(drawn) = self.detailer.take() {
            // A coarse picture of brighter light does not take the place of a whole one.
            let whole = (self.detail.as_ref()).filter(|d| d.is_whole() && !drawn.is_whole());
            if !whole.is_some_and(|whole| whole.of.looks_like(&drawn.of)) {
                let rows = Eye::new(&self.scene, &drawn.of.camera).rows(&self.scene, drawn.size);
                let (picture, share) = self.surfaces.set_picture(&drawn, &rows)?;
                self.panel_pass.set_picture(picture, share)?;
                if drawn.is_whole() {
                    self.whole = Some(drawn.of.clone());
                }
                self.detail = Some(drawn);
            }
        }
        for (path, saved) in self.detailer.saved() {
            self.saving.retain(|under_way| *under_way != path);
            match saved {
                Ok(exposure) => {
                    tracing::info!("saved {}, exposure {exposure}", path.display());
                    self.say(format!("saved {}", path.display()));
                }
                Err(error) => self.fail(error)?,
            }
        }
        match self.detailer.error() {
            Some(error) => self.fail(error),
            None => Ok(()),
        }
    }

    /// A person is told of an error; a script ends with it.
    fn fail(&mut self, error: Error) -> Result<()> {
        match self.input.scripted {
            true => Err(error),
            false => {
                tracing::error!("{error}");
                self.say(error.to_string());
                Ok(())
            }
        }
    }
}
