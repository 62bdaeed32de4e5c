//! States of the lights that can be undone.

use std::time::{Duration, Instant};

use super::lamps::Lamp;

/// Edits that follow one another within this time are one, as of a field that is dragged.
const TOGETHER: Duration = Duration::from_millis(700);
/// Most states that are kept.
const MOST: usize = 256;

/// The lights before each edit, and after those that were undone.
#[derive(Debug, Default)]
pub struct History {
    past: Vec<Vec<Lamp>>,
    future: Vec<Vec<Lamp>>,
    last: Option<Instant>,
}

impl History {
    /// Keeps the lights as they were before an edit at `now`.
    pub fn edited(&mut self, before: Vec<Lamp>, now: Instant) {
        let goes_on = self.last.is_some_and(|last| now - last < TOGETHER);
        self.last = Some(now);
        self.future.clear();
        if goes_on && !self.past.is_empty() {
            return;
        }
        if self.past.len() == MOST {
            self.past.remove(0);
        }
        self.past.push(before);
    }

    /// The lights before the last edit, in place of those as they are.
    pub fn undo(&mut self, now: &[Lamp]) -> Option<Vec<Lamp>> {
        let before = self.past.pop()?;
        self.future.push(now.to_vec());
        self.last = None;
        Some(before)
    }

    /// The lights before they were last undone.
    pub fn redo(&mut self, now: &[Lamp]) -> Option<Vec<Lamp>> {
        let after = self.future.pop()?;
        self.past.push(now.to_vec());
        self.last = None;
        Some(after)
    }

    pub fn can_undo(&self) -> bool {
        !self.past.is_empty()
    }

    pub fn can_redo(&self) -> bool {
        !self.future.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Lights, PointLight, Scene};
    use crate::view::lamps::lamps;

    #[test]
    fn edits_are_undone_and_redone_one_by_one() {
        let scene = Scene {
            lights: Lights::from(PointLight {
                name: "bulb".into(),
                position: glam::DVec3::ZERO,
                intensity: [1.0; 3],
                beam: None,
            }),
            ..Scene::default()
        };
        let state = |strength: f32| {
            let mut all = lamps(&scene);
            all[0].strength = strength;
            all
        };
        let mut history = History::default();
        let start = Instant::now();
        // 1 to 2 to 3 in one drag, later to 4.
        history.edited(state(1.0), start);
        history.edited(state(2.0), start + TOGETHER / 2);
        history.edited(state(3.0), start + 3 * TOGETHER);
        assert_eq!(history.undo(&state(4.0)), Some(state(3.0)));
        assert_eq!(history.undo(&state(3.0)), Some(state(1.0)));
        assert_eq!(history.undo(&state(1.0)), None);
        assert_eq!(history.redo(&state(1.0)), Some(state(3.0)));
        assert!(history.can_redo());
        // What follows another edit is gone.
        history.edited(state(3.0), start + 6 * TOGETHER);
        assert_eq!(history.redo(&state(5.0)), None);
        assert_eq!(history.undo(&state(5.0)), Some(state(3.0)));
    }
}
