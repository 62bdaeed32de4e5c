//! The rows of a batch on the device, before they are kept.

use std::sync::Arc;

use super::buffers::{SceneBuffers, filled, upload};
use super::groups;
use super::types::ReceiverList;
use crate::constants::RECEIVE_LISTS;
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Device};

/// How the elements of a scene lie in rows: those without relief first, in blocks of GROUP
/// elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RowShape {
    pub plain_count: u32,
    pub meso_count: u32,
}

impl RowShape {
    pub fn new(scene: &SceneBuffers, meso_count: u32) -> Self {
        Self {
            plain_count: scene.element_count - meso_count,
            meso_count,
        }
    }

    pub fn plain_blocks(self) -> u32 {
        groups(self.plain_count)
    }

    pub fn meso_blocks(self) -> u32 {
        groups(self.meso_count)
    }

    /// Blocks of all elements, those with relief last.
    pub fn blocks(self) -> u32 {
        self.plain_blocks() + self.meso_blocks()
    }
}

/// The form factors of a batch in f32. A clone is another handle to the same buffers.
#[derive(Clone)]
pub struct FreshRows {
    pub shape: RowShape,
    pub slot_count: u32,
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
            plain: storage("form factors", 4 * slots * u64::from(shape.plain_count))?,
            meso: storage(
                "form factors to relief",
                12 * slots * u64::from(shape.meso_count),
            )?,
            plain_lists: lists(shape.plain_count)?,
            meso_lists: lists(shape.meso_count)?,
            occupied: zeroed("occupied blocks", 4 * slots * u64::from(shape.blocks()))?,
            facing_away: zeroed("facing away", 4 * slots)?,
        })
    }
}
