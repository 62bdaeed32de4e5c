//! A light that follows the pointer, as in Blender: from where it is, in the plane that faces the
//! eye, or along an axis.

use glam::DVec3;

use super::Viewer;
use crate::view::event::Key;
use crate::view::lamps::Lamp;

/// A light that is moved.
pub struct Grab {
    lamp: usize,
    /// Its place before.
    position: DVec3,
    /// The lights before.
    before: Vec<Lamp>,
    /// Where the pointer was, pixels.
    start: (f32, f32),
    axis: Option<DVec3>,
    /// Whether the button of the mouse is held down: its release ends the move.
    pub dragged: bool,
}

/// Keys that keep a move to an axis.
const AXES: [(Key, DVec3); 3] = [(Key::X, DVec3::X), (Key::Y, DVec3::Y), (Key::Z, DVec3::Z)];
/// Points within which the mark of a light is pressed.
const NEAR: f64 = 10.0;

impl Viewer {
    /// Makes the chosen light follow the pointer.
    pub(super) fn grab(&mut self, dragged: bool) {
        let Some(lamp) = self.lamps.get(self.lamp) else {
            return;
        };
        let Some(position) = lamp.position else {
            self.say(format!("{} has no surface to move", lamp.name));
            return;
        };
        if let Some(start) = self.input.pointer {
            self.input.grabbed = Some(Grab {
                lamp: self.lamp,
                position,
                before: self.lamps.clone(),
                start,
                axis: None,
                dragged,
            });
        }
    }

    /// The light whose mark is under the pointer.
    pub(super) fn lamp_at(&self, (x, y): (f32, f32)) -> Option<usize> {
        let near = |lamp: &Lamp| {
            let (across, down) = self.eye.pixel(lamp.position?, self.size)?;
            let away = (across - f64::from(x)).hypot(down - f64::from(y));
            (away <= NEAR * f64::from(self.scale)).then_some(away)
        };
        let marks = self.lamps.iter().enumerate();
        let marks = marks.filter_map(|(i, lamp)| Some((near(lamp)?, i)));
        marks.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, i)| i)
    }

    /// The place under a pixel in the plane through `place` that faces the eye.
    fn beside(&self, place: DVec3, (x, y): (f32, f32)) -> Option<DVec3> {
        let eye = self.eye.camera.position;
        let middle = (f64::from(self.size.0) / 2.0, f64::from(self.size.1) / 2.0);
        let forward = self.eye.ray(middle, self.size);
        let ray = self.eye.ray((f64::from(x), f64::from(y)), self.size);
        let depth = (place - eye).dot(forward);
        let along = depth / ray.dot(forward);
        (along.is_finite() && depth > 0.0).then(|| eye + ray * along)
    }

    /// Moves the light by as much as the pointer has moved.
    pub(super) fn drag_lamp(&mut self) {
        let (Some(grab), Some(pointer)) = (&self.input.grabbed, self.input.pointer) else {
            return;
        };
        let places = [grab.start, pointer].map(|at| self.beside(grab.position, at));
        let [Some(from), Some(to)] = places else {
            return;
        };
        let by = match grab.axis {
            Some(axis) => axis * axis.dot(to - from),
            None => to - from,
        };
        let (lamp, place) = (grab.lamp, grab.position + by);
        self.lamps[lamp].position = Some(place);
        self.relight();
    }

    /// A key while a light is moved.
    pub(super) fn key_while_moving(&mut self, key: Key) {
        let axis = AXES.iter().find(|(name, _)| *name == key).map(|a| a.1);
        match (key, &mut self.input.grabbed) {
            (Key::Enter, _) => self.let_go(true),
            (Key::Escape, _) => self.let_go(false),
            (_, Some(grab)) if axis.is_some() => {
                grab.axis = axis.filter(|_| grab.axis != axis);
                self.drag_lamp();
            }
            _ => {}
        }
    }

    /// Ends the move: leaves the light where it is, or puts it back.
    pub(super) fn let_go(&mut self, stays: bool) {
        let Some(grab) = self.input.grabbed.take() else {
            return;
        };
        let moved = self.lamps[grab.lamp].position != Some(grab.position);
        match (moved, stays) {
            (true, true) => {
                self.history.edited(grab.before, std::time::Instant::now());
                if self.is_moved() {
                    self.light_anew();
                }
            }
            (true, false) => {
                self.lamps = grab.before;
                self.light_anew();
            }
            (false, _) => {}
        }
    }

    /// What a move in progress is, and how it ends.
    pub(super) fn moving_line(&self) -> Option<String> {
        let grab = self.input.grabbed.as_ref()?;
        let lamp = &self.lamps[grab.lamp];
        let DVec3 { x, y, z } = lamp.position?;
        let along = AXES.iter().find(|(_, axis)| grab.axis == Some(*axis));
        let along = along.map_or(String::new(), |(key, _)| format!(" along {}", key.name()));
        Some(format!(
            "{}{along}: {x:.3}, {y:.3}, {z:.3}   X Y Z: axis   click, Enter: leave   Escape: back",
            lamp.name
        ))
    }
}
