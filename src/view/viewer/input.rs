//! Mouse and keys: their effect on the view and the switches.
//!
//! As in Blender, the middle button orbits, with Shift it pans, with Ctrl it zooms; Alt with the
//! left button acts as the middle button. As in games, the right button looks about, and W A S D, Q
//! and E fly.

use egui::RawInput;
use glam::DVec3;

use super::Viewer;
use super::moving::Grab;
use crate::view::camera::Eye;
use crate::view::event::{Event, Key, Modifiers, PointerButton};
use crate::view::pick::first_hit;
use crate::view::switches::{DIRECTIONS, EXPOSURES, PARTS, SHADINGS, next};

/// State of the mouse and the keys.
#[derive(Default)]
pub struct Input {
    /// Events for the panel.
    raw: RawInput,
    modifiers: Modifiers,
    /// Pixels; None while the pointer is outside the window.
    pub pointer: Option<(f32, f32)>,
    drag: Option<Drag>,
    /// A light that follows the pointer.
    pub(super) grabbed: Option<Grab>,
    /// Flying keys that are held down.
    held: Vec<Key>,
    /// The element under the cursor, while something needs it, and the one that was clicked.
    pub hovered: Option<u32>,
    pub chosen: Option<u32>,
    /// Whether a script drives the window.
    pub scripted: bool,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Drag {
    Orbit,
    Pan,
    Near,
    Look,
    /// The line between two sides.
    Line,
    /// A left button that has not moved yet: a click.
    Click,
}

/// Keys that fly, with their directions: right, up, forward.
const WAYS: [(Key, DVec3); 6] = [
    (Key::W, DVec3::Z),
    (Key::S, DVec3::NEG_Z),
    (Key::D, DVec3::X),
    (Key::A, DVec3::NEG_X),
    (Key::E, DVec3::Y),
    (Key::Q, DVec3::NEG_Y),
];
/// Factor of the speed with Shift.
const FASTER: f64 = 4.0;
/// Pixels of a drag that zoom as far as one step of the wheel.
const NEARING: f64 = 20.0;
/// Stops of the exposure for one key press.
const STOP: f32 = 0.25;
/// Factor of a light's strength for one key press.
const BRIGHTER: f32 = 1.25;

impl Input {
    pub fn flies(&self) -> bool {
        !self.held.is_empty()
    }

    pub fn take_raw(&mut self) -> RawInput {
        self.raw.modifiers = self.modifiers;
        self.raw.take()
    }

    fn queue(&mut self, event: egui::Event) {
        self.raw.events.push(event);
    }
}

impl Viewer {
    pub(super) fn take_input(&mut self, event: Event) {
        let modifiers = self.input.modifiers;
        let scale = self.scale;
        let at = |(x, y): (f32, f32)| egui::pos2(x / scale, y / scale);
        match event {
            Event::Pointer { x, y } => {
                self.input.queue(egui::Event::PointerMoved(at((x, y))));
                self.move_pointer((x, y));
            }
            Event::PointerGone => {
                self.input.queue(egui::Event::PointerGone);
                self.input.pointer = None;
                self.input.hovered = None;
            }
            Event::Button { button, pressed } => {
                self.input.queue(egui::Event::PointerButton {
                    pos: at(self.input.pointer.unwrap_or_default()),
                    button,
                    pressed,
                    modifiers,
                });
                self.press(button, pressed);
            }
            Event::Wheel(steps) => {
                self.input.queue(egui::Event::MouseWheel {
                    unit: egui::MouseWheelUnit::Line,
                    delta: egui::vec2(0.0, steps),
                    modifiers,
                });
                if !self.is_over_panel() {
                    self.eye.near(f64::from(steps));
                }
            }
            Event::Key { key, pressed } => {
                // Tab shows the panel. In egui it would also focus a control, which would then take
                // all keys.
                if key != Key::Tab || self.panel_takes_keys() {
                    self.input.queue(egui::Event::Key {
                        key,
                        physical_key: None,
                        pressed,
                        repeat: false,
                        modifiers,
                    });
                }
                self.key(key, pressed);
            }
            // With Ctrl, letters are commands; AltGr may count as Ctrl and Alt.
            Event::Text(_) if (modifiers.ctrl || modifiers.command) && !modifiers.alt => {}
            Event::Text(text) => self.input.queue(egui::Event::Text(text)),
            Event::Modifiers(modifiers) => self.input.modifiers = modifiers,
            Event::Focus(focused) => {
                self.input.raw.focused = focused;
                self.input.queue(egui::Event::WindowFocused(focused));
                if !focused {
                    // Their releases are sent to another window.
                    self.input.held.clear();
                    self.input.drag = None;
                }
            }
            Event::See(side) => self.see(side),
            Event::Resized { .. } | Event::Scale(_) | Event::Dropped(_) | Event::Close => {}
        }
    }

    fn is_over_panel(&self) -> bool {
        self.switches.panel && self.egui.wants_pointer_input()
    }

    /// Whether keys go to a field or to a dialog.
    fn panel_takes_keys(&self) -> bool {
        self.egui.wants_keyboard_input() || self.has_dialog()
    }

    fn move_pointer(&mut self, (x, y): (f32, f32)) {
        let before = self.input.pointer.replace((x, y)).unwrap_or((x, y));
        let across = f64::from(x - before.0);
        let down = f64::from(y - before.1);
        let height = f64::from(self.size.1);
        if self.input.grabbed.is_some() {
            self.drag_lamp();
            return;
        }
        match self.input.drag {
            Some(Drag::Orbit) => self.eye.orbit(across, down),
            Some(Drag::Pan) => self.eye.pan(across, down, height),
            Some(Drag::Near) => self.eye.near(-down / NEARING),
            Some(Drag::Look) => self.eye.look(across, down),
            Some(Drag::Line) => self.line.move_to(x, self.size.0),
            Some(Drag::Click) | None => {}
        }
        self.hover();
    }

    /// Finds the element under the pointer if something needs it: the search is slow in large
    /// scenes.
    fn hover(&mut self) {
        let wanted = self.switches.slots && self.input.drag.is_none() && !self.is_over_panel();
        let pointer = self.input.pointer.filter(|_| wanted);
        self.input.hovered = pointer.and_then(|at| self.element_at(at));
    }

    fn element_at(&self, (x, y): (f32, f32)) -> Option<u32> {
        let ray = self.eye.ray((f64::from(x), f64::from(y)), self.size);
        first_hit(&self.scene, self.eye.camera.position, ray)
    }

    fn press(&mut self, button: PointerButton, pressed: bool) {
        let Modifiers {
            alt, ctrl, shift, ..
        } = self.input.modifiers;
        if let Some(grab) = &self.input.grabbed {
            if pressed || grab.dragged {
                self.let_go(button == PointerButton::Primary);
            }
            return;
        }
        if !pressed {
            let clicked = self.input.drag.take() == Some(Drag::Click);
            if clicked && button == PointerButton::Primary {
                self.click();
            }
            return;
        }
        if self.is_over_panel() {
            return;
        }
        let middle = button == PointerButton::Middle || (button == PointerButton::Primary && alt);
        self.input.drag = match button {
            _ if middle && shift => Some(Drag::Pan),
            _ if middle && ctrl => Some(Drag::Near),
            _ if middle => Some(Drag::Orbit),
            PointerButton::Secondary => Some(Drag::Look),
            PointerButton::Primary if self.is_on_line() => Some(Drag::Line),
            PointerButton::Primary if self.press_lamp() => None,
            PointerButton::Primary => Some(Drag::Click),
            _ => None,
        };
    }

    fn is_on_line(&self) -> bool {
        let pointer = self.input.pointer.filter(|_| self.left.is_some());
        pointer.is_some_and(|(x, _)| self.line.is_at(x, self.size.0, self.scale))
    }

    /// Chooses the light whose mark is under the pointer, and moves it while the button is held.
    fn press_lamp(&mut self) -> bool {
        let marked = self.switches.panel;
        let pointer = self.input.pointer.filter(|_| marked);
        let Some(lamp) = pointer.and_then(|at| self.lamp_at(at)) else {
            return false;
        };
        self.lamp = lamp;
        self.grab(true);
        true
    }

    /// Marks the element under the cursor, or unmarks it if it was marked.
    fn click(&mut self) {
        let found = self.input.pointer.and_then(|at| self.element_at(at));
        self.input.chosen = found.filter(|_| found != self.input.chosen);
    }

    fn key(&mut self, key: Key, pressed: bool) {
        self.input.held.retain(|held| *held != key);
        if !pressed || self.panel_takes_keys() {
            return;
        }
        if self.input.grabbed.is_some() {
            self.key_while_moving(key);
            return;
        }
        if self.input.modifiers.command {
            match key {
                Key::Q => self.closing = true,
                Key::Z if self.input.modifiers.shift => self.redo(),
                Key::Z => self.undo(),
                Key::Y => self.redo(),
                Key::O => self.browse(),
                Key::S => self.ask_where_to_save(),
                _ => {}
            }
            return;
        }
        if WAYS.iter().any(|(way, _)| *way == key) {
            self.input.held.push(key);
            return;
        }
        let switches = &mut self.switches;
        let stops = |ev: f32, by: f32| (ev + by).clamp(*EXPOSURES.start(), *EXPOSURES.end());
        match key {
            Key::Num1 => switches.part = PARTS[0].1,
            Key::Num2 => switches.part = PARTS[1].1,
            Key::Num3 => switches.part = PARTS[2].1,
            Key::Z => switches.shading = next(&SHADINGS, switches.shading),
            Key::T => switches.ambient ^= true,
            Key::X => switches.detail ^= true,
            Key::O => switches.elements ^= true,
            Key::P => switches.sources ^= true,
            Key::H => {
                switches.slots ^= true;
                self.hover();
            }
            Key::B => switches.bound ^= true,
            Key::Tab => switches.panel ^= true,
            Key::Comma => switches.exposure = stops(switches.exposure, -STOP),
            Key::Period => switches.exposure = stops(switches.exposure, STOP),
            Key::I => switches.items ^= true,
            Key::K => {
                let counts = DIRECTIONS.map(|count| ("", count));
                self.directions = next(&counts, self.directions);
                self.bake();
            }
            Key::L if !self.lamps.is_empty() => self.lamp = (self.lamp + 1) % self.lamps.len(),
            Key::Plus | Key::Equals => self.brighten(BRIGHTER),
            Key::Minus => self.brighten(1.0 / BRIGHTER),
            Key::G => self.grab(false),
            Key::M => self.meter(),
            Key::V => self.hold(),
            Key::F1 => switches.keys ^= true,
            Key::C => self.see_camera(self.next_camera),
            Key::Home => self.eye.see_all(),
            Key::F12 => self.save(None),
            Key::Escape => self.input.chosen = None,
            _ => {}
        }
    }

    fn see(&mut self, side: DVec3) {
        self.eye.along(side);
    }

    pub(super) fn see_camera(&mut self, i: usize) {
        let count = self.scene.cameras.len();
        if let Some(camera) = self.scene.cameras.get(i) {
            self.eye = Eye::new(&self.scene, camera);
            self.next_camera = (i + 1) % count;
        }
    }

    /// Flies in the direction of the held keys for the time of a frame.
    pub(super) fn fly(&mut self, seconds: f64) {
        let ways = WAYS.iter().filter(|(key, _)| self.input.held.contains(key));
        let way: DVec3 = ways.map(|(_, way)| *way).sum();
        if way != DVec3::ZERO {
            let speed = match self.input.modifiers.shift {
                true => FASTER,
                false => 1.0,
            };
            self.eye.fly(way.normalize() * speed, seconds);
        }
    }

    fn brighten(&mut self, by: f32) {
        if let Some(lamp) = self.lamps.get_mut(self.lamp) {
            lamp.strength *= by;
            self.relight();
        }
    }
}
