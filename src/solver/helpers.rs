//! Devices that draw for another one, each on a thread of its own.

use std::collections::{HashMap, VecDeque};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};

use super::drawer::{Drawer, Row};
use super::readback::Stages;
use crate::error::{Error, Result};

/// A device that draws what it is asked for, in that order, until it is dropped.
pub(super) struct Helper {
    board: Arc<Board>,
    thread: Option<JoinHandle<()>>,
}

/// Where both sides meet.
#[derive(Default)]
struct Board {
    notes: Mutex<Notes>,
    changed: Condvar,
}

#[derive(Default)]
struct Notes {
    wanted: VecDeque<u32>,
    drawing: Vec<u32>,
    rows: HashMap<u32, Row>,
    /// Of the device, since someone asked.
    stages: Stages,
    error: Option<Error>,
    /// No more is wanted, or no more is drawn.
    closed: bool,
}

impl Board {
    fn notes(&self) -> MutexGuard<'_, Notes> {
        self.notes.lock().unwrap_or_else(|e| e.into_inner())
    }

    fn wait<'a>(&self, notes: MutexGuard<'a, Notes>) -> MutexGuard<'a, Notes> {
        self.changed.wait(notes).unwrap_or_else(|e| e.into_inner())
    }

    fn close(&self) {
        self.notes().closed = true;
        self.changed.notify_all();
    }
}

impl Helper {
    pub fn start(drawer: Drawer) -> Self {
        let board = Arc::new(Board::default());
        let of_thread = Arc::clone(&board);
        Self {
            board,
            thread: Some(thread::spawn(move || work(&of_thread, drawer))),
        }
    }

    /// Has a source drawn once it is its turn.
    pub fn ask(&self, source: u32) {
        self.board.notes().wanted.push_back(source);
        self.board.changed.notify_all();
    }

    /// Has sources drawn before all others, those that are not drawn yet.
    pub fn ask_now(&self, sources: &[u32]) {
        let notes = &mut *self.board.notes();
        let under_way = |s: &u32| notes.rows.contains_key(s) || notes.drawing.contains(s);
        let missing: Vec<u32> = sources.iter().copied().filter(|s| !under_way(s)).collect();
        notes.wanted.retain(|s| !missing.contains(s));
        for source in missing.into_iter().rev() {
            notes.wanted.push_front(source);
        }
        self.board.changed.notify_all();
    }

    /// Has what is not being drawn yet drawn in the order of these places; what has none comes last.
    pub fn order(&self, places: &HashMap<u32, usize>) {
        let place = |source: &u32| places.get(source).copied().unwrap_or(usize::MAX);
        let wanted = &mut self.board.notes().wanted;
        wanted.make_contiguous().sort_by_key(place);
    }

    /// What is not being drawn yet need not be.
    pub fn let_be(&self) {
        self.board.notes().wanted.clear();
    }

    /// The row of a source that was asked for; waits until it is drawn.
    pub fn take(&self, source: u32) -> Result<Row> {
        let mut notes = self.board.notes();
        loop {
            if let Some(row) = notes.rows.remove(&source) {
                return Ok(row);
            }
            if let Some(error) = notes.error.take() {
                return Err(error);
            }
            if notes.closed {
                return Err(Error::Device(
                    "a device that drew for another has failed".into(),
                ));
            }
            notes = self.board.wait(notes);
        }
    }

    /// How long the device has taken since the last time.
    pub fn take_stages(&self) -> Stages {
        std::mem::take(&mut self.board.notes().stages)
    }
}

impl Drop for Helper {
    fn drop(&mut self) {
        self.board.close();
        if let Some(thread) = self.thread.take() {
            // What ended it was told to whoever waited for it.
            let _ = thread.join();
        }
    }
}

/// However the thread ends, nobody waits for it for ever.
struct Closes<'a>(&'a Board);

impl Drop for Closes<'_> {
    fn drop(&mut self) {
        self.0.close();
    }
}

fn work(board: &Board, mut drawer: Drawer) {
    let _closes = Closes(board);
    loop {
        let mut notes = board.notes();
        while notes.wanted.is_empty() && !notes.closed {
            notes = board.wait(notes);
        }
        if notes.closed {
            return;
        }
        let count = drawer.slots().min(notes.wanted.len());
        let sources: Vec<u32> = notes.wanted.drain(..count).collect();
        notes.drawing.clone_from(&sources);
        drop(notes);
        let drawn = drawer.draw(&sources);
        let mut notes = board.notes();
        notes.drawing.clear();
        match drawn {
            Ok((rows, stages)) => {
                notes.rows.extend(sources.into_iter().zip(rows));
                notes.stages += stages;
            }
            Err(error) => {
                notes.error = Some(error);
                return;
            }
        }
        drop(notes);
        board.changed.notify_all();
    }
}
