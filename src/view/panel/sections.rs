//! Sections of the panel.

use egui::{
    CollapsingHeader, ComboBox, DragValue, Response, RichText, Slider, Ui, WidgetInfo, WidgetType,
};
use glam::DVec3;

use super::{Asked, Changed, Status};
use crate::render::Show;
use crate::view::compare::Against;
use crate::view::overlay;
use crate::view::switches::{DIRECTIONS, DIRECTS, EXPOSURES, PARTS, SHADINGS, Switches};

/// A section with a title, open at first or not.
fn section(ui: &mut Ui, title: &str, open: bool, content: impl FnOnce(&mut Ui)) {
    CollapsingHeader::new(RichText::new(title).strong())
        .default_open(open)
        .show(ui, content);
}

/// A selectable button whose state screen readers can read, too.
fn choice(ui: &mut Ui, chosen: bool, name: &str) -> Response {
    let response = ui.selectable_label(chosen, name);
    let enabled = ui.is_enabled();
    response
        .widget_info(|| WidgetInfo::selected(WidgetType::SelectableLabel, enabled, chosen, name));
    response
}

/// A selectable button that sets a value.
fn value<T: PartialEq>(ui: &mut Ui, value: &mut T, this: T, name: &str) -> Response {
    let mut response = choice(ui, *value == this, name);
    if response.clicked() && *value != this {
        *value = this;
        response.mark_changed();
    }
    response
}

pub fn scenes(ui: &mut Ui, status: &Status<'_>, asked: &mut Vec<Asked>) {
    let reading = status.opening.map(|name| format!("reading {name}"));
    ComboBox::from_id_salt("scene")
        .width(ui.available_width())
        .selected_text(reading.as_deref().unwrap_or(status.scene))
        .show_ui(ui, |ui| {
            for (i, name) in status.offered.iter().enumerate() {
                if choice(ui, name == status.scene, name).clicked() {
                    asked.push(Asked::Open(i));
                }
            }
        })
        .response
        .on_hover_text("scenes to show; a file can be dropped on the window");
    ui.horizontal(|ui| {
        let open = ui.button("open…").on_hover_text("Ctrl O");
        if open.clicked() {
            asked.push(Asked::Browse);
        }
        ui.menu_button("recent", |ui| {
            if status.recent.is_empty() {
                ui.weak("none yet");
            }
            for (i, name) in status.recent.iter().enumerate() {
                if ui.button(name).clicked() {
                    asked.push(Asked::Recent(i));
                    ui.close();
                }
            }
        });
        let save = egui::Button::new("save bake…");
        let save = ui.add_enabled(status.can_save_bake, save);
        let save = save.on_hover_text("Ctrl S: the light as it is now, as `bake` writes it");
        if save.clicked() {
            asked.push(Asked::SaveBake);
        }
    });
}

/// Lines for values that are not known yet are shown too, so that the controls below do not move
/// during a bake.
pub fn progress(ui: &mut Ui, status: &Status<'_>, switches: &mut Switches) {
    ui.label(format!("{} triangles", status.triangles));
    ui.label(RichText::new(status.device).small().weak());
    let frame = status
        .frame
        .map_or(String::new(), |s| format!("{:.1} ms", 1e3 * s));
    let detail = status
        .detail
        .map_or(String::new(), |s| format!(", detail {s:.1} s"));
    ui.label(format!("frame {frame}{detail}"));
    let progress = &status.progress.update;
    if progress.sources == 0 && !status.baking {
        ui.label("from a file");
        return;
    }
    let bound = progress
        .error_bound
        .map_or("none".to_owned(), |b| format!("{:.2} %", 100.0 * b));
    let time = progress.elapsed.as_secs_f64();
    let left = progress.left.map(|left| left.as_secs_f64());
    ui.label(match (status.stage, status.progress.done, left) {
        (Some(stage), ..) => stage.line().to_owned(),
        (None, true, _) => format!("baked in {time:.1} s"),
        (None, false, Some(left)) => format!("baking, {time:.0} s, about {left:.0} s left"),
        (None, false, None) => format!("baking, {time:.0} s"),
    });
    let (shots, unshot) = (progress.shots, progress.unshot_share);
    let (shot, told) = match progress.sources {
        0 => (0.0, "no shots yet".to_owned()),
        _ => (
            (1.0 - unshot).clamp(0.0, 1.0) as f32,
            format!("{shots} shots, {:.2} % unshot", 100.0 * unshot),
        ),
    };
    ui.add(egui::ProgressBar::new(shot).text(told));
    ui.checkbox(&mut switches.bound, format!("error bound {bound} (B)"))
        .on_hover_text("no element errs by more, over the mean light; draws it over time");
    if switches.bound {
        overlay::bounds(ui, status.bounds);
    }
}

pub fn light(ui: &mut Ui, switches: &mut Switches, asked: &mut Vec<Asked>) {
    section(ui, "Picture", true, |ui| {
        ui.horizontal(|ui| {
            for ((name, part), key) in PARTS.into_iter().zip(["1", "2", "3"]) {
                value(ui, &mut switches.part, part, name).on_hover_text(key);
            }
        });
        ui.horizontal(|ui| {
            ui.label("direct light");
            for (name, direct) in DIRECTS {
                value(ui, &mut switches.direct, direct, name);
            }
        })
        .response
        .on_hover_text("in detailed pictures: shadowed at each pixel, or as it was baked");
        ui.checkbox(&mut switches.ambient, "estimate of unshot light (T)")
            .on_hover_text("what has not been shot yet, spread evenly");
        ui.horizontal(|ui| {
            ui.add(Slider::new(&mut switches.exposure, EXPOSURES).suffix(" EV"))
                .on_hover_text("exposure: , and .");
            let meter = ui.button("meter").on_hover_text(
                "M: expose by the light as it is; the exposure stays while lights are changed",
            );
            if meter.clicked() {
                asked.push(Asked::Meter);
            }
        });
    });
}

/// Lights, with fields for what can be changed.
pub fn lamps(ui: &mut Ui, status: &Status<'_>, changed: &mut Changed<'_>, asked: &mut Vec<Asked>) {
    section(ui, "Lights", true, |ui| {
        if changed.lamps.is_empty() {
            ui.weak("none that can be changed");
        }
        for i in 0..changed.lamps.len() {
            // An unchanged colour may come back rounded.
            if lamp(ui, changed, i) {
                asked.push(Asked::Relight);
            }
        }
        ui.horizontal(|ui| {
            let mut button = |can, name, action, key| {
                let button = ui.add_enabled(can, egui::Button::new(name));
                if button.on_hover_text(key).clicked() {
                    asked.push(action);
                }
            };
            button(status.can_undo, "undo", Asked::Undo, "Ctrl Z");
            button(status.can_redo, "redo", Asked::Redo, "Ctrl Shift Z");
        });
    });
}

/// Whether the light was changed.
fn lamp(ui: &mut Ui, changed: &mut Changed<'_>, i: usize) -> bool {
    let mut edited = false;
    let lamp = &mut changed.lamps[i];
    ui.horizontal(|ui| {
        let chosen = ui.radio_value(changed.lamp, i, "").on_hover_text("L");
        let mut colour = lamp.colour;
        let well = ui.color_edit_button_rgb(&mut colour);
        if well.changed() {
            lamp.colour = colour;
            edited = true;
        }
        let mut strength = lamp.strength;
        let speed = (f64::from(strength) * 0.01).max(1e-3);
        let field = DragValue::new(&mut strength);
        let field = ui.add(field.range(0.0..=1e9).speed(speed));
        let field = field.on_hover_text("+ and -");
        if field.changed() {
            lamp.strength = strength;
            edited = true;
        }
        let name = ui.label(&lamp.name).id;
        for control in [chosen, well, field] {
            control.labelled_by(name);
        }
    });
    if let Some(DVec3 { x, y, z }) = &mut lamp.position {
        ui.horizontal(|ui| {
            for (name, value) in [("x", x), ("y", y), ("z", z)] {
                let mut shown = *value;
                let field = DragValue::new(&mut shown);
                let field = ui.add(field.prefix(format!("{name} ")).speed(0.01));
                if field.on_hover_text("or drag its mark; G").changed() {
                    *value = shown;
                    edited = true;
                }
            }
        });
    }
    edited
}

pub fn relief(ui: &mut Ui, changed: &mut Changed<'_>, asked: &mut Vec<Asked>) {
    section(ui, "Relief", true, |ui| {
        let shading = &mut changed.switches.shading;
        let now = SHADINGS
            .iter()
            .find(|(_, s)| s == shading)
            .map_or("", |s| s.0);
        ComboBox::from_label("shading (Z)")
            .selected_text(now)
            .show_ui(ui, |ui| {
                for (name, this) in SHADINGS {
                    value(ui, shading, this, name);
                }
            });
        ui.horizontal(|ui| {
            ui.label("directions (K)");
            for count in DIRECTIONS {
                let of_count = value(ui, changed.directions, count, &count.to_string());
                if of_count.changed() {
                    asked.push(Asked::Bake);
                }
            }
        })
        .response
        .on_hover_text("slots into which the light on relief is sorted; bakes anew");
        let scale = Slider::new(changed.relief_scale, 0.0..=3.0).text("height");
        let scale = ui.add(scale);
        // Each height starts a bake: only at the end of a drag, not at each pixel.
        if scale.drag_stopped() || (scale.changed() && !scale.dragged()) {
            asked.push(Asked::Bake);
        }
    });
}

pub fn overlays(ui: &mut Ui, switches: &mut Switches) {
    section(ui, "Overlays", false, |ui| {
        ui.checkbox(&mut switches.elements, "elements (O)")
            .on_hover_text("outlines of the triangles that have one light each");
        ui.checkbox(&mut switches.sources, "sources (P)")
            .on_hover_text("a colour for each group of elements that shoots as one");
        ui.checkbox(&mut switches.slots, "light by direction (H)")
            .on_hover_text("what falls on the relief under the cursor");
        ui.checkbox(&mut switches.items, "item buffer (I)")
            .on_hover_text("what the source of the marked element sees");
        let mut slots = switches.show == Show::Slots;
        let strongest = ui.checkbox(&mut slots, "strongest slots");
        let strongest = strongest.on_hover_text(
            "of relief, in detailed pictures: hue, the direction of most light; grey, none in \
             particular",
        );
        if strongest.changed() {
            switches.show = if slots { Show::Slots } else { Show::Shaded };
        }
    });
}

pub fn view(ui: &mut Ui, status: &Status<'_>, switches: &mut Switches, asked: &mut Vec<Asked>) {
    section(ui, "View", true, |ui| {
        ui.horizontal(|ui| {
            ComboBox::from_id_salt("camera")
                .selected_text("camera (C)")
                .width(110.0)
                .show_ui(ui, |ui| {
                    for (i, name) in status.cameras.iter().enumerate() {
                        if choice(ui, false, name).clicked() {
                            asked.push(Asked::Camera(i));
                        }
                    }
                });
            if ui.button("all").on_hover_text("Home").clicked() {
                asked.push(Asked::SeeAll);
            }
            let save = ui.button("save").on_hover_text("F12: a picture");
            if save.clicked() {
                asked.push(Asked::Save);
            }
        });
        ui.checkbox(&mut switches.detail, "detailed pictures (X)")
            .on_hover_text("of a view that stays: as `render` draws it");
    });
}

pub fn compare(
    ui: &mut Ui,
    status: &Status<'_>,
    changed: &mut Changed<'_>,
    asked: &mut Vec<Asked>,
) {
    section(ui, "Compare", false, |ui| {
        let against = status.against.as_ref().map(|(against, _)| *against);
        ui.horizontal(|ui| {
            let held = against == Some(Against::Held);
            let hold = choice(ui, held, "this view (V)").on_hover_text(
                "holds the light and the switches as they are now on the left of a line; what is \
                 changed then shows on its right",
            );
            if hold.clicked() {
                asked.push(if held { Asked::Part } else { Asked::Hold });
            }
            let traced = against == Some(Against::Traced);
            let trace = choice(ui, traced, "path tracer").on_hover_text(
                "traces the view on the left of a line, with relief as geometry, for as long as it \
                 stays",
            );
            if trace.clicked() {
                asked.push(if traced { Asked::Part } else { Asked::Trace });
            }
        });
        let paper = ui.checkbox(changed.paper, "bake by the paper's method");
        if paper.on_hover_text("as `bake --preset paper`").changed() {
            asked.push(Asked::Bake);
        }
        if let Some((_, name)) = &status.against {
            ui.label(format!("left: {name}"));
        }
        for line in status.apart {
            ui.label(line);
        }
        if status.differences.len() > 1 {
            overlay::bounds(ui, status.differences);
        }
    });
}
