//! Short notes over the view, which go by themselves.

use std::time::{Duration, Instant};

use egui::{Align2, Color32, Context, Frame, Id, Order, vec2};

/// How long a note stays, and how long an error.
const SHOWN: Duration = Duration::from_secs(4);
const ERROR_SHOWN: Duration = Duration::from_secs(15);
/// Points to what is below.
const EDGE: f32 = 16.0;
/// Most notes at a time.
const MOST: usize = 4;

const ERROR: Color32 = Color32::from_rgb(255, 120, 100);

#[derive(Debug)]
struct Note {
    text: String,
    until: Instant,
    is_error: bool,
}

/// Notes, the oldest first.
#[derive(Debug, Default)]
pub struct Notes(Vec<Note>);

impl Notes {
    pub fn say(&mut self, text: String) {
        self.add(text, SHOWN, false);
    }

    pub fn warn(&mut self, text: String) {
        self.add(text, ERROR_SHOWN, true);
    }

    fn add(&mut self, text: String, shown: Duration, is_error: bool) {
        self.0.retain(|note| note.text != text);
        if self.0.len() == MOST {
            self.0.remove(0);
        }
        self.0.push(Note {
            text,
            until: Instant::now() + shown,
            is_error,
        });
    }

    /// When the next one goes.
    pub fn next_end(&self) -> Option<Instant> {
        self.0.iter().map(|note| note.until).min()
    }

    /// Shows them so many points above the lower edge, the newest at the bottom.
    pub fn show(&mut self, context: &Context, above: f32) {
        let now = Instant::now();
        self.0.retain(|note| note.until > now);
        if self.0.is_empty() {
            return;
        }
        let most = context.content_rect().width() - 32.0;
        egui::Area::new(Id::new("notes"))
            .order(Order::Tooltip)
            .anchor(Align2::CENTER_BOTTOM, vec2(0.0, -EDGE - above))
            .interactable(false)
            .show(context, |ui| {
                ui.set_max_width(most);
                for note in &self.0 {
                    let colour = match note.is_error {
                        true => ERROR,
                        false => Color32::WHITE,
                    };
                    Frame::new()
                        .fill(Color32::from_black_alpha(200))
                        .corner_radius(4.0)
                        .inner_margin(6.0)
                        .show(ui, |ui| ui.colored_label(colour, &note.text));
                }
            });
    }
}
