//! Rows that are kept in parts, by the members of a team, as the rows of one that has all elements,
//! and back. A row is a table, of where the factors of each block of GROUP elements begin, and the
//! factors of the blocks that see the source: see `allocate.comp`.

use std::ops::Range;

use super::messages::RestoredRows;
use super::shares::Share;
use crate::constants::GROUP;
use crate::passes::fresh_rows::{RowShape, Span};
use crate::passes::types::KeptRow;
use crate::passes::words::Words;

/// Words of the factors of a block, without and with a relief.
const BLOCK_WORDS: [usize; 2] = [GROUP as usize / 2, (GROUP / 2 + GROUP) as usize];

/// Words of a table: factors begin at a whole texel.
fn table_words(shape: RowShape) -> usize {
    (shape.blocks() as usize).next_multiple_of(4)
}

/// Words of a block, counted in a row of this shape.
fn block_words(shape: RowShape, block: usize) -> usize {
    BLOCK_WORDS[usize::from(block >= shape.plain_blocks() as usize)]
}

/// The blocks of a share among those of all: where its first stands, by kind.
fn blocks_of(share: RowShape, whole: RowShape) -> [(Range<usize>, usize); 2] {
    let of = |span: Span, of_whole: Span, before: [u32; 2]| {
        let first = (span.first - of_whole.first) / GROUP + before[1];
        let count = span.count.div_ceil(GROUP);
        let own = before[0]..before[0] + count;
        (own.start as usize..own.end as usize, first as usize)
    };
    [
        of(share.plain, whole.plain, [0, 0]),
        of(
            share.meso,
            whole.meso,
            [share.plain_blocks(), whole.plain_blocks()],
        ),
    ]
}

/// Fills chunks as the device does.
struct Filling {
    chunk_words: usize,
    chunks: Vec<Vec<u32>>,
    rows: u32,
}

impl Filling {
    fn new(chunk_words: u32) -> Self {
        Self {
            chunk_words: chunk_words as usize,
            chunks: vec![Vec::new()],
            rows: 0,
        }
    }

    /// Chunk and first word of a row.
    fn add(&mut self, row: &[u32]) -> [u32; 2] {
        let last = self.chunks.len() - 1;
        if self.chunks[last].len() + row.len() > self.chunk_words {
            self.chunks[last].resize(self.chunk_words, 0);
            self.chunks.push(Vec::new());
        }
        let chunk = self.chunks.len() - 1;
        let first = self.chunks[chunk].len();
        self.chunks[chunk].extend_from_slice(row);
        self.rows += 1;
        [chunk as u32, first as u32]
    }

    fn done(self, places: Vec<[u32; 3]>) -> RestoredRows {
        let chunk = self.chunks.len() - 1;
        RestoredRows {
            chunk_words: self.chunk_words as u32,
            state: [chunk as u32, self.chunks[chunk].len() as u32, self.rows],
            chunks: self.chunks.into_iter().map(Words::from).collect(),
            places,
        }
    }
}

/// A row from the factors of its blocks; none of those that see nothing.
fn row_of(shape: RowShape, blocks: &[Option<Vec<u32>>]) -> Vec<u32> {
    let mut row = vec![0; table_words(shape)];
    for (block, factors) in blocks.iter().enumerate() {
        if let Some(factors) = factors {
            row[block] = row.len() as u32;
            row.extend(factors);
        }
    }
    row
}

/// The factors of a block of a row that begins with `row`; none if it sees nothing, or if these are
/// no rows.
fn factors(row: &[u32], shape: RowShape, block: usize) -> Option<&[u32]> {
    let first = *row.get(block)? as usize;
    let words = block_words(shape, block);
    (first > 0).then(|| row.get(first..first + words)).flatten()
}

fn row_at(rows: &[Words], place: [u32; 2]) -> Option<&[u32]> {
    let [chunk, first] = place.map(|word| word as usize);
    rows.get(chunk)?.words().get(first..)
}

/// The rows of all `sources`, in this order, from the parts of the members.
pub(super) fn merged(
    parts: &[(std::sync::Arc<Share>, RestoredRows)],
    sources: &[u32],
    whole: RowShape,
    chunk_words: u32,
) -> RestoredRows {
    let mut filling = Filling::new(chunk_words);
    let mut places = Vec::new();
    for &source in sources {
        let mut blocks: Vec<Option<Vec<u32>>> = vec![None; whole.blocks() as usize];
        for (share, part) in parts {
            let found = part.places.binary_search_by_key(&source, |place| place[0]);
            let Ok(at) = found else { continue };
            let [_, chunk, first] = part.places[at];
            let Some(row) = row_at(&part.chunks, [chunk, first]) else {
                continue;
            };
            for (own, to) in blocks_of(share.shape, whole) {
                for (block, to) in own.zip(to..) {
                    let Some(factors) = factors(row, share.shape, block) else {
                        continue;
                    };
                    match &mut blocks[to] {
                        // Each has found other elements of the block.
                        Some(all) => {
                            (all.iter_mut().zip(factors)).for_each(|(all, word)| *all |= word);
                        }
                        none => *none = Some(factors.to_vec()),
                    }
                }
            }
        }
        let [chunk, first] = filling.add(&row_of(whole, &blocks));
        places.push([source, chunk, first]);
    }
    filling.done(places)
}

/// The parts of rows that are a member's; `rows` in the order in which they were made.
pub(super) fn slice(
    chunks: &[Words],
    rows: &[(u32, KeptRow)],
    whole: RowShape,
    share: RowShape,
    chunk_words: u32,
) -> RestoredRows {
    let mut filling = Filling::new(chunk_words);
    let mut places = Vec::new();
    for &(source, place) in rows {
        let row = row_at(chunks, [place.chunk, place.first]).unwrap_or_default();
        let mut blocks: Vec<Option<Vec<u32>>> = vec![None; share.blocks() as usize];
        for (own, from) in blocks_of(share, whole) {
            for (block, from) in own.zip(from..) {
                blocks[block] = factors(row, whole, from).map(<[u32]>::to_vec);
            }
        }
        let [chunk, first] = filling.add(&row_of(share, &blocks));
        places.push([source, chunk, first]);
    }
    places.sort_unstable();
    filling.done(places)
}
