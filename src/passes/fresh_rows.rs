//! The rows of a batch on the device, before they are kept.

use std::ops::Range;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::PART_PAIRS;
use super::buffers::{filled, upload};
use super::groups;
use super::types::ReceiverList;
use crate::constants::{GROUP, NONE, RECEIVE_LISTS};
use crate::error::{Error, Result};
use crate::vk::{Buffer, BufferUse, Device};

/// Elements of one kind in whole blocks of GROUP, counted from the first of their kind. The first
/// and the last block may hold elements of others, whose form factors stay 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Span {
    /// Counted from the first element of all.
    pub first: u32,
    pub count: u32,
    /// Those that are found, counted from `first`: their begin and their end.
    pub own: [u32; 2],
}

impl Span {
    /// All `count` elements of a kind, which begin with `first`.
    pub fn whole(first: u32, count: u32) -> Self {
        Self {
            first,
            count,
            own: [0, count],
        }
    }

    /// Of the elements of `kind`, the whole blocks in which these are, which begin with one of a
    /// block of their own.
    pub fn about(kind: Range<u32>, own: Range<u32>) -> Self {
        let first = kind.start + (own.start - kind.start) / GROUP * GROUP;
        let blocks = (own.end - first).div_ceil(GROUP);
        let end = (first + blocks * GROUP).min(kind.end).max(first);
        Self {
            first,
            count: end - first,
            own: [own.start - first, own.end - first],
        }
    }

    /// The elements that are found, counted from the first of all.
    pub fn own_range(self) -> Range<u32> {
        self.first + self.own[0]..self.first + self.own[1]
    }
}

/// How elements lie in rows: those without relief first, in blocks of GROUP elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowShape {
    pub plain: Span,
    pub meso: Span,
}

impl RowShape {
    /// Of all elements of a scene, of which the last have a relief.
    pub fn whole(elements: u32, meso_count: u32) -> Self {
        let plain_count = elements - meso_count;
        Self {
            plain: Span::whole(0, plain_count),
            meso: Span::whole(plain_count, meso_count),
        }
    }

    /// Whether form factors to an element are found.
    pub fn has(self, element: u32) -> bool {
        [self.plain, self.meso]
            .iter()
            .any(|span| span.own_range().contains(&element))
    }

    pub fn plain_blocks(self) -> u32 {
        groups(self.plain.count)
    }

    pub fn meso_blocks(self) -> u32 {
        groups(self.meso.count)
    }

    /// The first element with a relief; NONE of rows without one.
    pub fn first_meso(self) -> u32 {
        match self.meso.count {
            0 => NONE,
            _ => self.meso.first,
        }
    }

    /// Blocks of all elements, those with relief last.
    pub fn blocks(self) -> u32 {
        self.plain_blocks() + self.meso_blocks()
    }

    /// Refuses more elements than a pass of the device takes: a workgroup for each block.
    pub fn check(self, device: &str, max_workgroups: u32) -> Result<()> {
        let most = u64::from(GROUP) * u64::from(max_workgroups);
        let count = u64::from(self.plain.count.max(self.meso.count));
        if count > most {
            let what = format!(
                "{count} elements, more than the {most} that {device} finds: fewer by --patches, \
                 or several devices"
            );
            return Err(Error::Usage(what));
        }
        Ok(())
    }
}

/// The form factors of a batch in f32. A clone is another handle to the same buffers.
#[derive(Clone)]
pub struct FreshRows {
    pub shape: RowShape,
    pub slot_count: u32,
    /// Elements times sources whose form factors a part of a submission finds, at most; see
    /// [`super::PART_PAIRS`].
    pub part_pairs: u64,
    /// `[slot][element]`, of elements without relief.
    pub plain: Buffer,
    /// `[slot][meso element]`, vectors in its frame.
    pub meso: Buffer,
    /// Elements that see each source of the batch, by how their form factor is found.
    pub plain_lists: ReceiverLists,
    pub meso_lists: ReceiverLists,
    /// Whether a block sees anything, `[slot][block]`.
    pub occupied: Buffer,
    /// Elements that see nothing of a source, whatever stands between, `[slot]`.
    pub facing_away: Buffer,
}

/// Lists of elements, `[slot][kind]`.
#[derive(Clone)]
pub struct ReceiverLists {
    /// [`ReceiverList`], `[slot][kind]`.
    pub counts: Buffer,
    /// `[slot][kind][element]`.
    pub listed: Buffer,
    /// What `counts` starts from.
    pub empty: Buffer,
}

impl ReceiverLists {
    fn new(device: &Arc<Device>, slots: u32, elements: u32) -> Result<Self> {
        let lists = slots * RECEIVE_LISTS;
        let empty = ReceiverList {
            groups_x: 0,
            groups_y: 1,
            groups_z: 1,
            count: 0,
        };
        let empty = vec![empty; lists as usize];
        let bytes = 4 * u64::from(lists) * u64::from(elements);
        Ok(Self {
            counts: upload(device, "receiver counts", &empty, BufferUse::Geometry)?,
            listed: Buffer::new(device, "listed receivers", bytes, BufferUse::Storage)?,
            empty: upload(device, "empty receiver counts", &empty, BufferUse::Storage)?,
        })
    }
}

impl FreshRows {
    /// With parts of submissions of another size.
    pub fn in_parts(self, part_pairs: u64) -> Self {
        Self { part_pairs, ..self }
    }

    /// For `slots` sources; `sorts`: with the lists that the `receiver` estimator needs.
    pub fn new(device: &Arc<Device>, shape: RowShape, slots: u32, sorts: bool) -> Result<Self> {
        let lists = |elements: u32| {
            let elements = if sorts { elements } else { 0 };
            ReceiverLists::new(device, slots, elements)
        };
        let slot_count = slots;
        let slots = u64::from(slots);
        let storage = |name, bytes| Buffer::new(device, name, bytes, BufferUse::Storage);
        let zeroed = |name, bytes| filled(device, name, bytes, 0);
        Ok(Self {
            shape,
            slot_count,
            part_pairs: PART_PAIRS,
            plain: storage("form factors", 4 * slots * u64::from(shape.plain.count))?,
            meso: storage(
                "form factors to relief",
                12 * slots * u64::from(shape.meso.count),
            )?,
            plain_lists: lists(shape.plain.count)?,
            meso_lists: lists(shape.meso.count)?,
            occupied: zeroed("occupied blocks", 4 * slots * u64::from(shape.blocks()))?,
            facing_away: zeroed("facing away", 4 * slots)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of plain elements or of those with relief, whichever are more.
    #[test]
    fn more_blocks_than_workgroups_are_refused() {
        let check =
            |plain: u32, meso: u32| RowShape::whole(plain + meso, meso).check("a device", 3);
        let most = 3 * GROUP;
        for (plain, meso) in [(most, most), (0, most), (most, 0)] {
            check(plain, meso).expect("it has room");
        }
        for (plain, meso) in [(most + 1, 0), (0, most + 1), (1, most + 1)] {
            let refused = check(plain, meso).expect_err("no room");
            let (count, said) = (most + 1, refused.to_string());
            let expected = format!("{count} elements, more than the {most} that a device finds");
            assert!(said.contains(&expected), "{said}");
        }
    }
}
