//! What a person does to the window, from the system or from a script alike.

pub use egui::{Key, Modifiers, PointerButton};
use glam::DVec3;

#[derive(Debug, Clone, PartialEq)]
pub enum Event {
    /// The pointer is at this pixel.
    Pointer {
        x: f32,
        y: f32,
    },
    /// The pointer has left the window.
    PointerGone,
    Button {
        button: PointerButton,
        pressed: bool,
    },
    /// Steps of the wheel, away from the person.
    Wheel(f32),
    Key {
        key: Key,
        pressed: bool,
    },
    Text(String),
    /// Look from this side, scene axes.
    See(DVec3),
    Modifiers(Modifiers),
    /// The window has so many pixels; none while it is minimised.
    Resized {
        width: u32,
        height: u32,
    },
    /// Pixels a point.
    Scale(f32),
    /// Whether the window has the keyboard.
    Focus(bool),
    Close,
}

impl Event {
    /// Whether a person waits for an answer on the screen.
    pub fn is_input(&self) -> bool {
        matches!(
            self,
            Self::Pointer { .. }
                | Self::Button { .. }
                | Self::Wheel(_)
                | Self::Key { .. }
                | Self::See(_)
        )
    }
}
