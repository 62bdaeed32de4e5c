//! Events of the window, from the system or from a script.

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
    /// Steps of the wheel, positive away from the user.
    Wheel(f32),
    Key {
        key: Key,
        pressed: bool,
    },
    Text(String),
    /// Look from this side, scene axes.
    See(DVec3),
    Modifiers(Modifiers),
    /// New size of the window, pixels; 0 while it is minimised.
    Resized {
        width: u32,
        height: u32,
    },
    /// Pixels per point.
    Scale(f32),
    /// Whether the window has the keyboard.
    Focus(bool),
    /// A scene or a bake that was dropped on the window: its path.
    Dropped(String),
    Close,
}

impl Event {
    /// Whether the event is input that the user expects an answer to.
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
