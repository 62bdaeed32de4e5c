//! The panel: status and controls.

use egui::{Color32, ComboBox, DragValue, RichText, Slider, Ui};
use glam::DVec3;

use super::lamps::Lamp;
use super::orders::Stage;
use super::snapshot::Progress;
use super::switches::{DIRECTIONS, DIRECTS, EXPOSURES, PARTS, SHADINGS, Switches};
use crate::render::Show;

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
    pub messages: &'a [String],
    /// Scenes to choose from, and the one that is being read.
    pub offered: &'a [String],
    pub opening: Option<&'a str>,
    /// Error bounds of the bake: `[seconds, bound]`.
    pub bounds: &'a [[f64; 2]],
    /// The element under the cursor, or the one that was clicked.
    pub element: Option<String>,
}

/// State that the panel changes.
pub struct Changed<'a> {
    pub switches: &'a mut Switches,
    pub lamps: &'a mut [Lamp],
    /// Index of the lamp that keys change.
    pub lamp: &'a mut usize,
    /// Number of directions of the bake.
    pub directions: &'a mut u32,
    /// Factor of the relief's heights.
    pub relief_scale: &'a mut f64,
}

/// Actions of the panel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Asked {
    Camera(usize),
    SeeAll,
    Save,
    /// Bakes with other directions or relief.
    Bake,
    /// Lights the scene by the lamps as they are now.
    Relight,
    /// Shows another scene, an index of [`Status::offered`].
    Open(usize),
}

const ERROR: Color32 = Color32::from_rgb(255, 120, 100);

/// Lays out the panel; returns the actions that the user chose.
pub fn show(context: &egui::Context, status: &Status<'_>, changed: &mut Changed<'_>) -> Vec<Asked> {
    let mut asked = Vec::new();
    egui::Window::new("Mesolux")
        .default_pos([8.0, 8.0])
        .default_width(230.0)
        .resizable(false)
        .fade_in(false)
        .vscroll(true)
        .show(context, |ui| {
            scenes(ui, status, &mut asked);
            show_status(ui, status);
            ui.separator();
            light(ui, changed.switches);
            if status.has_relief {
                ui.separator();
                relief(ui, changed, &mut asked);
            }
            ui.separator();
            overlays(ui, status, changed.switches);
            ui.separator();
            if lamps(ui, changed) {
                asked.push(Asked::Relight);
            }
            ui.separator();
            view(ui, status, changed.switches, &mut asked);
            if let Some(element) = &status.element {
                ui.separator();
                ui.label(element);
            }
            for message in status.messages {
                ui.colored_label(ERROR, message);
            }
        });
    asked
}

fn scenes(ui: &mut Ui, status: &Status<'_>, asked: &mut Vec<Asked>) {
    ComboBox::from_id_salt("scene")
        .width(ui.available_width())
        .selected_text(status.scene)
        .show_ui(ui, |ui| {
            for (i, name) in status.offered.iter().enumerate() {
                if ui.selectable_label(name == status.scene, name).clicked() {
                    asked.push(Asked::Open(i));
                }
            }
        })
        .response
        .on_hover_text("scenes to show; a file can be dropped on the window");
    if let Some(opening) = status.opening {
        ui.label(format!("reading {opening}"));
    }
}

fn show_status(ui: &mut Ui, status: &Status<'_>) {
    ui.label(format!("{} triangles", status.triangles));
    ui.label(RichText::new(status.device).small().weak());
    let frame = status
        .frame
        .map_or(String::new(), |s| format!("{:.1} ms", 1e3 * s));
    let detail = status
        .detail
        .map_or(String::new(), |s| format!(", detail {s:.1} s"));
    ui.label(format!("frame {frame}{detail}"));
    if let Some(stage) = status.stage {
        ui.label(stage.line());
    }
    let progress = &status.progress.update;
    if progress.sources == 0 {
        if !status.baking {
            ui.label("from a file");
        }
        return;
    }
    let bound = progress
        .error_bound
        .map_or("none".to_owned(), |b| format!("{:.2} %", 100.0 * b));
    let time = progress.elapsed.as_secs_f64();
    ui.label(match (status.progress.done, progress.left) {
        (true, _) => format!("baked in {time:.1} s"),
        (false, Some(left)) => format!(
            "baking, {time:.0} s, about {:.0} s left",
            left.as_secs_f64()
        ),
        (false, None) => format!("baking, {time:.0} s"),
    });
    let shot = (1.0 - progress.unshot_share).clamp(0.0, 1.0) as f32;
    ui.add(egui::ProgressBar::new(shot).text(format!(
        "{} shots, {:.2} % unshot",
        progress.shots,
        100.0 * progress.unshot_share
    )));
    ui.label(format!("error bound {bound}"));
}

fn light(ui: &mut Ui, switches: &mut Switches) {
    ui.horizontal(|ui| {
        for ((name, part), key) in PARTS.into_iter().zip(["1", "2", "3"]) {
            ui.selectable_value(&mut switches.part, part, name)
                .on_hover_text(key);
        }
    });
    ui.checkbox(&mut switches.ambient, "estimate of unshot light (T)");
    ui.add(Slider::new(&mut switches.exposure, EXPOSURES).text("exposure"))
        .on_hover_text(", and .");
    ui.horizontal(|ui| {
        ui.label("direct light");
        for (name, direct) in DIRECTS {
            ui.selectable_value(&mut switches.direct, direct, name);
        }
    });
}

fn relief(ui: &mut Ui, changed: &mut Changed<'_>, asked: &mut Vec<Asked>) {
    let shading = &mut changed.switches.shading;
    let now = SHADINGS
        .iter()
        .find(|(_, s)| s == shading)
        .map_or("", |s| s.0);
    ComboBox::from_label("relief (Z)")
        .selected_text(now)
        .show_ui(ui, |ui| {
            for (name, value) in SHADINGS {
                ui.selectable_value(shading, value, name);
            }
        });
    ui.horizontal(|ui| {
        ui.label("directions (K)");
        for count in DIRECTIONS {
            let choice = ui.selectable_value(changed.directions, count, count.to_string());
            if choice.changed() {
                asked.push(Asked::Bake);
            }
        }
    });
    let scale = Slider::new(changed.relief_scale, 0.0..=3.0).text("height");
    let scale = ui.add(scale);
    // Each height starts a bake: only at the end of a drag, not at each pixel.
    if scale.drag_stopped() || (scale.changed() && !scale.dragged()) {
        asked.push(Asked::Bake);
    }
}

fn overlays(ui: &mut Ui, status: &Status<'_>, switches: &mut Switches) {
    ui.checkbox(&mut switches.elements, "elements (O)");
    ui.checkbox(&mut switches.sources, "sources (P)");
    ui.checkbox(&mut switches.slots, "incoming light under the cursor (H)");
    ui.checkbox(&mut switches.items, "item buffer of the source clicked (I)");
    ui.checkbox(&mut switches.bound, "error bound over time (B)");
    if switches.bound {
        super::overlay::bounds(ui, status.bounds);
    }
}

/// Whether a light was changed: an unchanged colour may come back rounded.
fn lamps(ui: &mut Ui, changed: &mut Changed<'_>) -> bool {
    let mut edited = false;
    for (i, lamp) in changed.lamps.iter_mut().enumerate() {
        ui.horizontal(|ui| {
            ui.radio_value(changed.lamp, i, "").on_hover_text("L");
            let mut colour = lamp.colour;
            if ui.color_edit_button_rgb(&mut colour).changed() {
                lamp.colour = colour;
                edited = true;
            }
            let mut strength = lamp.strength;
            let speed = (f64::from(strength) * 0.01).max(1e-3);
            let value = DragValue::new(&mut strength);
            let value = ui.add(value.range(0.0..=1e9).speed(speed));
            if value.on_hover_text("+ and -").changed() {
                lamp.strength = strength;
                edited = true;
            }
            ui.label(&lamp.name);
        });
        if let Some(DVec3 { x, y, z }) = &mut lamp.position {
            ui.horizontal(|ui| {
                for (name, value) in [("x", x), ("y", y), ("z", z)] {
                    let mut shown = *value;
                    let field = DragValue::new(&mut shown);
                    if ui
                        .add(field.prefix(format!("{name} ")).speed(0.01))
                        .changed()
                    {
                        *value = shown;
                        edited = true;
                    }
                }
            });
        }
    }
    edited
}

fn view(ui: &mut Ui, status: &Status<'_>, switches: &mut Switches, asked: &mut Vec<Asked>) {
    ui.horizontal(|ui| {
        ComboBox::from_id_salt("camera")
            .selected_text("camera (C)")
            .show_ui(ui, |ui| {
                for (i, name) in status.cameras.iter().enumerate() {
                    if ui.selectable_label(false, name).clicked() {
                        asked.push(Asked::Camera(i));
                    }
                }
            });
        if ui.button("all (Home)").clicked() {
            asked.push(Asked::SeeAll);
        }
        if ui.button("save (F12)").clicked() {
            asked.push(Asked::Save);
        }
    });
    ui.checkbox(&mut switches.detail, "detailed pictures of still views (X)");
    let mut slots = switches.show == Show::Slots;
    if ui.checkbox(&mut slots, "strongest slots").changed() {
        switches.show = if slots { Show::Slots } else { Show::Shaded };
    }
}
