//! The rows of a long bake on disk while it runs.
//!
//! What a solution does follows from the rows of its batches alone. A journal holds them in the
//! order in which they were taken in: rows that are kept on the device with what they hold, those
//! without room by name. A solver of the same scene asks for the same batches, takes in what the
//! journal has of them, draws what had no room again, and so comes to where the first one was.
//!
//! The folder holds parts, each with the batches since the one before.

mod part;

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use part::{Header, Part, Recorded};
use serde::{Deserialize, Serialize};

use super::makers::{Batch, RowKind};
use super::messages::state_words;
use super::rows::{Made, Row};
use super::team::Team;
use crate::atomic_file::is_temporary;
use crate::error::{Error, Result};
use crate::passes::types::KeptState;
use crate::passes::words::Words;

/// Where a long bake keeps its rows while it runs: the same bake goes on from them after it was
/// killed, to the same light.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Checkpoints {
    /// Made when it is first needed.
    pub folder: PathBuf,
    /// Between two of its parts.
    pub every: Duration,
    /// What else the rows depend on: the program. A checkpoint of another one is not used.
    pub maker: String,
}

impl Checkpoints {
    /// Removes what is there, the last part first: what is left is a checkpoint at any time.
    pub fn remove(&self) {
        remove_from(&self.folder, 0);
    }

    /// The rows in one part of a bake of so many sources and words of a coupling row. For fuzzing.
    #[doc(hidden)]
    pub fn read_part(path: &Path, size: [usize; 2]) -> Result<usize> {
        let part = Part::read(path, size)?;
        Ok(part.batches.iter().map(|batch| batch.sources().len()).sum())
    }

    /// Whether there is something to go on from.
    pub fn exist(&self) -> bool {
        path_of(&self.folder, 0).is_file()
    }
}

pub(super) struct Journal {
    folder: PathBuf,
    every: Duration,
    key: String,
    /// Read from the folder and not yet asked for, oldest first.
    recorded: VecDeque<Recorded>,
    /// Taken in since the last part.
    fresh: Vec<Recorded>,
    parts: usize,
    last: Instant,
    /// How far the chunks of each member were filled at the end of the last part, and of the last
    /// batch.
    filled: Vec<[KeptState; 2]>,
    /// A part could not be written: none is tried again.
    failed: bool,
}

fn path_of(folder: &Path, number: usize) -> PathBuf {
    folder.join(format!("{number:04}.rows"))
}

/// Removes the parts from `first` on, the last one first, what a killed writer has left, and the
/// folder if it is empty then. What cannot be removed is of another bake or of one that is done.
fn remove_from(folder: &Path, first: usize) {
    let mut parts = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let number = (name.to_str())
            .and_then(|name| name.strip_suffix(".rows"))
            .and_then(|number| number.parse::<usize>().ok());
        match number {
            Some(number) if number >= first => parts.push((number, entry.path())),
            _ if is_temporary(&name) => drop(fs::remove_file(entry.path())),
            _ => {}
        }
    }
    parts.sort();
    for (_, path) in parts.iter().rev() {
        let _ = fs::remove_file(path);
    }
    let _ = fs::remove_dir(folder);
}

impl Journal {
    /// Brings what is in the folder to the device. What is of another bake or damaged is removed.
    ///
    /// # Errors
    /// A device that fails.
    pub fn open(
        team: &mut Team,
        at: &Checkpoints,
        key: String,
        [sources, words]: [usize; 2],
    ) -> Result<Self> {
        let states = team.states()?;
        let mut journal = Self {
            folder: at.folder.clone(),
            every: at.every,
            key,
            recorded: VecDeque::new(),
            fresh: Vec::new(),
            parts: 0,
            last: Instant::now(),
            filled: states.into_iter().map(|state| [state; 2]).collect(),
            failed: false,
        };
        loop {
            let path = path_of(&journal.folder, journal.parts);
            if !path.exists() {
                // Parts behind one that is lacking follow nothing.
                remove_from(&journal.folder, journal.parts);
                let (rows, folder) = (journal.rows(), at.folder.display());
                if rows > 0 {
                    tracing::info!("goes on from {folder}: {rows} sources were drawn");
                }
                return Ok(journal);
            }
            match journal.read(&path, team, [sources, words]) {
                Ok(part) => {
                    let filled: Vec<KeptState> = part.filled().map(|[_, to]| to).collect();
                    let places = part.places(filled.len());
                    let words = part.chunk_words.into_iter().map(Words::from).collect();
                    team.restore(&filled, words, places)?;
                    journal.filled = filled.into_iter().map(|state| [state; 2]).collect();
                    journal.recorded.extend(part.batches);
                    journal.parts += 1;
                }
                Err(error) => {
                    tracing::warn!("{error}: it is not used");
                    remove_from(&journal.folder, journal.parts);
                    return Ok(journal);
                }
            }
        }
    }

    /// Reads the part that comes next.
    fn read(&self, path: &Path, team: &Team, size: [usize; 2]) -> Result<Part> {
        let bad = |what: &str| Error::file(path, what);
        let part = Part::read(path, size)?;
        let header = &part.header;
        if header.key != self.key {
            let what = "of another scene, other settings, another device or another program";
            return Err(bad(what));
        }
        let follows = header.filled.len() == self.filled.len()
            && (part.filled().zip(&self.filled))
                .all(|([from, _], filled)| state_words(from) == state_words(filled[1]));
        if header.room != team.room || !follows {
            return Err(bad("not what follows, or made with other memory"));
        }
        Ok(part)
    }

    /// The recorded rows of the next batch; none after the last recorded batch.
    ///
    /// # Errors
    /// Another batch than was asked for when it was written.
    pub fn next(&mut self, batch: &Batch) -> Result<Option<Vec<Row>>> {
        let Some(recorded) = self.recorded.pop_front() else {
            return Ok(None);
        };
        let asked = batch.sources.iter().copied();
        if recorded.kind != batch.kind || !recorded.sources().eq(asked) {
            let what = "this bake asks for other sources than the one that wrote it: remove it";
            return Err(Error::file(&self.folder, what));
        }
        Ok(Some(recorded.into_rows()))
    }

    /// Sources of the next recorded batch: how many are begun at once may depend on time.
    pub fn next_size(&self) -> Option<usize> {
        let recorded = self.recorded.front()?;
        Some(recorded.sources().len())
    }

    /// Rows that are still to be asked for.
    pub fn rows(&self) -> usize {
        self.recorded
            .iter()
            .map(|batch| batch.sources().len())
            .sum()
    }

    /// Notes a batch that was drawn.
    pub fn add(&mut self, kind: RowKind, made: &Made) {
        if self.failed {
            return;
        }
        for (filled, &state) in self.filled.iter_mut().zip(made.states.iter().flatten()) {
            filled[1] = state;
        }
        self.fresh.push(Recorded::new(kind, &made.rows));
    }

    /// Writes a part if it is time for one, or `now`, if one was written before. A disk without
    /// room ends the journal, not the bake.
    ///
    /// # Errors
    /// A device that fails.
    pub fn write(&mut self, team: &mut Team, now: bool) -> Result<()> {
        let is_due = self.last.elapsed() >= self.every || (now && self.parts > 0);
        if self.failed || self.fresh.is_empty() || !is_due {
            return Ok(());
        }
        let words = team.words(&self.filled)?;
        let header = Header {
            key: self.key.clone(),
            room: team.room.clone(),
            filled: self
                .filled
                .iter()
                .map(|states| states.map(state_words))
                .collect(),
        };
        let path = path_of(&self.folder, self.parts);
        let written = fs::create_dir_all(&self.folder)
            .map_err(|e| Error::write(&self.folder, e))
            .and_then(|()| Part::write(&path, &header, &self.fresh, &words));
        self.fresh.clear();
        if let Err(error) = written {
            tracing::warn!("{error}: no more of this bake is kept while it runs");
            self.failed = true;
            return Ok(());
        }
        self.parts += 1;
        for filled in &mut self.filled {
            filled[0] = filled[1];
        }
        self.last = Instant::now();
        Ok(())
    }
}
