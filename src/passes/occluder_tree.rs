//! What hides places from strong emitters, as a tree of boxes that subgroups walk. Shader:
//! `shared/shadow_packets.glsl`; twin: [`crate::reference::occluder_rays`].

use std::sync::Arc;

use super::buffers::upload;
use super::types::ShadowOccluder;
use crate::error::Result;
use crate::mesh::shadow_tree::ShadowTree;
use crate::vk::{Buffer, BufferUse, Device};

/// The tree on the device. A clone is another handle to it.
#[derive(Clone)]
pub struct OccluderTree {
    pub nodes: Buffer,
    pub occluders: Buffer,
}

impl OccluderTree {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, tree: &ShadowTree<ShadowOccluder>) -> Result<Self> {
        let texels = BufferUse::Texels;
        Ok(Self {
            nodes: upload(device, "occluder nodes", tree.nodes(), texels)?,
            occluders: upload(device, "shadow occluders", &tree.triangles, texels)?,
        })
    }
}
