//! A part of a journal: batches as they lie in a file, read with suspicion.

use std::path::Path;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::constants::{FACES, NONE, RECEIVE_LISTS};
use crate::error::{Error, Result};
use crate::passes::kept_rows::KeptRows;
use crate::passes::types::{KeptRow, KeptState};
use crate::solver::coupling::CouplingRow;
use crate::solver::makers::RowKind;
use crate::solver::rows::{Factors, Row};
use crate::solver::word_file::Kind;

const FILE: Kind = Kind {
    magic: b"mesolux batches1",
    name: "rows of a bake",
};

#[derive(Serialize, Deserialize)]
pub struct Header {
    /// Of the scene, the settings, the program and the devices.
    pub key: String,
    pub chunk_words: u32,
    pub chunks: u32,
    /// How far the chunks were filled before and after; see [`KeptState`].
    pub filled: [[u32; 3]; 2],
}

/// A part whose lists fit together.
pub struct Part {
    pub header: Header,
    pub batches: Vec<Recorded>,
    /// What the chunks hold between its two states.
    pub chunk_words: Vec<u32>,
}

pub const FOREIGN_ROWS: &str = "its rows are not rows of this scene";

impl Part {
    /// Reads a part of a bake of so many sources and words of a coupling row.
    pub fn read(path: &Path, [sources, words]: [usize; 2]) -> Result<Self> {
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

    /// Writes a part with these batches and what the chunks hold of them.
    pub fn write(
        path: &Path,
        header: &Header,
        batches: &[Recorded],
        chunk_words: &[u32],
    ) -> Result<()> {
        let lists = Lists::new(batches);
        FILE.write(path, header, &lists.words(chunk_words))
    }

    /// How far the chunks are filled before and after it.
    pub fn filled(&self) -> [KeptState; 2] {
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
pub struct Recorded {
    pub kind: RowKind,
    rows: Vec<(Record, CouplingRow)>,
}

/// The kinds as files have them.
const KINDS: [RowKind; 4] = [
    RowKind::Strong,
    RowKind::Far,
    RowKind::Beam,
    RowKind::Common,
];

pub fn array(state: KeptState) -> [u32; 3] {
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
    pub fn new(kind: RowKind, rows: &[Row], kept: &KeptRows) -> Self {
        let rows = rows.iter().map(|row| record(row, kept)).collect();
        Self { kind, rows }
    }

    pub fn sources(&self) -> impl ExactSizeIterator<Item = u32> {
        self.rows.iter().map(|(record, _)| record.source)
    }

    pub fn into_rows(self) -> Vec<Row> {
        self.rows.into_iter().map(row).collect()
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
