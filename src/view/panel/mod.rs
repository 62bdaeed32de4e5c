//! The panel: status and controls.

mod keys;
mod sections;

use egui::{Color32, Frame, ScrollArea, SidePanel};

use super::compare::Against;
use super::lamps::Lamp;
use super::orders::Stage;
use super::snapshot::Progress;
use super::switches::Switches;

/// The status that the panel shows.
pub struct Status<'a> {
    pub scene: &'a str,
    pub triangles: usize,
    pub device: &'a str,
    pub cameras: &'a [String],
    pub progress: Progress,
    /// The stage that a bake waits for.
    pub stage: Option<Stage>,
    pub baking: bool,
    /// Seconds.
    pub frame: Option<f64>,
    /// Time of the detailed picture, if it is shown, seconds.
    pub detail: Option<f64>,
    pub has_relief: bool,
    /// Scenes to choose from, and the one that is being read.
    pub offered: &'a [String],
    pub opening: Option<&'a str>,
    /// Error bounds of the bake: `[seconds, bound]`.
    pub bounds: &'a [[f64; 2]],
    /// The element under the cursor, or the one that was clicked.
    pub element: Option<String>,
    pub can_undo: bool,
    pub can_redo: bool,
    /// Scenes and bakes that were opened before, the latest first.
    pub recent: &'a [String],
    /// Whether there is a bake of this session to be saved.
    pub can_save_bake: bool,
    /// What the view is compared to, with its name.
    pub against: Option<(Against, String)>,
    /// Lines on how far the two are apart.
    pub apart: &'a [String],
    /// The rms difference from the path tracer's picture: `[seconds, difference]`.
    pub differences: &'a [[f64; 2]],
}

/// State that the panel changes.
pub struct Changed<'a> {
    pub switches: &'a mut Switches,
    pub lamps: &'a mut [Lamp],
    /// Index of the lamp that keys change.
    pub lamp: &'a mut usize,
    /// Number of directions of the bake.
    pub directions: &'a mut u32,
    /// Whether the bake is by the paper's method.
    pub paper: &'a mut bool,
    /// Factor of the relief's heights.
    pub relief_scale: &'a mut f64,
}

/// Actions of the panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    Camera(usize),
    SeeAll,
    /// Saves a picture of the view.
    Save,
    SaveBake,
    /// Looks for a scene or a bake to open.
    Browse,
    /// Opens one of [`Status::recent`].
    Recent(usize),
    Undo,
    Redo,
    /// Exposes by the light as it is.
    Meter,
    /// Compares the view to itself as it is, to the path tracer, or to nothing.
    Hold,
    Trace,
    Part,
    /// Bakes with other directions or relief.
    Bake,
    /// Lights the scene by the lamps as they are now.
    Relight,
    /// Shows another scene, an index of [`Status::offered`].
    Open(usize),
}

/// Points across.
pub const WIDTH: f32 = 264.0;

/// Lays out the panel; returns the actions that the user chose.
pub fn show(context: &egui::Context, status: &Status<'_>, changed: &mut Changed<'_>) -> Vec<Asked> {
    let mut asked = Vec::new();
    let style = context.style();
    let frame =
        Frame::side_top_panel(&style).fill(Color32::from_rgba_unmultiplied(24, 24, 24, 236));
    SidePanel::left("panel")
        .exact_width(WIDTH)
        .resizable(false)
        .show_separator_line(false)
        .frame(frame)
        .show(context, |ui| {
            let all = ScrollArea::vertical().auto_shrink(false);
            all.show(ui, |ui| {
                sections::scenes(ui, status, &mut asked);
                sections::progress(ui, status, changed.switches);
                ui.separator();
                sections::light(ui, changed.switches, &mut asked);
                sections::lamps(ui, status, changed, &mut asked);
                if status.has_relief {
                    sections::relief(ui, changed, &mut asked);
                }
                sections::view(ui, status, changed.switches, &mut asked);
                sections::compare(ui, status, changed, &mut asked);
                sections::overlays(ui, changed.switches);
                if let Some(element) = &status.element {
                    ui.separator();
                    ui.label(element);
                }
                ui.separator();
                ui.checkbox(&mut changed.switches.keys, "keys and mouse (F1)");
            });
        });
    asked
}

/// Lists the keys, in a window that can be closed.
pub fn show_keys(context: &egui::Context, open: &mut bool) {
    keys::show(context, open);
}
