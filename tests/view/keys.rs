//! Real keys and a real mouse do what the list of keys says.

use std::collections::BTreeSet;

use glam::DVec3;

use super::driven::{Driven, Shown};
use super::harness::*;

const SIZE: (f64, f64) = (640.0, 1000.0);
/// A place of the view beside the panel, on the room's back wall.
const PLACE: [f64; 2] = [440.0, 560.0];

fn eye(shown: &Shown) -> (DVec3, DVec3) {
    (shown.position.into(), shown.look_at.into())
}

fn distance(shown: &Shown) -> f64 {
    let (position, look_at) = eye(shown);
    position.distance(look_at)
}

struct Keys {
    driven: Driven,
    /// Lines of the list whose effect was seen.
    done: BTreeSet<&'static str>,
}

impl Keys {
    /// What a line of the list says was done, and holds.
    fn until(&mut self, line: &'static str, holds: impl Fn(&Shown) -> bool) -> Shown {
        let shown = self.driven.until(line, holds);
        self.done.insert(line);
        shown
    }

    /// Drags with a button and a key held.
    fn drag(&self, held: Option<&str>, button: &str) {
        if let Some(key) = held {
            self.driven.tool(&["keydown", key, "sleep", "0.05"]);
        }
        let to = [PLACE[0] + 40.0, PLACE[1] + 30.0];
        self.driven.drag(button, PLACE, to);
        if let Some(key) = held {
            self.driven.tool(&["keyup", key, "sleep", "0.05"]);
        }
    }

    /// Presses a key twice; each time a switch of the panel turns.
    fn switches(&mut self, line: &'static str, key: &str, name: &str) {
        for _ in 0..2 {
            let on = |shown: &Shown| shown.one("CheckBox", name).on;
            let before = on(&self.driven.shown());
            self.driven.key(key);
            self.until(line, |shown| on(shown) != before);
        }
    }

    /// Opens a section. A click that a busy machine holds too long is none.
    fn open(&mut self, title: &str, inside: &str) {
        let has = |shown: &Shown| shown.widgets.iter().any(|w| w.name.starts_with(inside));
        while let shown = self.driven.shown()
            && !has(&shown)
        {
            self.driven.click(shown.one("Button", title));
        }
    }

    fn undo_all(&mut self) {
        while self.driven.shown().one("Button", "undo").enabled {
            self.driven.key("ctrl+z");
        }
    }

    fn fly(&self, keys: &[&str]) {
        for key in keys {
            self.driven.tool(&["keydown", key]);
        }
        self.driven.tool(&["sleep", "0.3"]);
        for key in keys.iter().rev() {
            self.driven.tool(&["keyup", key]);
        }
    }
}

/// Each line of the list is tried, and none is missing here.
#[test]
fn keys_do_what_their_list_says() {
    let room = Room::new();
    let (width, height) = SIZE;
    let mut keys = Keys {
        driven: Driven::open(&room, "relief.toml", &format!("{width}x{height}")),
        done: BTreeSet::new(),
    };
    keys.open("Overlays", "elements");
    keys.open("Compare", "path tracer");
    move_the_eye(&mut keys);
    look_from_sides(&mut keys);
    switch_what_is_shown(&mut keys);
    compare_with_the_view(&mut keys);
    change_lights(&mut keys);
    move_a_light(&mut keys);
    use_files(&mut keys, &room);

    // The list itself, and its end.
    keys.driven.key("F1");
    let listed = keys.until("F1", |shown| shown.find("Window", "Keys").is_some());
    let start = listed
        .widgets
        .iter()
        .position(|w| w.name == "Keys and mouse");
    let lines: Vec<_> = listed.widgets[start.expect("its window")..]
        .iter()
        .filter(|w| w.role == "Label" && w.text != "Keys and mouse")
        .map(|w| w.text.clone())
        .collect();
    keys.driven.key("F1");
    keys.until("F1", |shown| shown.find("Window", "Keys").is_none());
    keys.driven.key("ctrl+q");
    keys.driven.closed();
    keys.done.insert("Ctrl Q");
    let named: BTreeSet<_> = lines.chunks_exact(2).map(|line| line[0].as_str()).collect();
    assert_eq!(named, keys.done);
}

fn move_the_eye(keys: &mut Keys) {
    let start = keys.driven.shown();
    for (held, button) in [(None, "2"), (Some("alt"), "1")] {
        let (from, at) = eye(&keys.driven.shown());
        keys.drag(held, button);
        keys.until("middle button, Alt and left", |shown| {
            let (position, look_at) = eye(shown);
            position.distance(from) > 0.1
                && look_at.distance(at) < 1e-9
                && (position.distance(at) / from.distance(at) - 1.0).abs() < 1e-9
        });
    }
    let line = "with Shift; Ctrl, or the wheel";
    let (from, at) = eye(&keys.driven.shown());
    keys.drag(Some("shift"), "2");
    keys.until(line, |shown| {
        let (position, look_at) = eye(shown);
        let moved = position - from;
        moved.length() > 0.01 && (look_at - at).distance(moved) < 1e-9
    });
    let before = distance(&keys.driven.shown());
    keys.drag(Some("ctrl"), "2");
    keys.until(line, |shown| (distance(shown) / before - 1.0).abs() > 0.05);
    let before = distance(&keys.driven.shown());
    keys.driven.press("4", PLACE);
    keys.until(line, |shown| distance(shown) < 0.9 * before);
    let (from, at) = eye(&keys.driven.shown());
    keys.drag(None, "3");
    keys.until("right button", |shown| {
        let (position, look_at) = eye(shown);
        position.distance(from) < 1e-9 && look_at.distance(at) > 0.05
    });

    // Flying moves along where one looks, to the right, or up.
    let mut flights = Vec::new();
    for (flown, sign) in [
        (&["w"][..], [0.0, 0.0, 1.0]),
        (&["s"], [0.0, 0.0, -1.0]),
        (&["d"], [1.0, 0.0, 0.0]),
        (&["a"], [-1.0, 0.0, 0.0]),
        (&["e"], [0.0, 1.0, 0.0]),
        (&["q"], [0.0, -1.0, 0.0]),
        (&["shift", "w"], [0.0, 0.0, 1.0]),
        (&["shift", "s"], [0.0, 0.0, -1.0]),
        (&["shift", "w"], [0.0, 0.0, 1.0]),
        (&["shift", "s"], [0.0, 0.0, -1.0]),
    ] {
        let (from, at) = eye(&keys.driven.shown());
        let forward = (at - from).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let way = right * sign[0] + right.cross(forward) * sign[1] + forward * sign[2];
        keys.fly(flown);
        let shown = keys.until("W A S D, Q E; Shift", |shown| {
            let moved = eye(shown).0 - from;
            moved.normalize_or_zero().dot(way) > 0.7
        });
        flights.push(eye(&shown).0.distance(from));
    }
    println!("flown: {flights:.2?}");
    // Four times as fast; a flight takes as long as a busy machine holds a key, so that many count.
    let [plain, fast] =
        [&flights[..6], &flights[6..]].map(|of| of.iter().sum::<f64>() / of.len() as f64);
    assert!(fast > 1.3 * plain, "no faster with Shift");
    keys.driven.key("c");
    let far = |shown: &Shown| eye(shown).0.distance(eye(&start).0);
    keys.until("C; Home", |shown| far(shown) > 1.0);
    keys.driven.key("c");
    keys.until("C; Home", |shown| far(shown) < 1e-9);
}

fn look_from_sides(keys: &mut Keys) {
    let start = keys.driven.shown();
    for (key, axis) in [
        ("KP_End", DVec3::Z),
        ("KP_Page_Down", DVec3::X),
        ("KP_Home", DVec3::Y),
    ] {
        keys.driven.key(key);
        keys.until("number pad 1, 3, 7", |shown| {
            let (position, look_at) = eye(shown);
            (position - look_at).normalize().dot(axis) > 0.999
        });
    }
    let before = distance(&keys.driven.shown());
    keys.driven.key("Home");
    keys.until("C; Home", |shown| {
        (distance(shown) / before - 1.0).abs() > 0.01
    });
    keys.driven.key("c");
    keys.driven.key("c");
    keys.until("C; Home", |shown| {
        eye(shown).0.distance(eye(&start).0) < 1e-9
    });
    keys.driven.press("1", PLACE);
    keys.until("left button on a surface", |shown| shown.says("element "));
}

fn switch_what_is_shown(keys: &mut Keys) {
    for (key, part) in [("2", "direct"), ("3", "indirect"), ("1", "global")] {
        keys.driven.key(key);
        keys.until("1, 2, 3", |shown| {
            shown.one("Button", part).on == Some(true)
        });
    }
    for (line, key, name) in [
        ("T", "t", "estimate of unshot"),
        ("X", "x", "detailed pictures"),
        ("O", "o", "elements"),
        ("P", "p", "sources"),
        ("H", "h", "light by direction"),
        ("I", "i", "item buffer"),
        ("B", "b", "error bound"),
    ] {
        keys.switches(line, key, name);
    }
    let stops = |shown: &Shown| shown.one("Slider", "").value();
    for (key, up) in [("comma", false), ("period", true)] {
        let before = stops(&keys.driven.shown());
        keys.driven.key(key);
        keys.until(", and .", |shown| {
            stops(shown) != before && (stops(shown) > before) == up
        });
    }
    let shading = |shown: &Shown| shown.one("ComboBox", "shading").text.clone();
    let first = shading(&keys.driven.shown());
    for _ in 0..5 {
        let before = shading(&keys.driven.shown());
        keys.driven.key("z");
        keys.until("Z", |shown| shading(shown) != before);
    }
    assert_eq!(shading(&keys.driven.shown()), first);
    for count in ["32", "64", "16"] {
        keys.driven.key("k");
        keys.until("K", |shown| {
            shown.one("Button", count).on == Some(true) && shown.says("baked in")
        });
    }
    keys.driven.key("Tab");
    keys.until("Tab", |shown| shown.all("ComboBox").is_empty());
    keys.driven.key("Tab");
    keys.until("Tab", |shown| !shown.all("ComboBox").is_empty());
}

/// The line begins at 0.6 of the width.
fn compare_with_the_view(keys: &mut Keys) {
    let on = |shown: &Shown| shown.one("Button", "this view").on == Some(true);
    keys.driven.key("v");
    keys.until("V", on);
    keys.driven.key("2");
    keys.driven.until("direct light", |shown| {
        shown.one("Button", "direct").on == Some(true)
    });
    let pixel = |shown: &Shown| *shown.picture().get_pixel(350, 560);
    let before = pixel(&keys.driven.shown());
    let line = 0.6 * SIZE.0;
    keys.driven.drag("1", [line, 560.0], [320.0, 560.0]);
    keys.until("drag the line", |shown| pixel(shown) != before);
    keys.driven.key("1");
    keys.driven.key("v");
    keys.until("V", |shown| !on(shown));
}

fn change_lights(keys: &mut Keys) {
    let strength = |shown: &Shown| shown.one("SpinButton", "bulb").value();
    let lamp = |shown: &Shown| shown.one("RadioButton", "lamp").on == Some(true);
    for chosen in [true, false] {
        keys.driven.key("l");
        keys.until("L", |shown| lamp(shown) == chosen);
    }
    let brightness = |shown: &Shown| {
        let all = shown.picture();
        let view = image::imageops::crop_imm(&all, 300, 300, 300, 400).to_image();
        mean(&view).iter().sum::<f64>()
    };
    let first = keys.driven.shown();
    for _ in 0..12 {
        keys.driven.key("plus");
    }
    keys.until("+ and -", |shown| strength(shown) > 10.0 * strength(&first));
    let bright = keys.driven.until("brighter", |shown| {
        brightness(shown) > 1.2 * brightness(&first)
    });
    keys.driven.key("m");
    keys.until("M", |shown| brightness(shown) < 0.9 * brightness(&bright));
    keys.driven.key("minus");
    let less = keys.until("+ and -", |shown| strength(shown) < strength(&bright));
    keys.driven.key("ctrl+z");
    let line = "Ctrl Z; Ctrl Shift Z";
    // What was changed in quick succession is one change.
    keys.until(line, |shown| strength(shown) != strength(&less));
    keys.driven.key("ctrl+shift+z");
    keys.until(line, |shown| strength(shown) == strength(&less));
    keys.undo_all();
    keys.driven
        .until("as it was", |shown| strength(shown) == strength(&first));
}

/// The bulb, from the front.
fn move_a_light(keys: &mut Keys) {
    let place = |shown: &Shown| -> DVec3 {
        let field = |axis: &str| {
            let found = shown
                .all("SpinButton")
                .into_iter()
                .find(|w| w.text.starts_with(axis));
            found.unwrap_or_else(|| panic!("no {axis}")).value()
        };
        DVec3::new(field("x"), field("y"), field("z"))
    };
    let first = place(&keys.driven.shown());
    let to = [PLACE[0] + 60.0, PLACE[1] + 60.0];
    for (end, stays) in [("Escape", false), ("Return", true)] {
        keys.driven.point(PLACE);
        keys.driven.key("g");
        keys.driven.point(to);
        keys.until("G", |shown| place(shown).distance(first) > 0.05);
        keys.driven.key(end);
        keys.driven.point(PLACE);
        keys.until("then click or Enter; Escape", |shown| {
            (place(shown).distance(first) > 0.05) == stays
        });
    }
    let mut before = place(&keys.driven.shown());
    for (key, axis) in [("x", DVec3::X), ("y", DVec3::Y), ("z", DVec3::Z)] {
        // Along z, which the eye looks along, from where z is seen.
        if key == "z" {
            keys.driven.key("KP_Page_Down");
            keys.driven.until("from the right", |shown| {
                eye(shown).0.x > 1.0 + eye(shown).1.x
            });
        }
        keys.driven.point(PLACE);
        keys.driven.key("g");
        keys.driven.key(key);
        keys.driven.point(to);
        let shown = keys.until("then X, Y, Z", |shown| {
            let moved = place(shown) - before;
            moved.length() > 0.02 && moved.normalize().dot(axis).abs() > 0.999
        });
        keys.driven.press("1", to);
        keys.driven.point(PLACE);
        let after = keys.driven.shown();
        assert_eq!(place(&after), place(&shown), "a click leaves it");
        before = place(&after);
    }
    keys.done.insert("then click or Enter; Escape");

    // By its mark: back where it was, from the first camera.
    keys.undo_all();
    keys.driven.key("c");
    keys.driven.key("c");
    let shown = keys
        .driven
        .until("as it was", |shown| place(shown) == first);
    let (width, height) = SIZE;
    let away = eye(&shown).0.z - first.z;
    let pixels = 0.5 * height / (away * (0.5 * 42.0_f64).to_radians().tan());
    let mark = [
        0.5 * width + pixels * first.x,
        0.5 * height - pixels * first.y,
    ];
    keys.driven.drag("1", mark, [mark[0], mark[1] + 60.0]);
    keys.until("left button on a light", |shown| {
        place(shown).y < first.y - 0.05
    });
    keys.driven.key("ctrl+z");
    keys.driven
        .until("as it was", |shown| place(shown) == first);
}

fn use_files(keys: &mut Keys, room: &Room) {
    let dialog = |shown: &Shown, title: &str| {
        let named = |w: &super::driven::Widget| w.name == title || w.text == title;
        shown.widgets.iter().any(named)
    };
    for (line, key, title) in [
        ("Ctrl O", "ctrl+o", "Open a scene or a bake"),
        ("Ctrl S; F12", "ctrl+s", "Save the bake"),
    ] {
        keys.driven.key(key);
        keys.until(line, |shown| dialog(shown, title));
        // The first leaves the field of the name.
        while dialog(&keys.driven.shown(), title) {
            keys.driven.key("Escape");
        }
    }
    let saved = room.path().join("mesolux-0001.png");
    keys.driven.shown();
    keys.driven.key("F12");
    keys.until("Ctrl S; F12", |_| saved.exists());
}
