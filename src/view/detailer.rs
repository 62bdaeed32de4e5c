//! Detailed pictures of views that stay, drawn as `render` draws them, on a thread and a Vulkan device of their own.

use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use egui::Color32;

use super::snapshot::Snapshot;
use super::{DeviceChoice, Wake};
use crate::error::Result;
use crate::render::{Direct, Light, Lighting, ReliefShading, Renderer, SAMPLES, Show, View};
use crate::scene::Camera;
use crate::solution::DirectionalLight;
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

impl Wanted {
    /// Whether a picture of `other` shows this one's view in this one's way, by whatever stage of the same bake.
    pub fn looks_like(&self, other: &Self) -> bool {
        self.snapshot.epoch == other.snapshot.epoch
            && self.size == other.size
            && self.camera == other.camera
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
    /// Pixels; fewer than wanted of a first, coarse picture.
    pub size: (u32, u32),
    /// sRGB, `[row][column]`.
    pub codes: Vec<Color32>,
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
    /// Counts what was asked for: a picture under way is given up when something else is.
    asked: u64,
    /// A picture for a file goes before the view's.
    to_save: Option<(Wanted, std::path::PathBuf)>,
    drawn: Option<Drawn>,
    saved: Vec<Result<std::path::PathBuf>>,
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

    /// Asks for a picture in place of the one that was asked for before; none: for no more.
    pub fn want(&self, wanted: Option<Wanted>) {
        {
            let mut state = self.shared.state();
            state.wanted = wanted;
            state.asked += 1;
        }
        self.shared.changed.notify_all();
    }

    /// Asks for a picture in a file.
    pub fn save(&self, wanted: Wanted, path: std::path::PathBuf) {
        self.shared.state().to_save = Some((wanted, path));
        self.shared.changed.notify_all();
    }

    /// The last picture since this was asked.
    pub fn take(&self) -> Option<Drawn> {
        self.shared.state().drawn.take()
    }

    /// Files that have been written, or not, since this was asked.
    pub fn saved(&self) -> Vec<Result<std::path::PathBuf>> {
        std::mem::take(&mut self.shared.state().saved)
    }

    /// Why there will be no more pictures.
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

/// A coarse picture comes first, of one pixel for so many along each side.
const COARSE: u32 = 4;
/// Pixels a side of what is drawn between two looks at what is wanted.
const TILE: u32 = 96;

struct Work<'a> {
    shared: &'a Shared,
    wake: &'a Wake,
    device: Arc<Device>,
}

/// What a renderer draws next.
enum Next {
    Draw(Wanted),
    Save(Wanted, std::path::PathBuf),
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

    /// Waits for something to draw; none when the window closes.
    fn wait(&self) -> Option<Next> {
        let mut state = self.shared.state();
        loop {
            if state.closing {
                return None;
            }
            if let Some((wanted, path)) = state.to_save.take() {
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
        state.closing || state.asked != asked || state.to_save.is_some()
    }

    /// Draws pictures for as long as one renderer can; returns what it cannot draw.
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
        let mut renderer = Renderer::new(&self.device, &snapshot.scene, lighting, &view, SAMPLES)?;
        let mut next = first;
        loop {
            match &next {
                Next::Draw(wanted) => self.draw(&mut renderer, wanted)?,
                Next::Save(wanted, path) => {
                    renderer.look(&self::view(wanted, 1))?;
                    let written = renderer
                        .picture()?
                        .write(path, Some(wanted.exposure))
                        .map(|()| path.clone());
                    self.shared.state().saved.push(written);
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
        let asked = self.shared.state().asked;
        for coarse in [COARSE, 1] {
            let view = view(wanted, coarse);
            renderer.look(&view)?;
            let Some(picture) = renderer.picture_while(TILE, || !self.is_overtaken(asked))? else {
                return Ok(());
            };
            let codes = picture.srgb_codes(Some(wanted.exposure));
            let codes = codes.chunks_exact(3);
            self.shared.state().drawn = Some(Drawn {
                of: wanted.clone(),
                size: (view.width, view.height),
                codes: codes.map(|c| Color32::from_rgb(c[0], c[1], c[2])).collect(),
                seconds: start.elapsed().as_secs_f64(),
            });
            (self.wake)();
        }
        Ok(())
    }
}

/// The same light by direction under a sky of one radiance besides, whose irradiance is given; none where that is dark.
fn under(relief: &DirectionalLight, ambient: Vec3) -> Option<DirectionalLight> {
    if ambient == Vec3::ZERO {
        return None;
    }
    // ∫ L ω dω over a slot, its directions taken as one; L = E/π.
    let angle = 2.0 * std::f32::consts::PI / relief.directions.len() as f32;
    let sky: Vec<[Vec3; 3]> = relief
        .directions
        .iter()
        .map(|d| {
            let moment = d.as_vec3() * (angle / std::f32::consts::PI);
            ambient.to_array().map(|c| moment * c)
        })
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

/// How long a view has stayed before it is drawn in detail.
pub const PAUSE: Duration = Duration::from_millis(120);
