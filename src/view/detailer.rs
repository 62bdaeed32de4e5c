//! Detailed pictures of views, drawn as `render` draws them, on a thread and a Vulkan device of
//! their own.
//!
//! Only a view that stays is drawn. Of a finished bake it is shown tile by tile as it is drawn, over
//! the last picture of the same view where there is one; of a bake under way as a whole, since tiles
//! of different stages would not match.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use egui::Color32;

use super::snapshot::{Snapshot, even_moments};
use super::{DeviceChoice, Wake};
use crate::bake::solution::DirectionalLight;
use crate::error::Result;
use crate::meso::KnownFactors;
use crate::render::{
    Direct, Light, Lighting, Picture, ReliefShading, Renderer, SAMPLES, Show, View,
};
use crate::scene::Camera;
use crate::vk::Device;
use glam::Vec3;

/// A picture that is wanted.
#[derive(Clone)]
pub struct Wanted {
    pub snapshot: Arc<Snapshot>,
    pub camera: Camera,
    /// Pixels.
    pub size: (u32, u32),
    pub part: Light,
    pub shading: ReliefShading,
    pub direct: Direct,
    pub show: Show,
    /// Irradiance of the light not shot yet, W·m⁻².
    pub ambient: Vec3,
    /// Stops.
    pub exposure: f32,
    /// Of the left side of a comparison.
    pub left: bool,
}

impl Wanted {
    /// Whether a picture of `other` shows the same view in the same way, at any stage of the same
    /// bake.
    pub fn looks_like(&self, other: &Self) -> bool {
        self.left == other.left
            && self.size == other.size
            && self.camera == other.camera
            && self.snapshot.epoch == other.snapshot.epoch
            && self.shows_like(other)
            && self.exposure.to_bits() == other.exposure.to_bits()
    }

    fn shows_like(&self, other: &Self) -> bool {
        (self.part, self.shading, self.direct, self.show)
            == (other.part, other.shading, other.direct, other.show)
    }

    /// Whether a renderer of `other` can draw this.
    fn is_lit_like(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.snapshot, &other.snapshot)
            && self.shows_like(other)
            && self.ambient == other.ambient
    }
}

/// A picture that was wanted, or a part of it.
#[derive(Clone)]
pub struct Drawn {
    pub of: Wanted,
    /// sRGB, `[row][column]`; transparent where nothing has been drawn yet.
    pub codes: Vec<Color32>,
    /// Once it is whole.
    pub picture: Option<Arc<Picture>>,
    pub is_whole: bool,
    /// Time that it has taken so far.
    pub seconds: f64,
}

/// The window's end of the thread.
pub struct Detailer {
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
    /// In the order in which they are drawn.
    wanted: VecDeque<Wanted>,
    /// Number of requests so far: a new one stops the picture in progress.
    asked: u64,
    /// Pictures for files come before the view's.
    to_save: VecDeque<(Wanted, PathBuf)>,
    /// Of the left side, of the view as it is.
    drawn: [Option<Drawn>; 2],
    /// Saved files, with their exposures.
    saved: Vec<(PathBuf, Result<f32>)>,
    error: Option<crate::error::Error>,
    closing: bool,
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl Detailer {
    /// `cache` is as [`Lighting::cache`].
    pub fn new(choice: &DeviceChoice, cache: Option<PathBuf>, wake: Wake) -> Self {
        let shared = Arc::<Shared>::default();
        let (work, choice) = (Arc::clone(&shared), choice.clone());
        let thread = super::background("detail", move || {
            let done = choice.open_drawing().and_then(|device| {
                Work {
                    shared: &work,
                    wake: &wake,
                    device,
                    cache: cache.as_deref(),
                    known: &KnownFactors::default(),
                    last: [None, None],
                }
                .run()
            });
            if let Err(error) = done {
                work.state().error = Some(error);
                wake();
            }
        });
        Self {
            shared,
            thread: Some(thread),
        }
    }

    /// Replaces the wanted pictures by others, which are drawn one after another.
    pub fn want(&self, wanted: Vec<Wanted>) {
        {
            let mut state = self.shared.state();
            state.asked += 1;
            state.wanted = wanted.into();
        }
        self.shared.changed.notify_all();
    }

    /// Orders a picture in a file.
    pub fn save(&self, wanted: Wanted, path: PathBuf) {
        self.shared.state().to_save.push_back((wanted, path));
        self.shared.changed.notify_all();
    }

    /// The latest pictures since the last call: of the left side, of the view as it is.
    pub fn take(&self) -> [Option<Drawn>; 2] {
        std::mem::take(&mut self.shared.state().drawn)
    }

    /// Files that were written, or failed, since the last call.
    pub fn saved(&self) -> Vec<(PathBuf, Result<f32>)> {
        std::mem::take(&mut self.shared.state().saved)
    }

    /// The error that ended the thread.
    pub fn error(&self) -> Option<crate::error::Error> {
        self.shared.state().error.take()
    }
}

impl Drop for Detailer {
    fn drop(&mut self) {
        self.shared.state().closing = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Between two parts of a picture that are shown.
const PARTS: Duration = Duration::from_millis(150);

struct Work<'a> {
    shared: &'a Shared,
    wake: &'a Wake,
    device: Arc<Device>,
    cache: Option<&'a Path>,
    /// The factors of its reliefs, which only other heights or directions change.
    known: &'a KnownFactors,
    /// The last pictures of each side that were drawn whole.
    last: [Option<Drawn>; 2],
}

/// The next picture of a renderer.
enum Next {
    Draw(Wanted),
    Save(Wanted, PathBuf),
}

impl Next {
    fn wanted(&self) -> &Wanted {
        match self {
            Self::Draw(wanted) | Self::Save(wanted, _) => wanted,
        }
    }
}

impl Work<'_> {
    fn run(mut self) -> Result<()> {
        let mut next = self.wait();
        while let Some(first) = next {
            next = self.draw_alike(first)?;
        }
        Ok(())
    }

    /// Waits for a request; None when the window closes.
    fn wait(&self) -> Option<Next> {
        let mut state = self.shared.state();
        loop {
            if state.closing {
                return None;
            }
            if let Some((wanted, path)) = state.to_save.pop_front() {
                return Some(Next::Save(wanted, path));
            }
            if let Some(wanted) = state.wanted.pop_front() {
                return Some(Next::Draw(wanted));
            }
            state = self
                .shared
                .changed
                .wait(state)
                .unwrap_or_else(|e| e.into_inner());
        }
    }

    fn is_overtaken(&self, asked: u64) -> bool {
        let state = self.shared.state();
        state.closing || state.asked != asked || !state.to_save.is_empty()
    }

    /// Draws pictures as long as one renderer can draw them; returns the first request that it
    /// cannot.
    fn draw_alike(&mut self, first: Next) -> Result<Option<Next>> {
        let wanted = first.wanted().clone();
        let snapshot = Arc::clone(&wanted.snapshot);
        let irradiance: Vec<Vec3> = snapshot
            .irradiance
            .iter()
            .map(|e| *e + wanted.ambient)
            .collect();
        let relief = snapshot.relief.as_ref().map(|r| under(r, wanted.ambient));
        let lighting = Lighting {
            relief: relief
                .as_ref()
                .and_then(|r| r.as_ref())
                .or(snapshot.relief.as_ref()),
            part: wanted.part,
            shading: wanted.shading,
            direct: wanted.direct,
            show: wanted.show,
            cache: self.cache,
            known: Some(self.known),
            ..snapshot.lighting(&irradiance)
        };
        let view = view(&wanted);
        let (device, scene) = (&self.device, &snapshot.scene);
        let mut renderer = Renderer::new(device, scene, lighting, &view, SAMPLES)?;
        let mut next = first;
        loop {
            match &next {
                Next::Draw(wanted) => self.draw(&mut renderer, wanted)?,
                Next::Save(wanted, path) => {
                    renderer.look(&self::view(wanted))?;
                    let written = renderer
                        .picture()?
                        .write(path, Some(wanted.exposure))
                        .map(|()| wanted.exposure);
                    self.shared.state().saved.push((path.clone(), written));
                    (self.wake)();
                }
            }
            match self.wait() {
                Some(then) if then.wanted().is_lit_like(&wanted) => next = then,
                other => return Ok(other),
            }
        }
    }

    fn draw(&mut self, renderer: &mut Renderer<'_>, wanted: &Wanted) -> Result<()> {
        let start = Instant::now();
        let asked = self.shared.state().asked;
        renderer.look(&view(wanted))?;
        let (width, height) = wanted.size;
        let side = side(wanted);
        let before = self.last[side].take();
        let before = before.filter(|last| last.of.looks_like(wanted));
        let none = || vec![Color32::TRANSPARENT; width as usize * height as usize];
        let mut drawn = Drawn {
            of: wanted.clone(),
            codes: before.map_or_else(none, |before| before.codes),
            picture: None,
            is_whole: false,
            seconds: 0.0,
        };
        let in_parts = wanted.snapshot.progress.done;
        let mut shown = start;
        let picture = renderer.picture_while(|tile, gathered| {
            let corner = [tile.column, tile.row];
            let codes = codes(&gathered.last(tile), corner, wanted.exposure);
            for (row, codes) in (tile.row..).zip(codes.chunks_exact(tile.width as usize)) {
                let place = (row * width + tile.column) as usize;
                drawn.codes[place..place + tile.width as usize].copy_from_slice(codes);
            }
            if in_parts && shown.elapsed() >= PARTS {
                shown = Instant::now();
                drawn.seconds = start.elapsed().as_secs_f64();
                self.shared.state().drawn[side] = Some(drawn.clone());
                (self.wake)();
            }
            !self.is_overtaken(asked)
        })?;
        if let Some(picture) = picture {
            drawn.picture = Some(Arc::new(picture));
            drawn.is_whole = true;
            drawn.seconds = start.elapsed().as_secs_f64();
            self.last[side] = Some(drawn.clone());
            self.shared.state().drawn[side] = Some(drawn);
            (self.wake)();
        } else {
            // A picture that is saved comes first; this one is drawn after it.
            let mut state = self.shared.state();
            if state.asked == asked {
                state.wanted.push_front(wanted.clone());
            }
        }
        Ok(())
    }
}

/// The light by direction with a uniform sky of the given irradiance added; None where the
/// irradiance is 0.
fn under(relief: &DirectionalLight, ambient: Vec3) -> Option<DirectionalLight> {
    if ambient == Vec3::ZERO {
        return None;
    }
    let sky: Vec<[Vec3; 3]> = even_moments(&relief.directions)
        .into_iter()
        .map(|moment| ambient.to_array().map(|c| moment * c))
        .collect();
    let moments = relief.incident_moment.iter().zip(sky.iter().cycle());
    Some(DirectionalLight {
        elements: relief.elements.clone(),
        directions: relief.directions.clone(),
        frames: relief.frames.clone(),
        incident_moment: moments
            .map(|(m, sky)| [0, 1, 2].map(|c| m[c] + sky[c]))
            .collect(),
        incident_moment_direct: relief.incident_moment_direct.clone(),
        exitant: relief.exitant.clone(),
    })
}

/// A picture, or the part of one whose corner is at a column and a row, in sRGB.
pub fn codes(picture: &Picture, corner: [u32; 2], exposure: f32) -> Vec<Color32> {
    let codes = picture.srgb_codes_at(corner, Some(exposure));
    let codes = codes.chunks_exact(3);
    codes.map(|c| Color32::from_rgb(c[0], c[1], c[2])).collect()
}

/// Its place in lists of both sides.
fn side(wanted: &Wanted) -> usize {
    usize::from(!wanted.left)
}

fn view(wanted: &Wanted) -> View<'_> {
    View {
        camera: &wanted.camera,
        width: wanted.size.0,
        height: wanted.size.1,
    }
}

/// Time that a view must stay before it is drawn in detail.
pub const PAUSE: Duration = Duration::from_millis(120);
