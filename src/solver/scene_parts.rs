//! What a device must know of a scene to draw it.

use std::sync::Arc;

use crate::error::Result;
use crate::mesh::charts::Connections;
use crate::mesh::elements::Elements;
use crate::mesh::occluders::Occluders;
use crate::mesh::sources::Sources;
use crate::passes::buffers::SceneBuffers;
use crate::passes::occluder_tree::shadow_occluders;
use crate::passes::types::ShadowOccluder;
use crate::vk::Device;

#[derive(Clone, Copy)]
pub(super) struct SceneParts<'a> {
    pub elements: &'a Elements,
    pub sources: &'a Sources,
    pub connections: &'a Connections,
    pub occluders: &'a Occluders,
}

impl SceneParts<'_> {
    pub fn buffers(&self, device: &Arc<Device>) -> Result<SceneBuffers> {
        SceneBuffers::new(
            device,
            self.elements,
            self.sources,
            self.connections,
            self.occluders,
        )
    }

    pub fn shadow_occluders(&self) -> Vec<ShadowOccluder> {
        shadow_occluders(self.elements, self.connections, self.occluders)
    }
}
