//! Scripts that drive the window: one step a line, for tests and for pictures.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::compare::Against;
use super::event::{Event, Key, Modifiers, PointerButton};
use crate::error::{Error, Result};
use crate::input_file::read_text;

/// One step of a script.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// An event that the user could have caused.
    Do(Event),
    /// Asks the system for a window of this size.
    Resize(u32, u32),
    /// Draws this many frames, each as soon as the last is shown.
    Frames(u64),
    /// Waits until the bake is done.
    Bake,
    /// Waits until what changed lights bring directly is shown.
    Direct,
    /// Waits until the last change of the lights is shown.
    Relit,
    /// Waits until the detailed picture of the view is shown.
    Detail,
    /// Waits until the sources and the item buffer have arrived, if they are to be shown.
    Overlays,
    /// Shows another scene or bake, in place of the one shown.
    Open(String),
    /// Waits this many seconds.
    Wait(f64),
    /// Sets a switch, or a property of a light.
    Set(Vec<String>),
    /// Waits until there is a file of this name.
    Await(PathBuf),
    /// Writes what the window shows to a file: controls, texts, the camera.
    List(PathBuf),
    /// Writes the window's content to a file.
    Screenshot(PathBuf),
    /// Writes the view to a file, drawn as by `render`.
    Save(PathBuf),
    /// Writes the bake to a file.
    SaveBake(PathBuf),
    /// Holds the view as it is on the left of a line, traces it there, or ends that.
    Compare(Option<Against>),
    /// Moves the line to this column.
    Line(f32),
    /// Waits until the picture of the left side is shown.
    Compared,
    /// Behaves as if the system had lost the surface.
    LoseSurface,
}

/// Reads a script; `#` begins a comment.
///
/// # Errors
/// A file that cannot be read; a line that is not a step.
pub fn read(path: &Path) -> Result<Vec<Step>> {
    let text = read_text(path)?;
    let mut steps = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<_> = line.split_whitespace().collect();
        if !words.is_empty() {
            let found = parse(&words).ok_or_else(|| {
                Error::line(path, number, format!("\"{}\" is no step", line.trim()))
            })?;
            steps.extend(found);
        }
    }
    Ok(steps)
}

fn parse(words: &[&str]) -> Option<Vec<Step>> {
    let number = |text: &str| text.parse::<f32>().ok().filter(|n| n.is_finite());
    let pixels = |text: &str| text.parse::<u32>().ok();
    let button = |text: &str| match text {
        "left" => Some(PointerButton::Primary),
        "right" => Some(PointerButton::Secondary),
        "middle" => Some(PointerButton::Middle),
        _ => None,
    };
    let one = |event| Some(vec![Step::Do(event)]);
    match *words {
        ["move", x, y] => one(Event::Pointer {
            x: number(x)?,
            y: number(y)?,
        }),
        ["press", name] => one(Event::Button {
            button: button(name)?,
            pressed: true,
        }),
        ["release", name] => one(Event::Button {
            button: button(name)?,
            pressed: false,
        }),
        ["wheel", steps] => one(Event::Wheel(number(steps)?)),
        ["key", name] => {
            // As in Ctrl+Shift+Z.
            let mut names: Vec<_> = name.split('+').collect();
            let key = Key::from_name(names.pop()?)?;
            let mut held = Modifiers::NONE;
            for name in names {
                held |= match name {
                    "Ctrl" => Modifiers::CTRL | Modifiers::COMMAND,
                    "Shift" => Modifiers::SHIFT,
                    "Alt" => Modifiers::ALT,
                    _ => return None,
                };
            }
            let tap = |pressed| Step::Do(Event::Key { key, pressed });
            let hold = |modifiers| Step::Do(Event::Modifiers(modifiers));
            Some(match held == Modifiers::NONE {
                true => vec![tap(true), tap(false)],
                false => vec![hold(held), tap(true), tap(false), hold(Modifiers::NONE)],
            })
        }
        ["key", name, "down"] => one(Event::Key {
            key: Key::from_name(name)?,
            pressed: true,
        }),
        ["key", name, "up"] => one(Event::Key {
            key: Key::from_name(name)?,
            pressed: false,
        }),
        ["see", side] => one(Event::See(match side {
            "front" => DVec3::Z,
            "right" => DVec3::X,
            "top" => DVec3::Y,
            _ => return None,
        })),
        ["minimise"] => one(Event::Resized {
            width: 0,
            height: 0,
        }),
        ["restore", width, height] => one(Event::Resized {
            width: pixels(width)?,
            height: pixels(height)?,
        }),
        ["close"] => one(Event::Close),
        ["resize", width, height] => Some(vec![Step::Resize(pixels(width)?, pixels(height)?)]),
        ["frames", count] => Some(vec![Step::Frames(count.parse().ok()?)]),
        ["open", ref name @ ..] if !name.is_empty() => Some(vec![Step::Open(name.join(" "))]),
        ["bake"] => Some(vec![Step::Bake]),
        ["direct"] => Some(vec![Step::Direct]),
        ["relit"] => Some(vec![Step::Relit]),
        ["detail"] => Some(vec![Step::Detail]),
        ["overlays"] => Some(vec![Step::Overlays]),
        ["wait", seconds] => Some(vec![Step::Wait(f64::from(number(seconds)?.max(0.0)))]),
        ["set", ref what @ ..] if what.len() > 1 => Some(vec![Step::Set(
            what.iter().map(|w| (*w).to_owned()).collect(),
        )]),
        ["await", path] => Some(vec![Step::Await(path.into())]),
        ["list", path] => Some(vec![Step::List(path.into())]),
        ["screenshot", path] => Some(vec![Step::Screenshot(path.into())]),
        ["save", path] => Some(vec![Step::Save(path.into())]),
        ["save-bake", path] => Some(vec![Step::SaveBake(path.into())]),
        ["compare", "held"] => Some(vec![Step::Compare(Some(Against::Held))]),
        ["compare", "traced"] => Some(vec![Step::Compare(Some(Against::Traced))]),
        ["compare", "off"] => Some(vec![Step::Compare(None)]),
        ["compared"] => Some(vec![Step::Compared]),
        ["line", x] => Some(vec![Step::Line(number(x)?)]),
        ["lose-surface"] => Some(vec![Step::LoseSurface]),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_steps() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("script");
        let text = "# a comment\nmove 10 20.5\n\nkey Home # another\nset light direct\nclose\n";
        std::fs::write(&path, text).expect("written");
        let steps = read(&path).expect("a script");
        assert_eq!(steps.len(), 5);
        assert_eq!(steps[0], Step::Do(Event::Pointer { x: 10.0, y: 20.5 }));
        let key = |pressed| {
            Step::Do(Event::Key {
                key: Key::Home,
                pressed,
            })
        };
        assert_eq!(steps[1..3], [key(true), key(false)]);
        assert_eq!(steps[3], Step::Set(vec!["light".into(), "direct".into()]));
        assert_eq!(steps[4], Step::Do(Event::Close));
    }

    #[test]
    fn what_is_no_step_is_told_with_its_line() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("script");
        for wrong in ["jump", "move 1", "move a b", "key nosuch", "set light"] {
            std::fs::write(&path, format!("frames 1\n{wrong}\n")).expect("written");
            let error = read(&path).expect_err("no step").to_string();
            assert!(
                error.contains("script:2") && error.contains(wrong),
                "{error}"
            );
        }
    }
}
