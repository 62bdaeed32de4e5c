//! What keys and the mouse do.

use egui::{Context, Grid, ScrollArea, Window};

/// What is pressed, and what it does.
const KEYS: [(&str, &str); 33] = [
    ("middle button, Alt and left", "orbit"),
    ("with Shift; Ctrl, or the wheel", "pan; zoom"),
    ("right button", "look about"),
    ("W A S D, Q E; Shift", "fly; faster"),
    ("left button on a surface", "mark an element"),
    ("left button on a light", "drag it"),
    ("1, 2, 3", "all, direct, indirect light"),
    ("T", "estimate of unshot light"),
    (", and .", "darker and brighter picture"),
    ("M", "expose by the light as it is"),
    ("L", "next light"),
    ("+ and -", "brighter and darker light"),
    ("G", "move the light with the mouse"),
    ("then X, Y, Z", "along an axis"),
    ("then click or Enter; Escape", "leave it; put it back"),
    ("Ctrl Z; Ctrl Shift Z", "undo, redo a change of lights"),
    ("Z", "next shading of relief"),
    ("K", "bake with the next number of directions"),
    ("V", "compare with the view as it is; again: end"),
    ("drag the line", "move where the two meet"),
    ("X", "detailed pictures"),
    ("number pad 1, 3, 7", "from the front, right, top"),
    ("C; Home", "next camera; all of the scene"),
    ("O", "outlines of elements"),
    ("P", "colours of sources"),
    ("H", "light by direction under the cursor"),
    ("I", "item buffer of the marked source"),
    ("B", "error bound over time"),
    ("Ctrl O", "open a scene or a bake"),
    ("Ctrl S; F12", "save the bake; the picture"),
    ("Tab", "panel"),
    ("F1", "these keys"),
    ("Ctrl Q", "close"),
];

pub fn show(context: &Context, open: &mut bool) {
    let height = context.content_rect().height() - 80.0;
    Window::new("Keys and mouse")
        .open(open)
        .fade_in(false)
        .fade_out(false)
        .collapsible(false)
        .default_pos([300.0, 16.0])
        .show(context, |ui| {
            ScrollArea::vertical().max_height(height).show(ui, |ui| {
                Grid::new("keys")
                    .num_columns(2)
                    .striped(true)
                    .show(ui, |ui| {
                        for (key, action) in KEYS {
                            ui.strong(key);
                            ui.label(action);
                            ui.end_row();
                        }
                    });
            });
        });
}
