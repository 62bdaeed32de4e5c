//! Bakes that are saved while the window is open.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard};

use super::Work;
use crate::bake;
use crate::error::{Error, Result};
use crate::view::Save;

/// How bakes are saved, and of what.
pub struct Saves {
    /// The scene, as [`super::Session::open`] takes it.
    pub name: String,
    pub save: Save,
}

/// Paths that wait, and those that are done.
#[derive(Default)]
pub(super) struct Saving {
    asked: Mutex<Vec<PathBuf>>,
    done: Mutex<Vec<(PathBuf, Result<()>)>>,
    /// Whether there is a solution that can be saved.
    possible: AtomicBool,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|e| e.into_inner())
}

impl Saving {
    pub fn ask(&self, path: PathBuf) {
        locked(&self.asked).push(path);
    }

    fn asked(&self) -> Vec<PathBuf> {
        std::mem::take(&mut locked(&self.asked))
    }

    fn tell(&self, path: PathBuf, done: Result<()>) {
        locked(&self.done).push((path, done));
    }

    /// What was saved, or not, since the last call.
    pub fn done(&self) -> Vec<(PathBuf, Result<()>)> {
        std::mem::take(&mut locked(&self.done))
    }

    pub fn allow(&self, possible: bool) {
        self.possible.store(possible, Ordering::SeqCst);
    }

    pub fn is_possible(&self) -> bool {
        self.possible.load(Ordering::SeqCst)
    }
}

impl Work {
    /// Saves what is to be saved.
    pub(super) fn save(&mut self) {
        for path in self.shared.saving.asked() {
            let done = self.save_to(&path);
            self.shared.saving.tell(path, done);
            (self.wake)();
        }
    }

    fn save_to(&mut self, path: &Path) -> Result<()> {
        let Some(solving) = self.solving.as_mut().filter(|solving| !solving.first) else {
            let what = "the bake has not come so far that it can be saved";
            return Err(Error::Usage(what.into()));
        };
        match solving.relit {
            // No more than what lights emit may have been brought.
            Some(_) => drop(solving.solver.gather_coupled(|| true)?),
            None => solving.solver.gather()?,
        }
        let solution = bake::solution(&solving.scene, &solving.solver)?;
        let Saves { name, save } = &self.saves;
        save(path, name, &solving.scene, &solution, &self.given.settings)
    }
}
