//! The window: events of the system in, frames out.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Instant;

use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::{ElementState, MouseButton, MouseScrollDelta, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::keyboard::{Key as WinitKey, KeyCode, PhysicalKey};
use winit::window::{Window, WindowId};

use glam::DVec3;

use super::camera::Eye;
use super::event::{Event, Key, Modifiers, PointerButton};
use super::runner::Runner;
use super::viewer::Viewer;
use super::{Opened, Options, Session, Wake, background};
use crate::error::{Error, Result};

/// Another thread has a new result.
struct Woken;

/// Opens the window and shows the scene until it is closed; returns lines on how long frames and
/// answers took.
///
/// # Errors
/// No display, or one without a Vulkan surface; a device that fails.
pub fn run(options: Options) -> Result<Vec<String>> {
    let events = EventLoop::<Woken>::with_user_event()
        .build()
        .map_err(|e| Error::Display(format!("no display to open a window on: {}", line(&e))))?;
    let mut app = App {
        proxy: events.create_proxy(),
        size: options.size,
        runner: options.script.map(Runner::new),
        session: options.session,
        first: Some((options.opened, options.start)),
        reading: None,
        open: None,
        lines: Vec::new(),
        error: None,
    };
    let ran = events.run_app(&mut app);
    drop(app.close());
    match (app.error, ran) {
        (Some(error), _) => Err(error),
        (None, Err(e)) => Err(Error::Display(format!("the window failed: {}", line(&e)))),
        (None, Ok(())) => Ok(app.lines),
    }
}

/// The last part of an error's text, in one line: winit puts the place in its code before it.
fn line(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    let words: Vec<_> = text.split_whitespace().collect();
    let text = words.join(" ");
    let said = text.rsplit(": ").next().unwrap_or_default();
    said.trim_end_matches('.').to_owned()
}

struct App {
    proxy: EventLoopProxy<Woken>,
    size: (u32, u32),
    session: Session,
    /// Kept until the window is open, with the time at which the program started.
    first: Option<(Opened, Instant)>,
    runner: Option<Runner>,
    /// The scene that is to be shown next, while another thread reads it, and when it was asked
    /// for.
    reading: Option<(Receiver<Result<Opened>>, Instant)>,
    open: Option<(Viewer, Arc<Window>)>,
    lines: Vec<String>,
    error: Option<Error>,
}

impl App {
    fn open(&mut self, events: &ActiveEventLoop) -> Result<()> {
        let Some((first, start)) = self.first.take() else {
            return Ok(());
        };
        let attributes = Window::default_attributes()
            .with_inner_size(PhysicalSize::new(self.size.0, self.size.1));
        let window = events
            .create_window(attributes)
            .map_err(|e| Error::Display(format!("no window: {}", line(&e))))?;
        self.show(first, Arc::new(window), start)
    }

    fn wake(&self) -> Wake {
        let proxy = self.proxy.clone();
        Arc::new(move || {
            // A closed window needs no wake-up.
            let _ = proxy.send_event(Woken);
        })
    }

    /// Shows a scene that was asked for at `start`, in a window that shows no other.
    fn show(&mut self, opened: Opened, window: Arc<Window>, start: Instant) -> Result<()> {
        window.set_title(&format!("Mesolux: {}", opened.scene.name));
        let PhysicalSize { width, height } = window.inner_size();
        let (session, wake) = (&self.session, self.wake());
        let mut viewer = Viewer::new(opened, session, &window, (width, height), start, wake)?;
        viewer.scale = window.scale_factor() as f32;
        viewer.input.scripted = self.runner.is_some();
        self.open = Some((viewer, window));
        Ok(())
    }

    /// Has the chosen scene read, and shows it in place of the present one once that is done.
    fn open_chosen(&mut self) -> Result<()> {
        let wake = self.wake();
        let Some((viewer, _)) = &mut self.open else {
            return Ok(());
        };
        let Some(name) = viewer.opening.clone() else {
            return Ok(());
        };
        let Some((reading, since)) = &self.reading else {
            let (sender, receiver) = channel();
            let open = Arc::clone(&self.session.open);
            background("scene", move || {
                // A window that was closed meanwhile wants no scene.
                let _ = sender.send(open(&name));
                wake();
            });
            self.reading = Some((receiver, Instant::now()));
            return Ok(());
        };
        let Ok(read) = reading.try_recv() else {
            return Ok(());
        };
        let since = *since;
        self.reading = None;
        viewer.opening = None;
        match read {
            Err(error) => viewer.fail(error),
            Ok(opened) => {
                let (switches, line) = (viewer.switches, viewer.line);
                let eye = (viewer.name == opened.name).then(|| viewer.eye.camera.clone());
                if let Some(window) = self.close() {
                    self.show(opened, window, since)?;
                }
                if let Some((viewer, _)) = &mut self.open {
                    viewer.switches = switches;
                    viewer.line = line;
                    if let Some(camera) = eye {
                        viewer.eye = Eye::new(&viewer.scene, &camera);
                    }
                }
                Ok(())
            }
        }
    }

    /// Draws a frame if one is due, and schedules the next.
    fn go_on(&mut self, events: &ActiveEventLoop) -> Result<()> {
        self.open_chosen()?;
        let Some((viewer, window)) = &mut self.open else {
            return Ok(());
        };
        if let Some(runner) = &mut self.runner {
            runner.advance(viewer, |width, height| {
                // A system that resizes at once sends no event.
                let given = window.request_inner_size(PhysicalSize::new(width, height));
                if let Some(PhysicalSize { width, height }) = given {
                    viewer_resized(window, width, height);
                }
            })?;
        }
        if viewer.closing {
            events.exit();
            return Ok(());
        }
        let wanted = self.runner.as_ref().is_some_and(Runner::wants_frames);
        let now = std::time::Instant::now();
        let due = viewer.next_frame(now).is_some_and(|at| at <= now);
        if (due || wanted)
            && viewer.frame()?
            && let Some(runner) = &mut self.runner
        {
            runner.shown();
        }
        let now = std::time::Instant::now();
        let of_script = self.runner.as_ref().and_then(|runner| runner.next(now));
        let next = [viewer.next_frame(now), of_script]
            .into_iter()
            .flatten()
            .min();
        events.set_control_flow(next.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
        Ok(())
    }

    /// Frees everything on the devices; returns the window, which may be closed then.
    fn close(&mut self) -> Option<Arc<Window>> {
        let (viewer, window) = self.open.take()?;
        self.lines.extend(viewer.timing.lines());
        drop(viewer);
        Some(window)
    }

    fn stop_on_error(&mut self, events: &ActiveEventLoop, done: Result<()>) {
        if let Err(error) = done {
            self.error.get_or_insert(error);
            events.exit();
        }
    }
}

/// Where a resize takes effect at once, handles it as an event.
fn viewer_resized(window: &Window, width: u32, height: u32) {
    tracing::debug!(width, height, "resized at once");
    window.request_redraw();
}

impl ApplicationHandler<Woken> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let done = self.open(events);
        self.stop_on_error(events, done);
    }

    fn user_event(&mut self, _: &ActiveEventLoop, Woken: Woken) {
        if let Some((viewer, _)) = &mut self.open {
            viewer.wake();
        }
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        if let Some((viewer, _)) = &mut self.open {
            for event in translated(event) {
                viewer.handle(event);
            }
        }
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        if self.error.is_none() {
            let done = self.go_on(events);
            self.stop_on_error(events, done);
        }
    }
}

/// Views of the number pad's keys.
const SIDES: [(KeyCode, DVec3); 3] = [
    (KeyCode::Numpad1, DVec3::Z),
    (KeyCode::Numpad3, DVec3::X),
    (KeyCode::Numpad7, DVec3::Y),
];

/// Translates an event of the system.
fn translated(event: WindowEvent) -> Vec<Event> {
    match event {
        WindowEvent::CloseRequested | WindowEvent::Destroyed => vec![Event::Close],
        WindowEvent::Resized(PhysicalSize { width, height }) => {
            vec![Event::Resized { width, height }]
        }
        WindowEvent::ScaleFactorChanged { scale_factor, .. } => {
            vec![Event::Scale(scale_factor as f32)]
        }
        WindowEvent::Focused(focused) => vec![Event::Focus(focused)],
        WindowEvent::CursorMoved { position, .. } => vec![Event::Pointer {
            x: position.x as f32,
            y: position.y as f32,
        }],
        WindowEvent::DroppedFile(path) => vec![Event::Dropped(path.display().to_string())],
        WindowEvent::CursorLeft { .. } => vec![Event::PointerGone],
        WindowEvent::MouseInput { state, button, .. } => {
            let button = match button {
                MouseButton::Left => PointerButton::Primary,
                MouseButton::Right => PointerButton::Secondary,
                MouseButton::Middle => PointerButton::Middle,
                _ => return Vec::new(),
            };
            let pressed = state == ElementState::Pressed;
            vec![Event::Button { button, pressed }]
        }
        WindowEvent::MouseWheel { delta, .. } => vec![Event::Wheel(match delta {
            MouseScrollDelta::LineDelta(_, lines) => lines,
            // Touch pads: pixels of about a line each.
            MouseScrollDelta::PixelDelta(pixels) => pixels.y as f32 / 20.0,
        })],
        WindowEvent::ModifiersChanged(modifiers) => {
            let state = modifiers.state();
            vec![Event::Modifiers(Modifiers {
                alt: state.alt_key(),
                ctrl: state.control_key(),
                shift: state.shift_key(),
                mac_cmd: cfg!(target_os = "macos") && state.super_key(),
                command: match cfg!(target_os = "macos") {
                    true => state.super_key(),
                    false => state.control_key(),
                },
            })]
        }
        // An uncovered window is redrawn.
        WindowEvent::KeyboardInput { event, .. } => {
            let pressed = event.state == ElementState::Pressed;
            let side = SIDES
                .iter()
                .find(|(code, _)| event.physical_key == PhysicalKey::Code(*code));
            if let Some((_, side)) = side {
                return match pressed {
                    true => vec![Event::See(*side)],
                    false => Vec::new(),
                };
            }
            let mut events = Vec::new();
            let name = match &event.logical_key {
                WinitKey::Named(named) => format!("{named:?}"),
                WinitKey::Character(text) => text.to_uppercase(),
                _ => String::new(),
            };
            if let Some(key) = Key::from_name(&name).filter(|_| !event.repeat) {
                events.push(Event::Key { key, pressed });
            }
            let text = event.text.filter(|_| pressed).map(|t| t.to_string());
            let text = text.filter(|t| t.chars().all(|c| !c.is_control()));
            events.extend(text.map(Event::Text));
            events
        }
        _ => Vec::new(),
    }
}
