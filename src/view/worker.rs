//! Threads that work on the latest of what is asked.

use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::JoinHandle;

use super::Wake;
use crate::error::Error;

/// The window's end of a thread that is asked for an `A` and finds `F`.
pub struct Worker<A, F> {
    shared: Arc<Shared<A, F>>,
    thread: Option<JoinHandle<()>>,
}

/// The thread's end.
pub struct Desk<A, F> {
    shared: Arc<Shared<A, F>>,
    wake: Wake,
}

struct Shared<A, F> {
    state: Mutex<State<A, F>>,
    changed: Condvar,
}

struct State<A, F> {
    asked: Option<A>,
    /// How often something was asked.
    count: u64,
    found: Option<F>,
    error: Option<Error>,
    closing: bool,
}

impl<A, F> Shared<A, F> {
    fn state(&self) -> MutexGuard<'_, State<A, F>> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }
}

impl<A: Send + 'static, F: Send + 'static> Worker<A, F> {
    /// Starts a thread by `spawn`, which does `work` until [`Desk::next`] gives nothing.
    pub fn new(
        spawn: impl FnOnce(Box<dyn FnOnce() + Send>) -> JoinHandle<()>,
        wake: Wake,
        work: impl FnOnce(&Desk<A, F>) + Send + 'static,
    ) -> Self {
        let shared = Arc::new(Shared {
            state: Mutex::new(State {
                asked: None,
                count: 0,
                found: None,
                error: None,
                closing: false,
            }),
            changed: Condvar::new(),
        });
        let desk = Desk {
            shared: Arc::clone(&shared),
            wake,
        };
        Self {
            shared,
            thread: Some(spawn(Box::new(move || work(&desk)))),
        }
    }

    /// Replaces what was asked; None asks for nothing.
    pub fn ask(&self, asked: Option<A>) {
        {
            let mut state = self.shared.state();
            state.count += 1;
            state.asked = asked;
        }
        self.shared.changed.notify_all();
    }

    /// Whether there is something to take that is `wanted`.
    pub fn has_found(&self, wanted: impl FnOnce(&F) -> bool) -> bool {
        self.shared.state().found.as_ref().is_some_and(wanted)
    }

    /// What was found last, since the last call.
    pub fn take(&self) -> Option<F> {
        self.shared.state().found.take()
    }

    /// What ended the last work.
    pub fn error(&self) -> Option<Error> {
        self.shared.state().error.take()
    }
}

impl<A, F> Drop for Worker<A, F> {
    fn drop(&mut self) {
        self.shared.state().closing = true;
        self.shared.changed.notify_all();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl<A, F> Desk<A, F> {
    /// Waits for what is asked next, with its number; None when the window closes.
    pub fn next(&self) -> Option<(A, u64)> {
        let mut state = self.shared.state();
        loop {
            if state.closing {
                return None;
            }
            if let Some(asked) = state.asked.take() {
                return Some((asked, state.count));
            }
            let changed = self.shared.changed.wait(state);
            state = changed.unwrap_or_else(|e| e.into_inner());
        }
    }

    /// Whether something else was asked since.
    pub fn is_overtaken(&self, number: u64) -> bool {
        let state = self.shared.state();
        state.closing || state.count != number
    }

    pub fn give(&self, found: F) {
        self.shared.state().found = Some(found);
        (self.wake)();
    }

    pub fn fail(&self, error: Error) {
        self.shared.state().error = Some(error);
        (self.wake)();
    }
}
