//! Detailed pictures of views, drawn as `render` draws them, on a thread and a Vulkan device of
//! their own.
//!
//! A view that stays is drawn coarsely first, then whole. While the view moves, coarse pictures are
//! drawn of its place when the last one is done, and whole ones if they are quick enough. Each
//! comes with the distances of its pixels, so that the window can lay it over the surfaces seen
//! from elsewhere.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use egui::Color32;

use super::snapshot::{Snapshot, even_moments};
use super::{DeviceChoice, Wake};
use crate::bake::solution::DirectionalLight;
use crate::error::Result;
use crate::render::{Direct, Light, Lighting, ReliefShading, Renderer, SAMPLES, Show, View};
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
}

impl Drawn {
    /// Whether it has all pixels of the wanted picture.
    pub fn is_whole(&self) -> bool {
        self.size == self.of.size
    }
}

impl Wanted {
    /// Whether a picture of `other` shows the same view in the same way, at any stage of the same
    /// bake.
    pub fn looks_like(&self, other: &Self) -> bool {
        self.size == other.size && self.camera == other.camera && self.colours_like(other)
    }

    /// Whether a picture of `other` gives surfaces the same colours, from any view.
    pub fn colours_like(&self, other: &Self) -> bool {
        self.snapshot.epoch == other.snapshot.epoch
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

/// A picture that was wanted.
pub struct Drawn {
    pub of: Wanted,
    /// Pixels; fewer than wanted for a coarse picture.
    pub size: (u32, u32),
    /// sRGB, `[row][column]`.
    pub codes: Vec<Color32>,
    /// Distance of each pixel's middle along the view, `[row][column]`, internal units; 0 where
    /// nothing is.
    pub distances: Vec<f32>,
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
    wanted: Option<Wanted>,
    /// Whether the wanted view is moving.
    moving: bool,
    /// Number of requests so far: a new request stops the picture in progress, unless the view
    /// moves.
    asked: u64,
    /// Pictures for files come before the view's.
    to_save: VecDeque<(Wanted, PathBuf)>,
    drawn: Option<Drawn>,
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
    pub fn new(choice: &DeviceChoice, wake: Wake) -> Self {
        let shared = Arc::<Shared>::default();
        let (work, choice) = (Arc::clone(&shared), choice.clone());
        let thread = super::background("detail", move || {
            let done = choice.open_drawing().and_then(|device| {
                Work {
                    shared: &work,
                    wake: &wake,
                    device,
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

    /// Replaces the wanted picture by another one, of a view that moves or stays; None wants no
    /// picture.
    pub fn want(&self, wanted: Option<Wanted>, moving: bool) {
        {
            let mut state = self.shared.state();
            let goes_on = moving && state.moving && wanted.is_some();
            state.asked += u64::from(!goes_on);
            state.moving = moving;
            state.wanted = wanted;
        }
        self.shared.changed.notify_all();
    }

    /// Orders a picture in a file.
    pub fn save(&self, wanted: Wanted, path: PathBuf) {
        self.shared.state().to_save.push_back((wanted, path));
        self.shared.changed.notify_all();
    }

    /// The latest picture since the last call.
    pub fn take(&self) -> Option<Drawn> {
        self.shared.state().drawn.take()
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

/// Pixels along each side that are one pixel of a coarse picture.
const COARSE: u32 = 4;
/// Pixels along a side of a tile; between tiles the thread checks for new requests.
const TILE: u32 = 96;
/// Longest time of a whole picture that is drawn while the view moves.
const QUICK: Duration = Duration::from_millis(300);

struct Work<'a> {
    shared: &'a Shared,
    wake: &'a Wake,
    device: Arc<Device>,
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
    fn run(&self) -> Result<()> {
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
            if let Some(wanted) = state.wanted.take() {
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
    fn draw_alike(&self, first: Next) -> Result<Option<Next>> {
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
            ..snapshot.lighting(&irradiance)
        };
        let view = view(&wanted, 1);
        let (device, scene) = (&self.device, &snapshot.scene);
        let mut renderer = Renderer::with_depths(device, scene, lighting, &view, SAMPLES, true)?;
        let mut next = first;
        loop {
            match &next {
                Next::Draw(wanted) => self.draw(&mut renderer, wanted)?,
                Next::Save(wanted, path) => {
                    renderer.look(&self::view(wanted, 1))?;
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

    fn draw(&self, renderer: &mut Renderer<'_>, wanted: &Wanted) -> Result<()> {
        let start = Instant::now();
        let (asked, moving) = {
            let state = self.shared.state();
            (state.asked, state.moving)
        };
        for coarse in [COARSE, 1] {
            // If the view moves on meanwhile, a whole picture that takes long shows an outdated
            // view.
            if moving && coarse == 1 && start.elapsed() * COARSE * COARSE > QUICK {
                return Ok(());
            }
            let view = view(wanted, coarse);
            renderer.look(&view)?;
            let drawn = renderer.picture_while(TILE, || !self.is_overtaken(asked))?;
            let Some((picture, distances)) = drawn else {
                return Ok(());
            };
            let codes = picture.srgb_codes(Some(wanted.exposure));
            let codes = codes.chunks_exact(3);
            self.shared.state().drawn = Some(Drawn {
                of: wanted.clone(),
                size: (view.width, view.height),
                codes: codes.map(|c| Color32::from_rgb(c[0], c[1], c[2])).collect(),
                distances,
                seconds: start.elapsed().as_secs_f64(),
            });
            (self.wake)();
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

fn view(wanted: &Wanted, coarse: u32) -> View<'_> {
    View {
        camera: &wanted.camera,
        width: wanted.size.0.div_ceil(coarse),
        height: wanted.size.1.div_ceil(coarse),
    }
}

/// Time that a view must stay before it is drawn in detail.
pub const PAUSE: Duration = Duration::from_millis(120);
