//! Counts the fragments of prisms that [`super::relief_hits`] works on, and the steps of their
//! marches. Shaders: `relief_overdraw.vert`, `relief_overdraw.frag`.

use std::sync::Arc;

use super::pass_parts::PartedPass;
use super::relief_hits::{self, Drawn, ShapeBuffers};
use super::shade::Passes;
use super::shaders::relief_overdraw::SHADER;
use crate::error::Result;
use crate::vk::{Blending, DescriptorSet, Device, GraphicsPipeline, GraphicsState};

pub struct ReliefOverdraw {
    pipeline: GraphicsPipeline,
}

impl ReliefOverdraw {
    /// Draws into the targets of [`super::shade`]; `shading` is one of SHADING_… of
    /// [`crate::constants`].
    ///
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>, passes: &Passes, shading: u32) -> Result<Self> {
        let constants = [shading];
        let state = GraphicsState {
            blending: Blending::Sum,
            ..relief_hits::prisms("relief overdraw", &SHADER, &constants)
        };
        Ok(Self {
            pipeline: GraphicsPipeline::new(device, &passes.first, &state)?,
        })
    }

    /// # Errors
    /// A device that fails.
    pub fn bind(&self, shape: &ShapeBuffers) -> Result<DescriptorSet> {
        self.pipeline.bind("relief overdraw", &shape.bindings())
    }

    /// Adds to red a count of fragments and to green one of steps, within the render pass that is
    /// under way.
    pub fn record(
        &self,
        pass: &mut PartedPass<'_>,
        set: &DescriptorSet,
        shape: &ShapeBuffers,
        drawn: &Drawn,
    ) {
        shape.draw(pass, &self.pipeline, set, drawn);
    }
}
