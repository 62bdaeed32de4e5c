//! Item buffers as members send them to one another.

use crate::constants::FACES;
use crate::error::{Error, Result};

/// The item buffer of one source, and what was counted when it was drawn.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Drawn {
    /// `[face]`: meshlets kept, triangles tested, triangles drawn.
    pub counts: [[u32; 3]; FACES as usize],
    /// `[row][column]`
    pub items: Vec<u32>,
}

/// Packs each of them behind its length.
pub(super) fn pack<'a>(drawn: impl Iterator<Item = &'a Drawn>, columns: usize) -> Vec<u8> {
    let mut packed = Vec::new();
    for one in drawn {
        let bytes = pack_one(one, columns);
        packed.extend((bytes.len() as u32).to_le_bytes());
        packed.extend(bytes);
    }
    packed
}

/// Neighbours in a row are mostly one item or differ by little: differences, and of these each byte
/// in a plane of its own.
fn pack_one(drawn: &Drawn, columns: usize) -> Vec<u8> {
    let count = drawn.items.len();
    let mut planes = vec![0; 4 * count];
    for (row, items) in drawn.items.chunks(columns).enumerate() {
        let mut left = 0;
        for (column, &item) in items.iter().enumerate() {
            let step = item.wrapping_sub(left) as i32;
            let bytes = ((step << 1) ^ (step >> 31)).to_le_bytes();
            for (plane, byte) in bytes.into_iter().enumerate() {
                planes[plane * count + row * columns + column] = byte;
            }
            left = item;
        }
    }
    let mut bytes: Vec<u8> = bytemuck::cast_slice(drawn.counts.as_flattened()).to_vec();
    bytes.extend(lz4_flex::compress(&planes));
    bytes
}

/// The inverse of [`pack`], of item buffers with so many items.
///
/// # Errors
/// Anything that [`pack`] does not make.
pub(super) fn unpack(mut packed: &[u8], count: usize, columns: usize) -> Result<Vec<Drawn>> {
    let damaged = || Error::Device("a device of several sent a damaged item buffer".into());
    let mut all = Vec::new();
    while let Some((length, rest)) = packed.split_first_chunk::<4>() {
        let length = u32::from_le_bytes(*length) as usize;
        let (bytes, rest) = rest.split_at_checked(length).ok_or_else(damaged)?;
        all.push(unpack_one(bytes, count, columns).ok_or_else(damaged)?);
        packed = rest;
    }
    match packed.is_empty() {
        true => Ok(all),
        false => Err(damaged()),
    }
}

fn unpack_one(bytes: &[u8], count: usize, columns: usize) -> Option<Drawn> {
    let mut drawn = Drawn {
        counts: Default::default(),
        items: vec![0; count],
    };
    let counts: &mut [u8] = bytemuck::cast_slice_mut(drawn.counts.as_flattened_mut());
    let (head, planes) = bytes.split_at_checked(counts.len())?;
    counts.copy_from_slice(head);
    let planes = lz4_flex::decompress(planes, 4 * count).ok()?;
    if planes.len() != 4 * count {
        return None;
    }
    for (row, items) in drawn.items.chunks_mut(columns).enumerate() {
        let mut left = 0u32;
        for (column, item) in items.iter_mut().enumerate() {
            let at = row * columns + column;
            let code = u32::from_le_bytes(std::array::from_fn(|p| planes[p * count + at]));
            let step = (code >> 1) ^ (code & 1).wrapping_neg();
            left = left.wrapping_add(step);
            *item = left;
        }
    }
    Some(drawn)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constants::NONE;

    #[test]
    fn item_buffers_are_unpacked_as_they_were_packed() {
        let columns = 16;
        let drawn = |shift: u32| Drawn {
            counts: [[shift, 7, 9]; FACES as usize],
            items: (0..48 * columns as u32)
                .map(|i| match i % 7 {
                    0 => NONE,
                    k => i.wrapping_mul(2_654_435_761).wrapping_add(k + shift) >> (k + 3),
                })
                .collect(),
        };
        let all = [drawn(1), drawn(4)];
        let count = all[0].items.len();
        let packed = pack(all.iter(), columns);
        assert_eq!(
            unpack(&packed, count, columns).expect("they are whole"),
            all
        );
        assert!(unpack(&[], count, columns).expect("none").is_empty());
        for cut in 1..packed.len() {
            let found = unpack(&packed[..cut], count, columns);
            // Between the two it is one of them.
            assert!(
                found.is_err() || found.is_ok_and(|found| found == all[..1]),
                "{cut}"
            );
        }
    }
}
