//! Runs a script step by step between frames.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use super::event::Event;
use super::script::Step;
use super::viewer::Viewer;
use crate::error::{Error, Result};

/// A script in progress.
pub struct Runner {
    steps: VecDeque<Step>,
    /// Frames shown since the current step began.
    frames: u64,
    since: Instant,
    begun: bool,
}

/// Interval at which the condition of a waiting step is checked.
const POLLING: Duration = Duration::from_millis(20);
/// Longest time that a system may take to resize the window.
const RESIZING: Duration = Duration::from_secs(5);

impl Runner {
    pub fn new(steps: Vec<Step>) -> Self {
        Self {
            steps: steps.into(),
            frames: 0,
            since: Instant::now(),
            begun: false,
        }
    }

    /// Counts a frame that was shown.
    pub fn shown(&mut self) {
        self.frames += 1;
    }

    /// Latest time of the next call; now draws frames as fast as possible until then.
    pub fn next(&self, now: Instant) -> Option<Instant> {
        match self.steps.front() {
            Some(Step::Wait(seconds)) => Some(self.since + Duration::from_secs_f64(*seconds)),
            Some(Step::Frames(_)) => Some(now),
            Some(_) => Some(now + POLLING),
            None => None,
        }
    }

    /// Whether frames are wanted without any change.
    pub fn wants_frames(&self) -> bool {
        let first = self.steps.front();
        matches!(
            first,
            Some(Step::Frames(_) | Step::List(_) | Step::Screenshot(_))
        )
    }

    /// Does all steps that can be done now. `resize` asks the system for a size.
    ///
    /// # Errors
    /// A step that cannot be done.
    pub fn advance(&mut self, viewer: &mut Viewer, mut resize: impl FnMut(u32, u32)) -> Result<()> {
        while let Some(step) = self.steps.front() {
            let first = !self.begun;
            if first {
                self.begun = true;
                self.frames = 0;
                self.since = Instant::now();
            }
            let done = match step {
                Step::Do(event) => {
                    viewer.handle(event.clone());
                    true
                }
                Step::Resize(width, height) => {
                    if first {
                        resize(*width, *height);
                    }
                    if self.since.elapsed() > RESIZING {
                        return Err(Error::Display(format!(
                            "the window did not become {width}x{height}"
                        )));
                    }
                    viewer.size == (*width, *height)
                }
                Step::Frames(count) => self.frames >= *count,
                Step::Bake => viewer.is_baked(),
                Step::Direct => viewer
                    .edited
                    .as_ref()
                    .is_none_or(|edited| edited.shown_direct),
                Step::Relit => viewer.edited.is_none(),
                Step::Detail => viewer.is_detailed(),
                Step::Overlays => viewer.has_overlays(),
                Step::Open(name) => {
                    if first {
                        viewer.open(name.clone());
                    }
                    viewer.opening.is_none()
                }
                Step::Wait(seconds) => self.since.elapsed().as_secs_f64() >= *seconds,
                Step::Set(words) => {
                    set(viewer, words)?;
                    true
                }
                Step::Await(path) => path.exists(),
                Step::List(path) => {
                    if first {
                        viewer.list(path.clone());
                    }
                    viewer.listing.is_none()
                }
                Step::Screenshot(path) => {
                    if first {
                        viewer.capture = Some(path.clone());
                        viewer.dirty = true;
                    }
                    viewer.capture.is_none()
                }
                Step::Save(path) => {
                    if first {
                        viewer.save(Some(path.clone()));
                    }
                    viewer.saving.is_empty()
                }
                Step::SaveBake(path) => {
                    if first {
                        viewer.saving.push(path.clone());
                        viewer.save_bake(path.clone());
                    }
                    viewer.saving.is_empty()
                }
                Step::Compare(against) => {
                    viewer.compare_to(*against);
                    true
                }
                Step::Compared => viewer.is_compared(),
                Step::Line(column) => {
                    viewer.line.move_to(*column, viewer.size.0);
                    viewer.dirty = true;
                    true
                }
                Step::LoseSurface => {
                    viewer.screen.lose();
                    viewer.dirty = true;
                    true
                }
            };
            if !done {
                return Ok(());
            }
            self.steps.pop_front();
            self.begun = false;
        }
        viewer.handle(Event::Close);
        Ok(())
    }
}

/// `directions 16`, `height 0.5`, `lamp NAME colour 1 0 0`, or a switch.
fn set(viewer: &mut Viewer, words: &[String]) -> Result<()> {
    let wrong = || Error::Usage(format!("\"set {}\" cannot be", words.join(" ")));
    match words {
        [name, value] if name == "directions" => {
            let count = value.parse().map_err(|_| wrong())?;
            crate::math::directions::Directions::new(count)?;
            viewer.directions = count;
            viewer.bake();
        }
        [name, value] if name == "height" => {
            let scale: f64 = value.parse().map_err(|_| wrong())?;
            if !(0.0..=1e3).contains(&scale) {
                return Err(wrong());
            }
            viewer.relief_scale = scale;
            viewer.bake();
        }
        [name, lamp, property, values @ ..] if name == "lamp" => {
            let names: Vec<_> = viewer.lamps.iter().map(|l| l.name.clone()).collect();
            let found = viewer.lamps.iter_mut().find(|l| l.name == *lamp);
            let none = || Error::Usage(format!("no light {lamp}; there are {}", names.join(", ")));
            found.ok_or_else(none)?.set(property, values)?;
            viewer.relight();
        }
        [name, value] => viewer.switches.set(name, value)?,
        _ => return Err(wrong()),
    }
    viewer.dirty = true;
    Ok(())
}
