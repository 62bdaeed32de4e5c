//! Item buffers as members send them to one another: runs of pixels with one item.

use bytemuck::Zeroable;

use crate::constants::FACES;
use crate::error::{Error, Result};

/// What was counted when an item buffer was drawn, `[face]`: meshlets kept, triangles tested,
/// triangles drawn.
pub(super) type Counts = [[u32; 3]; FACES as usize];

/// Bytes of an item, or of the length of a run.
const BYTES: usize = 4;

/// Appends the item buffer of one source, given by its rows, behind its length.
pub(super) fn pack<'a>(
    counts: &Counts,
    rows: impl Iterator<Item = &'a [u32]>,
    packed: &mut Vec<u8>,
) {
    let (mut items, mut ends): (Vec<u32>, Vec<u32>) = (Vec::new(), Vec::new());
    let mut at = 0;
    for row in rows {
        let mut rest = row;
        while let Some(&item) = rest.first() {
            let length = rest.iter().take_while(|&&of| of == item).count();
            at += length as u32;
            rest = &rest[length..];
            match (items.last(), ends.last_mut()) {
                (Some(last), Some(end)) if *last == item => *end = at,
                _ => {
                    items.push(item);
                    ends.push(at);
                }
            }
        }
    }
    // Neighbours are mostly items that differ by little, in runs that are not long: differences,
    // and of these each byte in a plane of its own.
    let mut planes = vec![0; 2 * BYTES * items.len()];
    for (of, planes) in [&items, &ends].into_iter().zip(halves(&mut planes)) {
        let mut last = 0u32;
        for (k, &value) in of.iter().enumerate() {
            let step = value.wrapping_sub(last) as i32;
            let bytes = ((step << 1) ^ (step >> 31)).to_le_bytes();
            for (plane, byte) in bytes.into_iter().enumerate() {
                planes[plane * of.len() + k] = byte;
            }
            last = value;
        }
    }
    let counts: &[u8] = bytemuck::cast_slice(counts.as_flattened());
    let runs = lz4_flex::compress(&planes);
    let length = counts.len() + size_of::<u32>() + runs.len();
    packed.extend((length as u32).to_le_bytes());
    packed.extend(counts);
    packed.extend((items.len() as u32).to_le_bytes());
    packed.extend(runs);
}

fn halves(planes: &mut [u8]) -> [&mut [u8]; 2] {
    let middle = planes.len() / 2;
    <[&mut [u8]; 2]>::from(planes.split_at_mut(middle))
}

/// The inverse of [`pack`], of item buffers of `count` items each. `each` gets the number of the
/// buffer, a run of places in it, and their item. Returns how many buffers there were.
///
/// # Errors
/// Anything that [`pack`] does not make.
pub(super) fn unpack(
    mut packed: &[u8],
    count: usize,
    mut each: impl FnMut(usize, std::ops::Range<usize>, u32),
) -> Result<usize> {
    let damaged = || Error::Device("a device of several sent a damaged item buffer".into());
    let mut found = 0;
    while let Some((length, rest)) = packed.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        let (bytes, rest) = rest.split_at_checked(length).ok_or_else(damaged)?;
        unpack_one(bytes, count, |run, item| each(found, run, item)).ok_or_else(damaged)?;
        packed = rest;
        found += 1;
    }
    match packed.is_empty() {
        true => Ok(found),
        false => Err(damaged()),
    }
}

fn unpack_one(
    bytes: &[u8],
    count: usize,
    mut each: impl FnMut(std::ops::Range<usize>, u32),
) -> Option<()> {
    let head = size_of_val(&Counts::zeroed());
    let (_, bytes) = bytes.split_at_checked(head)?;
    let (runs, planes) = bytes.split_first_chunk::<4>()?;
    let runs = u32::from_le_bytes(*runs) as usize;
    if runs > count {
        return None;
    }
    let planes = lz4_flex::decompress(planes, 2 * BYTES * runs).ok()?;
    if planes.len() != 2 * BYTES * runs {
        return None;
    }
    let (mut item, mut end) = (0u32, 0u32);
    for k in 0..runs {
        let step = |half: usize| {
            let byte = |plane: usize| planes[(half * BYTES + plane) * runs + k];
            let code = u32::from_le_bytes(std::array::from_fn(byte));
            (code >> 1) ^ (code & 1).wrapping_neg()
        };
        let from = end;
        (item, end) = (item.wrapping_add(step(0)), end.wrapping_add(step(1)));
        if end <= from || end as usize > count {
            return None;
        }
        each(from as usize..end as usize, item);
    }
    (end as usize == count).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::NONE;

    #[test]
    fn item_buffers_are_unpacked_as_they_were_packed() {
        let columns = 16;
        let count = 48 * columns;
        let drawn = |shift: u32| -> Vec<u32> {
            let item = |i: u32| match i / 5 % 7 {
                0 => NONE,
                k => (i / k).wrapping_mul(2_654_435_761).wrapping_add(shift) >> (k + 3),
            };
            (0..count as u32).map(item).collect()
        };
        let all = [drawn(1), drawn(4), vec![NONE; count]];
        let mut packed = Vec::new();
        let mut ends = vec![0];
        for items in &all {
            let counts = [[1, 7, 9]; FACES as usize];
            pack(&counts, items.chunks(columns), &mut packed);
            ends.push(packed.len());
        }
        assert!(ends[3] - ends[2] < 100, "one item is one run");
        let unpacked = |packed: &[u8]| {
            let mut found = vec![Vec::new(); all.len()];
            let of = unpack(packed, count, |which, run, item| {
                assert_eq!(run.start, found[which].len());
                found[which].resize(run.end, item);
            });
            of.map(|of| found[..of].to_vec())
        };
        assert_eq!(unpacked(&packed).expect("they are whole"), all);
        for cut in 0..packed.len() {
            let found = unpacked(&packed[..cut]);
            // Between two of them it is those before.
            match ends.iter().position(|end| *end == cut) {
                Some(of) => assert_eq!(found.expect("some are whole"), all[..of]),
                None => assert!(found.is_err(), "{cut}"),
            }
        }
    }

    /// Nor do damaged ones make it panic, or write beside the buffer.
    #[test]
    fn damaged_item_buffers_are_refused_or_another_one() {
        let mut packed = Vec::new();
        let items: Vec<u32> = (0..64).map(|i| i / 3).collect();
        pack(&Counts::zeroed(), items.chunks(8), &mut packed);
        for at in 0..packed.len() {
            for flip in 0..8 {
                let mut damaged = packed.clone();
                damaged[at] ^= 1 << flip;
                let mut end = 0;
                let _ = unpack(&damaged, 64, |_, run, _| {
                    assert!(run.start < run.end && run.end <= 64);
                    end = run.end;
                });
            }
        }
    }
}
