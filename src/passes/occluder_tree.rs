//! What hides places from strong emitters, as a tree of boxes that subgroups walk. Shader:
//! `shared/shadow_packets.glsl`; twin: [`crate::reference::occluder_rays`].

use std::sync::Arc;

use super::buffers::upload;
use super::types::ShadowOccluder;
use crate::error::Result;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::shadow_tree::ShadowTree;
use crate::vk::{Buffer, BufferUse, Device};

/// The tree on the device. A clone is another handle to it.
#[derive(Clone)]
pub struct OccluderTree {
    pub nodes: Buffer,
    pub occluders: Buffer,
}

/// `[occluder]`, internal units.
pub fn shadow_occluders(
    elements: &Elements,
    connections: &Connections,
    occluders: &Occluders,
) -> Vec<ShadowOccluder> {
    let of_occluder = |(corners, &item): (&[u32; 3], &u32)| {
        let item = item as usize;
        let [a, b, c] = corners.map(|v| elements.vertices[v as usize].as_vec3());
        let component = connections.component[item];
        let normal = elements.normal[item];
        ShadowOccluder {
            a,
            component,
            b,
            closed: connections.closed[component as usize].into(),
            c,
            height: normal.dot(elements.centroid[item]) as f32,
            normal: normal.as_vec3(),
            unused: 0,
        }
    };
    let triangles = occluders.corners.iter().zip(&occluders.items);
    triangles.map(of_occluder).collect()
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
