//! What hides places from strong emitters, as a tree of boxes that subgroups walk. Shader:
//! `shared/shadow_packets.glsl`; twin: [`crate::reference::occluder_rays`].

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::buffers::upload_words;
use super::types::ShadowOccluder;
use super::words::Words;
use crate::error::Result;
use crate::mesh::shadow_tree::ShadowTree;
use crate::vk::{Buffer, BufferUse, Device};

/// The tree on the device. A clone is another handle to it.
#[derive(Clone)]
pub struct OccluderTree {
    pub nodes: Buffer,
    pub occluders: Buffer,
}

/// The tree as lists.
#[derive(Clone, Serialize, Deserialize)]
pub struct TreeData {
    nodes: Words,
    occluders: Words,
}

impl TreeData {
    pub fn new(tree: &ShadowTree<ShadowOccluder>) -> Self {
        Self {
            nodes: Words::of(tree.nodes()),
            occluders: Words::of(&tree.triangles),
        }
    }
}

impl OccluderTree {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, tree: &TreeData) -> Result<Self> {
        let texels = BufferUse::Texels;
        Ok(Self {
            nodes: upload_words(device, "occluder nodes", &tree.nodes, texels)?,
            occluders: upload_words(device, "shadow occluders", &tree.occluders, texels)?,
        })
    }
}
