//! A real mouse works every control of the panel.

use std::collections::BTreeSet;

use super::driven::{Driven, Shown, Widget};
use super::harness::*;

/// All of the panel is seen at once.
const TALL: &str = "480x1300";
/// Pixels of the panel.
const PANEL: f64 = 264.0;
/// Roles of what can be worked.
const ROLES: [&str; 7] = [
    "Button",
    "CheckBox",
    "ColorWell",
    "ComboBox",
    "RadioButton",
    "Slider",
    "SpinButton",
];

/// What a test says of a control: its role, and its name without what changes.
fn label(widget: &Widget) -> String {
    let prefix = |text: &str| text.split(' ').next().unwrap_or_default().to_owned();
    let name = match &widget.role[..] {
        // Fields of a place have their axis before the number; those of sliders have the unit.
        "SpinButton" if widget.name.is_empty() => match widget.text.ends_with("EV") {
            true => "EV".into(),
            false => prefix(&widget.text)
                .trim_matches(|c: char| !c.is_alphabetic())
                .into(),
        },
        "CheckBox" if widget.name.starts_with("error bound") => "error bound".into(),
        "ComboBox" if widget.name.is_empty() => match widget.text.starts_with("camera") {
            true => "camera".into(),
            false => "scene".into(),
        },
        _ => widget.name.clone(),
    };
    format!("{} {name}", widget.role)
}

/// The panel's controls.
fn controls(shown: &Shown) -> Vec<&Widget> {
    let of_panel = |w: &&Widget| ROLES.contains(&&w.role[..]) && w.place[2] <= PANEL;
    shown.widgets.iter().filter(of_panel).collect()
}

struct Panel {
    driven: Driven,
    worked: BTreeSet<String>,
}

impl Panel {
    fn find<'a>(shown: &'a Shown, wanted: &str) -> &'a Widget {
        let found = shown.widgets.iter().find(|w| label(w) == wanted);
        found.unwrap_or_else(|| panic!("no {wanted:?} in\n{shown}"))
    }

    fn control(&mut self, wanted: &str) -> Widget {
        let mut last = None;
        loop {
            let enabled = |shown: &Shown| {
                let found = shown.widgets.iter().find(|w| label(w) == wanted);
                found.is_some_and(|w| w.enabled)
            };
            let shown = self.driven.until(&format!("offering {wanted}"), enabled);
            let found = Self::find(&shown, wanted);
            // Where it stays.
            if last.replace(found.place) == Some(found.place) {
                return found.clone();
            }
        }
    }

    /// Clicks on a control, until what is shown says that it was.
    fn click(&mut self, wanted: &str, holds: impl Fn(&Shown) -> bool) -> Shown {
        let control = self.control(wanted);
        self.driven.click(&control);
        self.worked.insert(wanted.to_owned());
        self.driven.until(&format!("as {wanted} says"), holds)
    }

    fn switch(&mut self, wanted: &str) {
        for _ in 0..2 {
            let before = self.control(wanted).on;
            assert!(before.is_some(), "{wanted} is not on or off");
            self.click(wanted, |shown| Self::find(shown, wanted).on != before);
        }
    }

    /// Chooses each of a row of buttons, and the first one last.
    fn choose(&mut self, names: &[&str]) {
        let labels: Vec<_> = names.iter().map(|name| format!("Button {name}")).collect();
        for chosen in labels[1..].iter().chain(&labels[..1]) {
            self.click(chosen, |shown| {
                let on = |name: &String| Self::find(shown, name).on == Some(name == chosen);
                labels.iter().all(on) && shown.says("baked in")
            });
        }
    }

    /// Chooses something from a list that opens under a control.
    fn pick(&mut self, wanted: &str, name: &str, holds: impl Fn(&Shown) -> bool) {
        let before = self.driven.shown().all("Button").len();
        let open = self.click(wanted, |shown| shown.all("Button").len() > before);
        let choice = open
            .all("Button")
            .into_iter()
            .rev()
            .find(|w| w.name.ends_with(name));
        let choice = choice.unwrap_or_else(|| panic!("no {name:?} in\n{open}"));
        self.driven.click(choice);
        self.driven.until(&format!("showing {name}"), holds);
    }

    /// Drags a field to the right, and types a number into it.
    fn fill(&mut self, wanted: &str, number: f64) {
        let before = self.control(wanted);
        let from = before.at(0.5, 0.5);
        self.driven.drag("1", from, [from[0] + 40.0, from[1]]);
        let rises = |shown: &Shown| Self::find(shown, wanted).value() > before.value();
        self.driven.until(&format!("{wanted} higher"), rises);
        self.driven.click(&before);
        // From the next frame on it is a text.
        self.driven.shown();
        self.driven.key("ctrl+a");
        self.driven
            .tool(&["type", "--delay", "30", &number.to_string()]);
        self.driven.key("Return");
        let typed = |shown: &Shown| (Self::find(shown, wanted).value() - number).abs() < 1e-3;
        self.driven.until(&format!("{wanted} as typed"), typed);
        self.worked.insert(wanted.to_owned());
    }

    fn slide(&mut self, wanted: &str) {
        let slider = self.control(wanted);
        for [from, to] in [[0.5, 0.9], [0.9, 0.5]] {
            let before = Self::find(&self.driven.shown(), wanted).value();
            self.driven
                .drag("1", slider.at(from, 0.5), slider.at(to, 0.5));
            self.driven.until(&format!("{wanted} moved"), |shown| {
                let moved = Self::find(shown, wanted).value() - before;
                moved * (to - from) > 0.1
            });
        }
        self.worked.insert(wanted.to_owned());
    }
}

/// Each control does what it says; there is none that this test does not know.
#[test]
fn the_mouse_works_every_control() {
    let room = Room::new();
    let mut panel = Panel {
        driven: Driven::open(&room, "relief.toml", TALL),
        worked: BTreeSet::new(),
    };

    // Sections close and open.
    for (title, inside) in [
        ("Picture", "Button global"),
        ("Lights", "Button undo"),
        ("Relief", "Button 32"),
        ("View", "Button all"),
        ("Compare", "Button path tracer"),
        ("Overlays", "CheckBox elements (O)"),
    ] {
        let has = move |shown: &Shown| shown.widgets.iter().any(|w| label(w) == inside);
        let open = has(&panel.driven.shown());
        let title = format!("Button {title}");
        panel.click(&title, |shown| has(shown) != open);
        if open {
            panel.click(&title, has);
        }
    }
    let last = panel.driven.shown();
    for control in controls(&last) {
        assert!(control.place[3] < 1300.0, "beyond the window: {control:?}");
    }

    // What is on or off, and what is one of several.
    for control in controls(&last).iter().filter(|w| w.role == "CheckBox") {
        panel.switch(&label(control));
    }
    panel.choose(&["global", "direct", "indirect"]);
    panel.choose(&["sharp", "slots"]);
    panel.choose(&["16", "32", "64"]);
    panel.switch("Button this view (V)");
    panel.switch("Button path tracer");
    for shading in ["clusters", "normal", "parallax", "none", "factored"] {
        panel.pick("ComboBox shading (Z)", shading, |shown| {
            shown.one("ComboBox", "shading").text == shading
        });
    }

    // Lights: the room's bulb, and its lamp.
    for lamp in ["lamp", "bulb"] {
        let chosen = format!("RadioButton {lamp}");
        panel.click(&chosen, |shown| {
            shown.one("RadioButton", lamp).on == Some(true)
        });
        panel.fill(&format!("SpinButton {lamp}"), 3.0);
        let well = format!("ColorWell {lamp}");
        let colour = |shown: &Shown| {
            let [x, y] = Panel::find(shown, &well).at(0.5, 0.5);
            *shown.picture().get_pixel(x as u32, y as u32)
        };
        let before = panel.driven.shown();
        let open = panel.click(&well, |shown| shown.widgets.len() > before.widgets.len());
        // The popup's square of colours, below its controls.
        let [left, _, right, bottom] = Panel::find(&open, &well).place;
        let was = colour(&open);
        let beside = [right + 30.0, bottom + 150.0];
        panel.driven.press("1", beside);
        panel
            .driven
            .until("another colour", |shown| colour(shown) != was);
        panel.driven.key("Escape");
        let as_many = |shown: &Shown| shown.widgets.len() <= before.widgets.len() + 2;
        panel.driven.until("without the colours", as_many);
        assert!(left < right);
    }
    for axis in ["x", "y", "z"] {
        panel.fill(&format!("SpinButton {axis}"), 0.25);
    }
    let brightness = |shown: &Shown| mean(&shown.picture()).iter().sum::<f64>();
    let dark = panel.driven.until("lit", |shown| shown.says("baked in"));
    panel.click("Button meter", |shown| {
        (brightness(shown) / brightness(&dark) - 1.0).abs() > 0.02
    });
    let z = |shown: &Shown| Panel::find(shown, "SpinButton z").value();
    panel.click("Button undo", |shown| (z(shown) - 0.25).abs() > 1e-3);
    panel.click("Button redo", |shown| (z(shown) - 0.25).abs() < 1e-3);
    while panel.driven.shown().one("Button", "undo").enabled {
        let undo = panel.control("Button undo");
        panel.driven.click(&undo);
    }

    // Exposure and height.
    panel.slide("Slider ");
    panel.fill("SpinButton EV", 0.5);
    panel.slide("Slider height");
    panel.fill("SpinButton height", 1.0);
    panel.driven.until("baked", |shown| shown.says("baked in"));

    // The eye, and files.
    let place = |shown: &Shown| glam::DVec3::from(shown.position);
    let first = place(&panel.driven.shown());
    panel.pick("ComboBox camera", "corner", |shown| {
        place(shown).distance(first) > 1.0
    });
    let corner = place(&panel.driven.shown());
    panel.click("Button all", |shown| place(shown).distance(corner) > 0.1);
    let saved = room.path().join("mesolux-0001.png");
    panel.click("Button save", |_| saved.exists());
    let bake = room.path().join("bake.safetensors");
    for (button, title, end) in [
        ("Button open…", "Open a scene or a bake", "Cancel"),
        ("Button save bake…", "Save the bake", "Save"),
    ] {
        let open = |shown: &Shown| shown.find("Window", title).is_some();
        panel.click(button, open);
        let shown = panel.driven.shown();
        let end = shown
            .all("Button")
            .into_iter()
            .rev()
            .find(|w| w.name.ends_with(end));
        panel
            .driven
            .click(end.unwrap_or_else(|| panic!("no end in\n{shown}")));
        panel.driven.until("closed", |shown| !open(shown));
    }
    panel.driven.until("saved", |_| bake.exists());
    // Scenes: the same one, as it was opened last, and by the name it was opened with first.
    let shows = |shown: &Shown, name: &str| {
        Panel::find(shown, "ComboBox scene").text == name && shown.says("baked in")
    };
    let path = room.path().join("relief.toml").display().to_string();
    panel.pick("Button recent", &path, |shown| shows(shown, &path));
    panel.pick("ComboBox scene", "relief.toml", |shown| {
        shows(shown, "relief.toml")
    });
    let known = |control: &&Widget| panel.worked.contains(&label(control));
    let unknown: Vec<_> = controls(&last).into_iter().filter(|w| !known(w)).collect();
    assert!(unknown.is_empty(), "never worked: {unknown:#?}");
    println!("{} controls", panel.worked.len());
}
