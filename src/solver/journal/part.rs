//! A part of a journal: batches as they lie in a file, read with suspicion.

use std::path::Path;

use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

use crate::constants::{FACES, RECEIVE_LISTS};
use crate::error::{Error, Result};
use crate::passes::types::{KeptRow, KeptState};
use crate::passes::words::Words;
use crate::solver::coupling::CouplingRow;
use crate::solver::makers::RowKind;
use crate::solver::messages::kept_state;
use crate::solver::rows::Row;
use crate::solver::word_file::Kind;

const FILE: Kind = Kind {
    magic: b"mesolux batches2",
    name: "rows of a bake",
};

#[derive(Serialize, Deserialize)]
pub struct Header {
    /// Of the scene, the settings, the program and the devices.
    pub key: String,
    /// Words of a chunk and number of chunks, `[member]`.
    pub room: Vec<[u32; 2]>,
    /// How far the chunks were filled before and after, see [`KeptState`], `[member]`.
    pub filled: Vec<[[u32; 3]; 2]>,
}

/// A part whose lists fit together.
pub struct Part {
    pub header: Header,
    pub batches: Vec<Recorded>,
    /// What the chunks hold between its two states, `[member]`.
    pub chunk_words: Vec<Vec<u32>>,
}

pub const FOREIGN_ROWS: &str = "its rows are not rows of this scene";

impl Part {
    /// Reads a part of a bake of so many sources and words of a coupling row.
    pub fn read(path: &Path, [sources, words]: [usize; 2]) -> Result<Self> {
        let bad = |what: &str| Error::file(path, what);
        let (header, lists): (Header, _) = FILE.read(path)?;
        let members = header.filled.len();
        let mut lists: std::collections::VecDeque<Vec<u32>> = lists.into();
        if members == 0 || header.room.len() != members || lists.len() != LISTS + members {
            return Err(bad("its lists are not those of a part"));
        }
        let mut next = || lists.pop_front().unwrap_or_default();
        let rows_of = Lists {
            batches: next(),
            rows: next(),
            runs: next(),
            values: next(),
            places: next(),
        };
        let chunk_words = lists.into();
        let batches = rows_of.batches([sources, words, members]);
        let batches = batches.ok_or_else(|| bad(FOREIGN_ROWS))?;
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
        chunk_words: &[Words],
    ) -> Result<()> {
        let lists = Lists::new(batches);
        FILE.write(path, header, &lists.words(chunk_words))
    }

    /// How far the chunks of each member are filled before and after it.
    pub fn filled(&self) -> impl Iterator<Item = [KeptState; 2]> {
        self.header
            .filled
            .iter()
            .map(|states| states.map(kept_state))
    }

    /// Source, chunk and first word of the rows that are kept, `[member][row]`.
    pub fn places(&self, members: usize) -> Vec<Vec<[u32; 3]>> {
        let rows = || self.batches.iter().flat_map(|batch| &batch.rows);
        let of = |member: usize| {
            let place = |row: &RecordedRow| {
                let [chunk, first] = *row.places.get(member)?;
                Some([row.record.source, chunk, first])
            };
            rows().filter_map(place).collect()
        };
        (0..members).map(of).collect()
    }

    /// Whether every member's chunks hold so many words, and all rows lie in them.
    fn is_in_chunks(&self) -> bool {
        let is_filled = |member: usize| {
            let Some([from, to]) = self.filled().nth(member) else {
                return false;
            };
            let [words, chunks] = self.header.room[member];
            let at = |state: KeptState| {
                u64::from(state.chunk) * u64::from(words) + u64::from(state.used)
            };
            let is_kept = |place: &[u32; 2]| (place[0], place[1]) < (to.chunk, to.used);
            let mut rows = self.batches.iter().flat_map(|batch| &batch.rows);
            (from.chunk, from.used) <= (to.chunk, to.used)
                && to.chunk <= chunks
                && from.used <= words
                && to.used <= words
                && (to.chunk < chunks || to.used == 0)
                && at(to) - at(from) == self.chunk_words[member].len() as u64
                && rows.all(|row| row.places.get(member).is_none_or(is_kept))
        };
        (0..self.header.room.len()).all(is_filled)
    }
}

/// One row as it lies in a file. Of one without room only the source is meant.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Record {
    source: u32,
    /// 0: a member had none.
    has_room: u32,
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
    rows: Vec<RecordedRow>,
}

struct RecordedRow {
    record: Record,
    coupling: CouplingRow,
    /// Chunk and first word, `[member]`; empty of a row without room.
    places: Vec<[u32; 2]>,
}

/// Lists of a part before those of the members.
const LISTS: usize = 5;

/// The kinds as files have them.
const KINDS: [RowKind; 4] = [
    RowKind::Strong,
    RowKind::Far,
    RowKind::Beam,
    RowKind::Common,
];

fn record(row: &Row) -> RecordedRow {
    let Some(places) = &row.places else {
        let mut record = Record::zeroed();
        record.source = row.source;
        return RecordedRow {
            record,
            coupling: CouplingRow::default(),
            places: Vec::new(),
        };
    };
    let (runs, values) = row.coupling.lists();
    let mut counts = [[0; 3]; FACES as usize];
    counts[..row.counts.len()].copy_from_slice(&row.counts);
    let record = Record {
        source: row.source,
        has_room: 1,
        scale: row.scale,
        share: row.share.unwrap_or(-1.0),
        facing_away: row.facing_away,
        listed: row.listed.map(|count| count as u32),
        faces: row.counts.len() as u32,
        counts,
        runs: runs.len() as u32,
        values: values.len() as u32,
    };
    RecordedRow {
        record,
        coupling: row.coupling.clone(),
        places: places
            .iter()
            .map(|place| [place.chunk, place.first])
            .collect(),
    }
}

/// The inverse of [`record`].
fn row(recorded: RecordedRow) -> Row {
    let RecordedRow {
        record,
        coupling,
        places,
    } = recorded;
    let place = |[chunk, first]: [u32; 2]| KeptRow {
        chunk,
        first,
        scale: record.scale,
    };
    Row {
        source: record.source,
        scale: record.scale,
        share: (record.share >= 0.0).then_some(record.share),
        coupling,
        places: (record.has_room > 0).then(|| places.into_iter().map(place).collect()),
        counts: record.counts[..record.faces as usize].to_vec(),
        facing_away: record.facing_away,
        listed: record.listed.map(u64::from),
    }
}

impl Recorded {
    pub fn new(kind: RowKind, rows: &[Row]) -> Self {
        let rows = rows.iter().map(record).collect();
        Self { kind, rows }
    }

    pub fn sources(&self) -> impl ExactSizeIterator<Item = u32> {
        self.rows.iter().map(|row| row.record.source)
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
    /// Chunk and first word of rows with room, `[row][member]`.
    places: Vec<u32>,
}

impl Lists {
    fn new(batches: &[Recorded]) -> Self {
        let mut lists = Self::default();
        for batch in batches {
            let kind = KINDS.iter().position(|&kind| kind == batch.kind);
            let kind = kind.expect("all kinds are listed") as u32;
            lists.batches.extend([kind, batch.rows.len() as u32]);
            for row in &batch.rows {
                let (runs, values) = row.coupling.lists();
                (lists.rows).extend_from_slice(bytemuck::cast_slice(&[row.record]));
                lists.places.extend_from_slice(row.places.as_flattened());
                lists.runs.extend_from_slice(runs.as_flattened());
                (lists.values).extend_from_slice(bytemuck::cast_slice(values));
            }
        }
        lists
    }

    fn words<'a>(&'a self, chunks: &'a [Words]) -> Vec<&'a [u32]> {
        let Self {
            batches,
            rows,
            runs,
            values,
            places,
        } = self;
        let own = [batches, rows, runs, values, places].map(Vec::as_slice);
        own.into_iter()
            .chain(chunks.iter().map(Words::words))
            .collect()
    }

    /// The inverse of [`Self::new`]; none if they are no rows of so many sources, words and
    /// members.
    fn batches(&self, [sources, words, members]: [usize; 3]) -> Option<Vec<Recorded>> {
        let records: &[Record] = bytemuck::try_cast_slice(&self.rows).ok()?;
        let mut records = records.iter();
        let (runs, odd) = self.runs.as_chunks::<2>();
        let values: &[f32] = bytemuck::cast_slice(&self.values);
        let (counts, more) = self.batches.as_chunks::<2>();
        let (all_places, odd_places) = self.places.as_chunks::<2>();
        let (mut first_run, mut first_value, mut first_place) = (0, 0, 0);
        let mut next = || {
            let record = *records.next()?;
            let of_runs = runs.get(first_run..first_run + record.runs as usize)?;
            let of_values = values.get(first_value..first_value + record.values as usize)?;
            first_run += of_runs.len();
            first_value += of_values.len();
            let coupling = CouplingRow::from_lists(of_runs.to_vec(), of_values.to_vec(), words)?;
            let own = if record.has_room > 0 { members } else { 0 };
            let places = all_places.get(first_place..first_place + own)?.to_vec();
            first_place += own;
            let fits = (record.source as usize) < sources && record.faces <= FACES;
            (fits && record.scale.is_finite()).then_some(RecordedRow {
                record,
                coupling,
                places,
            })
        };
        let batch = |&[kind, rows]: &[u32; 2]| {
            Some(Recorded {
                kind: *KINDS.get(kind as usize)?,
                rows: (0..rows).map(|_| next()).collect::<Option<_>>()?,
            })
        };
        let batches = counts.iter().map(batch).collect::<Option<Vec<_>>>()?;
        let is_all = odd.is_empty() && more.is_empty() && odd_places.is_empty();
        let is_read = records.next().is_none() && first_place == all_places.len();
        (is_all && is_read).then_some(batches)
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
            has_room: 1,
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
            ..Record::zeroed()
        };
        let row = |record, coupling: &CouplingRow, places: &[[u32; 2]]| RecordedRow {
            record,
            coupling: coupling.clone(),
            places: places.to_vec(),
        };
        let batch = |kind, rows| Recorded { kind, rows };
        let first = batch(
            RowKind::Strong,
            vec![row(kept, &coupling, &[[0, 12], [1, 8]])],
        );
        let second = vec![
            row(loose, &CouplingRow::default(), &[]),
            row(kept, &coupling, &[[0, 40], [2, 0]]),
        ];
        let lists = Lists::new(&[first, batch(RowKind::Common, second)]);
        let found = lists.batches([5, 6, 2]).expect("they are whole");
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].kind, RowKind::Strong);
        assert!(found[1].sources().eq([2, 4]));
        let last = &found[1].rows[1];
        assert_eq!(bytemuck::bytes_of(&last.record), bytemuck::bytes_of(&kept));
        assert_eq!(last.coupling.words(6), [0.0, 2.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(last.places, [[0, 40], [2, 0]]);
        assert!(lists.batches([4, 6, 2]).is_none(), "there is no source 4");
        assert!(lists.batches([5, 5, 2]).is_none(), "there is no sixth word");
        assert!(
            lists.batches([5, 6, 3]).is_none(),
            "there is no third member"
        );
        for cut in 0..5 {
            let mut lists = Lists::new(&found);
            let all = [
                &mut lists.batches,
                &mut lists.rows,
                &mut lists.runs,
                &mut lists.values,
                &mut lists.places,
            ];
            all.into_iter().nth(cut).expect("five lists").pop();
            assert!(lists.batches([5, 6, 2]).is_none(), "list {cut}");
        }
    }
}
