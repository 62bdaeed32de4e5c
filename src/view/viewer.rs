//! The window's state: what it shows, and how it changes.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use winit::window::Window;

use super::baker::{Baker, Order};
use super::camera::Eye;
use super::detailer::{Detailer, Drawn, PAUSE, Wanted};
use super::event::Event;
use super::input::Input;
use super::lamps::{Lamp, lamps, lit};
use super::panel::{self, Asked, Changed, Told};
use super::panel_pass::PanelPass;
use super::screen::{Captured, Screen};
use super::snapshot::{Progress, Snapshot};
use super::surface_pass::{self, SurfacePass};
use super::switches::Switches;
use super::timing::Timing;
use super::{Options, Wake, overlay};
use crate::error::{Error, Result};
use crate::render::Light;
use crate::scene::Scene;
use crate::solver::{ItemPicture, Settings};
use crate::vk::Shown;

pub struct Viewer {
    // The threads first: they stop before what they show is gone.
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
    items: Option<ItemPicture>,
    detail: Option<Drawn>,
    wanted: Option<Wanted>,
    /// What the view was when it last changed.
    seen: Option<(Wanted, Instant)>,
    messages: Vec<String>,
    pub(super) saving: usize,

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
            None => Snapshot::dark(&scene),
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
            next_camera: 0,
            switches: Switches::default(),
            lamps: lamps(&base),
            lamp: 0,
            directions: settings.relief.directions.count() as u32,
            relief_scale: 1.0,
            base,
            scene,
            settings,
            progress: snapshot.progress,
            snapshot,
            epoch: 0,
            bounds: Vec::new(),
            sources: Vec::new(),
            items: None,
            detail: None,
            wanted: None,
            seen: None,
            messages: Vec::new(),
            saving: 0,
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
        self.snapshot.progress.done || self.snapshot.progress.shots > 0
    }

    /// Whether the detailed picture of the view is shown, with all its pixels and the last light.
    pub fn is_detailed(&self) -> bool {
        self.shown_detail().is_some_and(|drawn| {
            drawn.size == drawn.of.size && Arc::ptr_eq(&drawn.of.snapshot, &self.snapshot)
        })
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
        self.dirty = true;
    }

    /// Asks what the source of a triangle sees.
    pub(super) fn ask_items(&mut self, triangle: u32) {
        if let Some(&source) = self.sources.get(triangle as usize)
            && source != crate::constants::NONE
        {
            self.baker.order(Order::Items { source });
        }
    }

    /// Has the view drawn in a file as `render` would.
    pub(super) fn save(&mut self, path: Option<PathBuf>) {
        let path = path.unwrap_or_else(|| {
            let numbered = (1..).map(|i| PathBuf::from(format!("{PICTURE}-{i:04}.png")));
            let mut free = numbered.filter(|path| !path.exists());
            free.next().unwrap_or_default()
        });
        let wanted = self.wanted_now(self.size);
        self.saving += 1;
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
        self.snapshot.exposure + self.switches.exposure
    }

    /// The detailed picture if it is of what the window shows.
    fn shown_detail(&self) -> Option<&Drawn> {
        let drawn = self.detail.as_ref()?;
        let (now, _) = self.seen.as_ref()?;
        (self.switches.detail && drawn.of.looks_like(now)).then_some(drawn)
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
            self.surfaces.set_sources(&sources);
            self.sources = sources;
        }
        if let Some((epoch, progress)) = latest.progress
            && epoch == self.epoch
        {
            self.progress = progress;
            if let Some(bound) = progress.error_bound {
                self.bounds.push([progress.elapsed.as_secs_f64(), bound]);
            }
        }
        if let Some(items) = latest.items {
            self.items = Some(items);
        }
        if let Some(snapshot) = latest.snapshot {
            self.surfaces
                .set_light(&snapshot.corners, &snapshot.corners_direct);
            self.snapshot = snapshot;
        }
        if let Some(drawn) = self.detailer.take() {
            let picture = self.surfaces.set_picture(drawn.size, &drawn.codes)?;
            self.panel_pass.set_picture(picture)?;
            self.detail = Some(drawn);
        }
        for saved in self.detailer.saved() {
            self.saving -= 1;
            match saved {
                Ok(path) => self.say(format!("saved {}", path.display())),
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

    /// Asks for a detailed picture once the view has stayed for a while, and for none while it changes.
    fn want_detail(&mut self, size: (u32, u32)) {
        let now = self.wanted_now(size);
        match &self.seen {
            Some((before, _)) if before.looks_like(&now) => {}
            _ => {
                self.seen = Some((now.clone(), Instant::now()));
                if self.wanted.take().is_some() {
                    self.detailer.want(None);
                }
            }
        }
        let since = self.seen.as_ref().map(|(_, since)| since.elapsed());
        let stays = since.is_some_and(|since| since >= PAUSE);
        if !(self.switches.detail && stays && self.is_lit()) {
            return;
        }
        // While a bake goes on, a picture is finished before a brighter one is begun.
        let same = |wanted: &Wanted| Arc::ptr_eq(&wanted.snapshot, &now.snapshot);
        let finished = self
            .detail
            .as_ref()
            .is_some_and(|drawn| drawn.size == size && drawn.of.looks_like(&now));
        let ask = match &self.wanted {
            None => true,
            Some(wanted) => !same(wanted) && (finished || now.snapshot.progress.done),
        };
        if ask {
            self.wanted = Some(now.clone());
            self.detailer.want(Some(now));
        }
    }

    /// Draws a frame if the window has an area; returns what was read back of it, where that was asked for.
    ///
    /// # Errors
    /// A device or a display that fails.
    pub fn frame(&mut self) -> Result<bool> {
        let begin = Instant::now();
        let unanswered = self.unanswered.take();
        self.dirty = false;
        self.update()?;
        let seconds = begin.duration_since(self.last_frame).as_secs_f64();
        self.last_frame = begin;
        self.fly(seconds.min(0.1));
        let Some(size) = self.screen.fit(self.size, self.stale)? else {
            return Ok(false);
        };
        self.stale = false;
        let primitives = self.panel(size)?;
        self.want_detail(size);
        let prepared = self.panel_pass.prepare(&primitives, size, self.scale)?;
        let rows = self.eye.rows(&self.scene, size);
        let [all, direct, emission] = match self.switches.part {
            Light::Global => [1.0, 0.0, 1.0],
            Light::Direct => [0.0, 1.0, 1.0],
            Light::Indirect => [1.0, -1.0, 0.0],
        };
        let shown = surface_pass::Shown {
            exposure: self.exposure().exp2(),
            ambient: self.ambient(),
            parts: [all, direct, emission],
            elements: self.switches.elements,
            sources: self.switches.sources,
            picture: self.shown_detail().is_some(),
            chosen: self.input.chosen.or(self.input.hovered),
        };
        let capture = self.capture.is_some();
        let (surfaces, panel_pass) = (&self.surfaces, &self.panel_pass);
        let (answer, captured) = self.screen.show(capture, |cmd| {
            if shown.picture {
                panel_pass.record_picture(cmd, &prepared);
            }
            // The picture has all but what lies over the surfaces.
            if !shown.picture || shown.elements || shown.sources || shown.chosen.is_some() {
                surfaces.record(cmd, &rows, &shown);
            }
            panel_pass.record(cmd, &prepared);
        })?;
        if answer != Shown::Yes {
            self.stale = true;
            self.unanswered = unanswered;
            return Ok(false);
        }
        self.timing.frame(begin.elapsed(), self.is_baking());
        if let Some(since) = unanswered {
            self.timing.answer(since);
        }
        if let Some((epoch, since)) = self.edited
            && self.snapshot.epoch >= epoch
        {
            self.timing.relit(since);
            self.edited = None;
        }
        if self.is_lit() {
            self.timing.first_light(self.start);
        }
        if let (Some(path), Some(captured)) = (self.capture.take(), captured) {
            write(&path, &captured)?;
        }
        Ok(true)
    }

    /// Lays out the panel and what lies over the view; takes what was changed there.
    fn panel(&mut self, (width, height): (u32, u32)) -> Result<Vec<egui::ClippedPrimitive>> {
        let points = egui::vec2(width as f32, height as f32) / self.scale;
        let mut raw = self.input.take_raw();
        raw.screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points));
        raw.time = Some(self.start.elapsed().as_secs_f64());
        raw.viewports
            .entry(egui::ViewportId::ROOT)
            .or_default()
            .native_pixels_per_point = Some(self.scale);
        let context = self.egui.clone();
        let switches = self.switches;
        let mut asked = Vec::new();
        let output = context.run(raw, |context| {
            self.marks(context, (width, height));
            if self.switches.panel {
                asked = self.controls(context);
            }
        });
        if switches.items && !self.switches.items {
            self.items = None;
        }
        for asked in asked {
            match asked {
                Asked::Camera(i) => self.see_camera(i),
                Asked::SeeAll => self.eye.see_all(),
                Asked::Save => self.save(None),
                Asked::Bake => self.bake(),
                Asked::Relight => self.relight(),
            }
        }
        self.panel_pass.update(&output.textures_delta)?;
        let delay = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map_or(Duration::MAX, |viewport| viewport.repaint_delay);
        // Later than an hour is never.
        let soon = delay < Duration::from_secs(3600);
        self.repaint = soon.then(|| Instant::now() + delay);
        Ok(context.tessellate(output.shapes, output.pixels_per_point))
    }

    fn controls(&mut self, context: &egui::Context) -> Vec<Asked> {
        let cameras: Vec<_> = self.scene.cameras.iter().map(|c| c.name.clone()).collect();
        let baking = self.is_baking();
        let marked = self.input.chosen.or(self.input.hovered);
        let device = self.screen.device().name().to_owned();
        let told = Told {
            scene: &self.scene.name,
            triangles: self.scene.triangles.len(),
            device: &device,
            cameras: &cameras,
            progress: self.progress,
            baking,
            frame: self.timing.last(baking),
            detail: self.shown_detail().map(|drawn| drawn.seconds),
            has_relief: self.base.materials.iter().any(|m| m.has_relief()),
            messages: &self.messages,
            bounds: &self.bounds,
            element: marked.map(|e| self.describe(e)),
        };
        let mut changed = Changed {
            switches: &mut self.switches,
            lamps: &mut self.lamps,
            lamp: &mut self.lamp,
            directions: &mut self.directions,
            relief_scale: &mut self.relief_scale,
        };
        panel::show(context, &told, &mut changed)
    }

    /// An element in a line.
    fn describe(&self, element: u32) -> String {
        let e = element as usize;
        let material = self.scene.triangles[e].material as usize;
        let name = &self.scene.materials[material].name;
        let light = self.snapshot.irradiance[e];
        format!(
            "element {element}, {name}: E = {:.3}, {:.3}, {:.3} W/m²",
            light.x, light.y, light.z
        )
    }

    /// What lies over the view: marks of lights, light by direction, an item buffer.
    fn marks(&self, context: &egui::Context, size: (u32, u32)) {
        let layer = egui::LayerId::new(egui::Order::Background, egui::Id::new("marks"));
        let painter = context.layer_painter(layer);
        let marked_lamps = self.lamps.iter().enumerate();
        for (i, lamp) in marked_lamps.filter(|_| self.switches.panel) {
            if let Some(at) = lamp.position.and_then(|p| self.eye.pixel(p, size)) {
                let name = (i == self.lamp).then_some(lamp.name.as_str());
                overlay::lamp(&painter, at, self.scale, lamp.colour, name);
            }
        }
        let exposure = self.exposure().exp2();
        let picture = |name: &str, image: egui::ColorImage, place: egui::Rect| {
            let texture = context.load_texture(name, image, egui::TextureOptions::LINEAR);
            let uv = egui::Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
            painter.image(texture.id(), place, uv, egui::Color32::WHITE);
            // Drawn in this frame: the texture lives until the next one.
            context.data_mut(|data| data.insert_temp(egui::Id::new(name), texture));
        };
        let screen = context.content_rect();
        let marked = self.input.chosen.or(self.input.hovered);
        if self.switches.slots
            && let (Some(relief), Some(e)) = (&self.snapshot.relief, marked)
            && let Some(image) = overlay::hemisphere(relief, e, exposure)
        {
            let at = self.input.pointer.unwrap_or_default();
            let corner = egui::pos2(at.0 / self.scale + 16.0, at.1 / self.scale + 16.0);
            let place = egui::Rect::from_min_size(corner, egui::vec2(96.0, 96.0));
            picture("hemisphere", image, place);
        }
        if let Some(items) = self.items.as_ref().filter(|_| self.switches.items) {
            let image = overlay::items(items, &self.snapshot.irradiance, exposure);
            let side = 0.35 * screen.width().min(screen.height());
            let corner = screen.right_bottom() - egui::vec2(side + 8.0, side + 8.0);
            let place = egui::Rect::from_min_size(corner, egui::vec2(side, side));
            picture("items", image, place);
        }
    }
}

fn write(path: &std::path::Path, captured: &Captured) -> Result<()> {
    crate::render::write_png(path, captured.size, &captured.codes)
}
