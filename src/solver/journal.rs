//! The rows of a long bake on disk while it runs.
//!
//! What a solution does follows from the rows of its batches alone. A journal holds them in the
//! order in which they were taken in: rows that are kept on the device with what they hold, those
//! without room by name. A solver of the same scene asks for the same batches, takes in what the
//! journal has of them, draws what had no room again, and so comes to where the first one was.
//!
//! The folder holds parts, each with the batches since the one before.

use std::collections::VecDeque;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use super::coupling::CouplingRow;
use super::makers::{Batch, RowKind};
use super::rows::{Factors, Made, Row};
use super::word_file::Kind;
use crate::atomic_file::is_temporary;
use crate::constants::{FACES, NONE, RECEIVE_LISTS};
use crate::error::{Error, Result};
use crate::passes::buffers::download;
use crate::passes::kept_rows::KeptRows;
use crate::passes::types::{KeptRow, KeptState};
use crate::vk::Device;

/// Where a long bake keeps its rows while it runs: the same bake goes on from them after it was
/// killed, to the same light.
#[derive(Debug, Clone, PartialEq, Eq)]
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
        Ok(part.batches.iter().map(|batch| batch.rows.len()).sum())
    }

    /// Whether there is something to go on from.
    pub fn exist(&self) -> bool {
        part(&self.folder, 0).is_file()
    }
}

const FILE: Kind = Kind {
    magic: b"mesolux batches1",
    name: "rows of a bake",
};

#[derive(Serialize, Deserialize)]
struct Header {
    /// Of the scene, the settings, the program and the devices.
    key: String,
    chunk_words: u32,
    chunks: u32,
    /// How far the chunks were filled before and after; see [`KeptState`].
    filled: [[u32; 3]; 2],
}

/// A part whose lists fit together.
struct Part {
    header: Header,
    batches: Vec<Recorded>,
    /// What the chunks hold between its two states.
    chunk_words: Vec<u32>,
}

const FOREIGN_ROWS: &str = "its rows are not rows of this scene";

impl Part {
    /// Reads a part of a bake of so many sources and words of a coupling row.
    fn read(path: &Path, [sources, words]: [usize; 2]) -> Result<Self> {
        let bad = |what: &str| Error::file(path, what);
        let (header, lists): (Header, _) = FILE.read(path)?;
        let lists: std::result::Result<[Vec<u32>; 5], _> = lists.try_into();
        let [batches, rows, runs, values, chunk_words] =
            lists.map_err(|_| bad("its lists are not those of a part"))?;
        let lists = Lists {
            batches,
            rows,
            runs,
            values,
        };
        let batches = (lists.batches(sources, words)).ok_or_else(|| bad(FOREIGN_ROWS))?;
        let part = Self {
            header,
            batches,
            chunk_words,
        };
        match part.is_in_chunks() {
            true => Ok(part),
            false => Err(bad(FOREIGN_ROWS)),
        }
    }

    /// How far the chunks are filled before and after it.
    fn filled(&self) -> [KeptState; 2] {
        (self.header.filled).map(|[chunk, used, rows]| KeptState { chunk, used, rows })
    }

    fn is_in_chunks(&self) -> bool {
        let [from, to] = self.filled();
        let is_kept = |record: &Record| {
            record.chunk == NONE || (record.chunk, record.first) < (to.chunk, to.used)
        };
        let mut records = self.batches.iter().flat_map(|batch| &batch.rows);
        (from.chunk, from.used) <= (to.chunk, to.used)
            && to.chunk <= self.header.chunks
            && to.used <= self.header.chunk_words
            && records.all(|(record, _)| is_kept(record))
    }
}

/// One row as it lies in a file. Of one without room only the source is meant.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Record {
    source: u32,
    /// `NONE`: there was no room.
    chunk: u32,
    first: u32,
    scale: f32,
    /// Below 0: none.
    share: f32,
    facing_away: u32,
    listed: [u32; RECEIVE_LISTS as usize],
    /// 0 of one that rays found.
    faces: u32,
    counts: [[u32; 3]; FACES as usize],
    /// Lengths of the coupling row.
    runs: u32,
    values: u32,
}

/// Of a batch, what was taken in.
struct Recorded {
    kind: RowKind,
    rows: Vec<(Record, CouplingRow)>,
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
    /// How far the chunks were filled at the end of the last part, and of the last batch.
    filled: [KeptState; 2],
    /// A part could not be written: none is tried again.
    failed: bool,
}

/// The kinds as files have them.
const KINDS: [RowKind; 4] = [
    RowKind::Strong,
    RowKind::Far,
    RowKind::Beam,
    RowKind::Common,
];

fn part(folder: &Path, number: usize) -> PathBuf {
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
        device: &Arc<Device>,
        at: &Checkpoints,
        key: String,
        kept: &KeptRows,
        [sources, words]: [usize; 2],
    ) -> Result<Self> {
        let filled = download::<KeptState>(device, &kept.state, 1)?[0];
        let mut journal = Self {
            folder: at.folder.clone(),
            every: at.every,
            key,
            recorded: VecDeque::new(),
            fresh: Vec::new(),
            parts: 0,
            last: Instant::now(),
            filled: [filled; 2],
            failed: false,
        };
        loop {
            let path = part(&journal.folder, journal.parts);
            if !path.exists() {
                // Parts behind one that is lacking follow nothing.
                remove_from(&journal.folder, journal.parts);
                let (rows, folder) = (journal.rows(), at.folder.display());
                if rows > 0 {
                    tracing::info!("goes on from {folder}: {rows} sources were drawn");
                }
                return Ok(journal);
            }
            match journal.read(&path, kept, [sources, words]) {
                Ok(part) => {
                    kept.restore_between(device, part.filled(), &part.chunk_words)?;
                    journal.filled = [part.filled()[1]; 2];
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
    fn read(&self, path: &Path, kept: &KeptRows, size: [usize; 2]) -> Result<Part> {
        let bad = |what: &str| Error::file(path, what);
        let part = Part::read(path, size)?;
        let header = &part.header;
        if header.key != self.key {
            let what = "of another scene, other settings or another program";
            return Err(bad(what));
        }
        let fits = header.chunk_words == kept.chunk_words && header.chunks == kept.chunk_count();
        if header.filled[0] != array(self.filled[1]) || !fits {
            return Err(bad("not what follows, or made with other memory"));
        }
        match part.chunk_words.len() == kept.words_between(part.filled()) {
            true => Ok(part),
            false => Err(bad(FOREIGN_ROWS)),
        }
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
        Ok(Some(recorded.rows.into_iter().map(row).collect()))
    }

    /// Rows that are still to be asked for.
    pub fn rows(&self) -> usize {
        self.recorded.iter().map(|batch| batch.rows.len()).sum()
    }

    /// Notes a batch that was drawn.
    pub fn add(&mut self, kind: RowKind, made: &Made, kept: &KeptRows) {
        if self.failed {
            return;
        }
        self.filled[1] = made.state.unwrap_or(self.filled[1]);
        let rows = made.rows.iter().map(|row| record(row, kept)).collect();
        self.fresh.push(Recorded { kind, rows });
    }

    /// Writes a part if it is time for one, or `now`, if one was written before. A disk without
    /// room ends the journal, not the bake.
    ///
    /// # Errors
    /// A device that fails.
    pub fn write(&mut self, device: &Arc<Device>, kept: &KeptRows, now: bool) -> Result<()> {
        let is_due = self.last.elapsed() >= self.every || (now && self.parts > 0);
        if self.failed || self.fresh.is_empty() || !is_due {
            return Ok(());
        }
        let lists = Lists::new(&self.fresh);
        let words = kept.download_between(device, self.filled)?;
        let header = Header {
            key: self.key.clone(),
            chunk_words: kept.chunk_words,
            chunks: kept.chunk_count(),
            filled: self.filled.map(array),
        };
        let path = part(&self.folder, self.parts);
        let written = fs::create_dir_all(&self.folder)
            .map_err(|e| Error::write(&self.folder, e))
            .and_then(|()| FILE.write(&path, &header, &lists.words(&words)));
        self.fresh.clear();
        if let Err(error) = written {
            tracing::warn!("{error}: no more of this bake is kept while it runs");
            self.failed = true;
            return Ok(());
        }
        self.parts += 1;
        self.filled[0] = self.filled[1];
        self.last = Instant::now();
        Ok(())
    }
}

fn array(state: KeptState) -> [u32; 3] {
    [state.chunk, state.used, state.rows]
}

fn record(row: &Row, kept: &KeptRows) -> (Record, CouplingRow) {
    let Factors::Kept(place) = row.factors else {
        unreachable!("a team keeps its rows");
    };
    let mut record = Record::zeroed();
    record.source = row.source;
    record.chunk = NONE;
    if place.chunk >= kept.chunk_count() {
        return (record, CouplingRow::default());
    }
    let (runs, values) = row.coupling.lists();
    let mut counts = [[0; 3]; FACES as usize];
    counts[..row.counts.len()].copy_from_slice(&row.counts);
    let record = Record {
        source: row.source,
        chunk: place.chunk,
        first: place.first,
        scale: row.scale,
        share: row.share.unwrap_or(-1.0),
        facing_away: row.facing_away,
        listed: row.listed.map(|count| count as u32),
        faces: row.counts.len() as u32,
        counts,
        runs: runs.len() as u32,
        values: values.len() as u32,
    };
    (record, row.coupling.clone())
}

/// The inverse of [`record`].
fn row((record, coupling): (Record, CouplingRow)) -> Row {
    Row {
        source: record.source,
        scale: record.scale,
        share: (record.share >= 0.0).then_some(record.share),
        coupling,
        factors: Factors::Kept(KeptRow {
            chunk: record.chunk,
            first: record.first,
            scale: record.scale,
        }),
        counts: record.counts[..record.faces as usize].to_vec(),
        facing_away: record.facing_away,
        listed: record.listed.map(u64::from),
    }
}

impl Recorded {
    fn sources(&self) -> impl Iterator<Item = u32> {
        self.rows.iter().map(|(record, _)| record.source)
    }
}

/// Batches as they lie in a file.
#[derive(Default)]
struct Lists {
    /// Kind and number of rows.
    batches: Vec<u32>,
    /// [`Record`]
    rows: Vec<u32>,
    runs: Vec<u32>,
    values: Vec<u32>,
}

impl Lists {
    fn new(batches: &[Recorded]) -> Self {
        let mut lists = Self::default();
        for batch in batches {
            let kind = KINDS.iter().position(|&kind| kind == batch.kind);
            let kind = kind.expect("all kinds are listed") as u32;
            lists.batches.extend([kind, batch.rows.len() as u32]);
            for (record, coupling) in &batch.rows {
                let (runs, values) = coupling.lists();
                (lists.rows).extend_from_slice(bytemuck::cast_slice(&[*record]));
                lists.runs.extend_from_slice(runs.as_flattened());
                (lists.values).extend_from_slice(bytemuck::cast_slice(values));
            }
        }
        lists
    }

    fn words<'a>(&'a self, chunks: &'a [u32]) -> [&'a [u32]; 5] {
        [&self.batches, &self.rows, &self.runs, &self.values, chunks]
    }

    /// The inverse of [`Self::new`]; none if they are no rows of so many sources and words.
    fn batches(&self, sources: usize, words: usize) -> Option<Vec<Recorded>> {
        let records: &[Record] = bytemuck::try_cast_slice(&self.rows).ok()?;
        let mut records = records.iter();
        let (runs, odd) = self.runs.as_chunks::<2>();
        let values: &[f32] = bytemuck::cast_slice(&self.values);
        let (counts, more) = self.batches.as_chunks::<2>();
        let (mut first_run, mut first_value) = (0, 0);
        let mut next = || {
            let record = *records.next()?;
            let of_runs = runs.get(first_run..first_run + record.runs as usize)?;
            let of_values = values.get(first_value..first_value + record.values as usize)?;
            first_run += of_runs.len();
            first_value += of_values.len();
            let coupling = CouplingRow::from_lists(of_runs.to_vec(), of_values.to_vec(), words)?;
            let fits = (record.source as usize) < sources && record.faces <= FACES;
            (fits && record.scale.is_finite()).then_some((record, coupling))
        };
        let batch = |&[kind, rows]: &[u32; 2]| {
            Some(Recorded {
                kind: *KINDS.get(kind as usize)?,
                rows: (0..rows).map(|_| next()).collect::<Option<_>>()?,
            })
        };
        let batches = counts.iter().map(batch).collect::<Option<Vec<_>>>()?;
        (odd.is_empty() && more.is_empty() && records.next().is_none()).then_some(batches)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows with and without room, of two kinds, go to words and back; cut off anywhere they are
    /// refused.
    #[test]
    fn batches_go_to_words_and_back() {
        let coupling = CouplingRow::new(&[0.0, 1.0, 0.0, 0.0, 0.0, 0.5], 2.0);
        let kept = Record {
            source: 4,
            first: 12,
            scale: 2.0,
            share: -1.0,
            faces: FACES,
            counts: [[1, 2, 3]; FACES as usize],
            runs: 2,
            values: 2,
            ..Record::zeroed()
        };
        let loose = Record {
            source: 2,
            chunk: NONE,
            ..Record::zeroed()
        };
        let batch = |kind, rows| Recorded { kind, rows };
        let first = batch(RowKind::Strong, vec![(kept, coupling.clone())]);
        let second = vec![(loose, CouplingRow::default()), (kept, coupling)];
        let lists = Lists::new(&[first, batch(RowKind::Common, second)]);
        let found = lists.batches(5, 6).expect("they are whole");
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].kind, RowKind::Strong);
        assert!(found[1].sources().eq([2, 4]));
        let (record, coupling) = &found[1].rows[1];
        assert_eq!(bytemuck::bytes_of(record), bytemuck::bytes_of(&kept));
        assert_eq!(coupling.words(6), [0.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
        assert!(lists.batches(4, 6).is_none(), "there is no source 4");
        assert!(lists.batches(5, 5).is_none(), "there is no sixth word");
        for cut in 0..4 {
            let mut lists = Lists::new(&found);
            let all = [
                &mut lists.batches,
                &mut lists.rows,
                &mut lists.runs,
                &mut lists.values,
            ];
            all.into_iter().nth(cut).expect("four lists").pop();
            assert!(lists.batches(5, 6).is_none(), "list {cut}");
        }
    }
}
