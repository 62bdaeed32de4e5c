//! A window that real keys and a real mouse drive, and what it shows.

use std::fmt;
use std::path::{Path, PathBuf};
use std::process::Child;
use std::time::{Duration, Instant};

use image::RgbImage;
use serde::Deserialize;

use super::display::Display;
use super::harness::*;

/// A control or a text.
#[derive(Debug, Clone, Deserialize)]
pub struct Widget {
    pub role: String,
    pub name: String,
    pub text: String,
    pub number: Option<f64>,
    pub on: Option<bool>,
    pub enabled: bool,
    /// Left, top, right, bottom, pixels.
    pub place: [f64; 4],
}

impl Widget {
    /// The pixel at these shares of its sides.
    pub fn at(&self, across: f64, down: f64) -> [f64; 2] {
        let [left, top, right, bottom] = self.place;
        [left + across * (right - left), top + down * (bottom - top)]
    }

    pub fn value(&self) -> f64 {
        self.number.unwrap_or_else(|| panic!("no number: {self:?}"))
    }
}

/// What the window shows.
#[derive(Debug, Deserialize)]
pub struct Shown {
    pub position: [f64; 3],
    pub look_at: [f64; 3],
    pub widgets: Vec<Widget>,
    #[serde(skip)]
    picture: PathBuf,
}

impl Shown {
    pub fn all(&self, role: &str) -> Vec<&Widget> {
        self.widgets.iter().filter(|w| w.role == role).collect()
    }

    /// The first of a role whose name begins so.
    pub fn find(&self, role: &str, name: &str) -> Option<&Widget> {
        self.all(role)
            .into_iter()
            .find(|w| w.name.starts_with(name))
    }

    pub fn one(&self, role: &str, name: &str) -> &Widget {
        self.find(role, name)
            .unwrap_or_else(|| panic!("no {role} {name:?} in\n{self}"))
    }

    /// Whether a text begins so.
    pub fn says(&self, text: &str) -> bool {
        self.widgets.iter().any(|w| w.text.starts_with(text))
    }

    pub fn picture(&self) -> RgbImage {
        picture(Path::new(""), &self.picture.to_string_lossy())
    }
}

/// A line for each control and text.
impl fmt::Display for Shown {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        for w in &self.widgets {
            let [left, top, ..] = w.place;
            write!(
                to,
                "{left:4.0} {top:4.0} {} {:?} {:?}",
                w.role, w.name, w.text
            )?;
            writeln!(to, " {:?} {:?} {}", w.number, w.on, w.enabled)?;
        }
        Ok(())
    }
}

/// Most times that a test asks what is shown.
const ROUNDS: usize = 2000;
/// Longest time for what follows an event: two cores may have much else to do.
const SOON: Duration = PATIENCE;

pub struct Driven {
    display: Display,
    child: Option<Child>,
    window: String,
    folder: PathBuf,
    round: usize,
}

impl Driven {
    /// Shows a scene of `room`, once it is baked.
    pub fn open(room: &Room, scene: &str, size: &str) -> Self {
        let display = Display::sized(size);
        let mut script = "set detail off\nframes 1\nbake\n".to_owned();
        for k in 0..ROUNDS {
            script += &format!("await {k}.go\nframes 3\nscreenshot {k}.png\nlist {k}.json\n");
        }
        let child = start(&display, size, room.path(), scene, &script);
        let mut driven = Self {
            display,
            child: Some(child),
            window: String::new(),
            folder: room.path().to_owned(),
            round: 0,
        };
        driven.shown();
        driven.window = driven.tool(&["search", "--name", "Mesolux"]);
        driven.tool(&["windowfocus", "--sync", &driven.window.clone()]);
        driven
    }

    pub fn display(&self) -> &str {
        &self.display.name
    }

    pub fn window(&self) -> u32 {
        self.window.parse().expect("the number of a window")
    }

    pub fn tool(&self, args: &[&str]) -> String {
        self.display.xdotool(args)
    }

    /// What is shown once all events so far are answered.
    pub fn shown(&mut self) -> Shown {
        let name = |end: &str| self.folder.join(format!("{}.{end}", self.round));
        std::fs::write(name("go"), "").expect("written");
        wait_for(&name("json"));
        let text = std::fs::read_to_string(name("json")).expect("it was written");
        let mut shown: Shown = serde_json::from_str(&text).expect("a list of what is shown");
        shown.picture = name("png");
        self.round += 1;
        shown
    }

    /// What is shown once that holds.
    pub fn until(&mut self, what: &str, holds: impl Fn(&Shown) -> bool) -> Shown {
        let begin = Instant::now();
        loop {
            let shown = self.shown();
            if holds(&shown) {
                return shown;
            }
            let late = begin.elapsed() > SOON;
            assert!(!late, "not {what}:\n{shown}");
        }
    }

    pub fn point(&self, [x, y]: [f64; 2]) {
        let [x, y] = [x, y].map(|pixels| format!("{pixels:.0}"));
        self.tool(&[
            "mousemove",
            "--window",
            &self.window,
            &x,
            &y,
            "sleep",
            "0.05",
        ]);
    }

    /// A button of the mouse: 1 left, 2 middle, 3 right, 4 and 5 the wheel.
    pub fn press(&self, button: &str, at: [f64; 2]) {
        self.point(at);
        self.tool(&["mousedown", button, "sleep", "0.08", "mouseup", button]);
        self.tool(&["sleep", "0.05"]);
    }

    pub fn click(&self, widget: &Widget) {
        self.press("1", widget.at(0.5, 0.5));
    }

    pub fn drag(&self, button: &str, from: [f64; 2], to: [f64; 2]) {
        self.point(from);
        self.tool(&["mousedown", button, "sleep", "0.08"]);
        // Small steps, as a hand would.
        for step in 1..=8 {
            let share = f64::from(step) / 8.0;
            self.point([0, 1].map(|k| from[k] + share * (to[k] - from[k])));
        }
        self.tool(&["mouseup", button, "sleep", "0.05"]);
    }

    pub fn key(&self, name: &str) {
        self.tool(&["key", name, "sleep", "0.05"]);
    }

    /// Waits until the window has closed after Ctrl Q.
    pub fn closed(mut self) {
        if let Some(child) = self.child.take() {
            finish(child, "closed by a key");
        }
    }
}

/// After a test that failed.
impl Drop for Driven {
    fn drop(&mut self) {
        if let Some(mut child) = self.child.take() {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}
