//! What casts shadows, on the device. Shaders: `shared/shadow_rays.glsl`, and `shadow_rays.comp`
//! for tests; twin: [`crate::reference::shadow_rays`].

use std::sync::Arc;

use super::buffers::{download, upload};
use super::groups;
use super::shaders::shadow_rays::{Bindings, Parameters, SHADER};
use super::types::{LightPoint, ShadowRay};
use crate::constants::KIND_SURFACE;
use crate::error::Result;
use crate::mesh::shadow_tree::ShadowTree;
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, Device};

/// Light points and what casts shadows, on the device; empty where nothing is lit by them.
pub struct LightBuffers {
    pub points: Buffer,
    pub nodes: Buffer,
    pub triangles: Buffer,
    /// Shares of the intensity of beams.
    pub webs: Buffer,
    /// All light points, and those of emitters.
    pub counts: [u32; 2],
}

impl LightBuffers {
    /// Points of emitters first, LIGHT_SETS · LIGHT_POINTS or none.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        points: &[LightPoint],
        webs: &[f32],
        tree: &ShadowTree,
    ) -> Result<Self> {
        let emitters = points.iter().filter(|p| p.kind == KIND_SURFACE).count();
        let storage = BufferUse::Storage;
        Ok(Self {
            points: upload(device, "light points", points, storage)?,
            nodes: upload(device, "shadow nodes", tree.nodes(), storage)?,
            triangles: upload(device, "shadow triangles", &tree.triangles, storage)?,
            webs: upload(device, "webs", webs, storage)?,
            counts: [points.len() as u32, emitters as u32],
        })
    }
}

/// Walks ways alone, for tests.
pub struct ShadowRays {
    pipeline: ComputePipeline,
    device: Arc<Device>,
}

impl ShadowRays {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "shadow rays", &SHADER)?,
            device: Arc::clone(device),
        })
    }

    /// Whether something stands on each way, `[ray]`.
    ///
    /// # Errors
    /// A device that lacks the memory or fails.
    pub fn run(&self, tree: &ShadowTree, rays: &[ShadowRay]) -> Result<Vec<bool>> {
        let scene = LightBuffers::new(&self.device, &[], &[], tree)?;
        let count = rays.len() as u32;
        let rays = upload(&self.device, "shadow rays", rays, BufferUse::Storage)?;
        let bytes = u64::from(count) * 4;
        let hits = Buffer::new(&self.device, "shadow hits", bytes, BufferUse::Storage)?;
        let bound = self.pipeline.bind(&Bindings {
            shadow_nodes: &scene.nodes,
            shadow_triangles: &scene.triangles,
            rays: &rays,
            hits: &hits,
        })?;
        Commands::run(&self.device, "shadow rays", |cmd| {
            let size = [groups(count), 1, 1];
            cmd.dispatch(&bound, &Parameters { count }, size);
            Ok(())
        })?;
        let hits: Vec<u32> = download(&self.device, &hits, count as usize)?;
        Ok(hits.into_iter().map(|hit| hit != 0).collect())
    }
}
