//! Segments over height maps. Shader: `relief_rays.comp`; twin: [`crate::reference::relief_rays`].

use std::sync::Arc;

use super::buffers::{download, upload};
use super::groups;
use super::shaders::relief_rays::{Bindings, Parameters, SHADER};
use super::types::{HeightHit, HeightRay, HeightTile};
use crate::error::Result;
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, Device};

pub struct ReliefRays {
    pipeline: ComputePipeline,
    device: Arc<Device>,
}

/// Segments marched in a submission: far from any driver's time limit.
const SUBMISSION: u32 = 1 << 18;

impl ReliefRays {
    /// With the levels of the pyramid, or from cell to cell.
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, levels: bool) -> Result<Self> {
        let constants = [levels.into()];
        Ok(Self {
            pipeline: ComputePipeline::with_constants(device, "relief rays", &SHADER, &constants)?,
            device: Arc::clone(device),
        })
    }

    /// The hit of each segment. `pyramids` holds the values that the tiles point into.
    pub fn run(
        &self,
        tiles: &[HeightTile],
        pyramids: &[f32],
        rays: &[HeightRay],
    ) -> Result<Vec<HeightHit>> {
        let tiles = upload(&self.device, "height tiles", tiles, BufferUse::Storage)?;
        let pyramids = upload(&self.device, "height pyramids", pyramids, BufferUse::Texels)?;
        let count = rays.len() as u32;
        let rays = upload(&self.device, "height rays", rays, BufferUse::Storage)?;
        let bytes = u64::from(count) * size_of::<HeightHit>() as u64;
        let hits = Buffer::new(&self.device, "height hits", bytes, BufferUse::Storage)?;
        let bound = self.pipeline.bind(&Bindings {
            tiles: &tiles,
            pyramid: &pyramids,
            rays: &rays,
            hits: &hits,
        })?;
        for first in (0..count).step_by(SUBMISSION as usize) {
            let parameters = Parameters {
                first,
                count: SUBMISSION.min(count - first),
            };
            Commands::run(&self.device, "relief rays", |cmd| {
                cmd.dispatch(&bound, &parameters, [groups(parameters.count), 1, 1]);
                Ok(())
            })?;
        }
        download(&self.device, &hits, count as usize)
    }
}
