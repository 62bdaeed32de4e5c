//! Lists the triangles that each hemicube face must draw. Shader: `cull.comp`; twin:
//! [`crate::reference::cull`].

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::batch::{Batch, DrawLists};
use super::buffers::SceneBuffers;
use super::shaders::cull::{Bindings, Parameters, SHADER};
use crate::constants::FACES;
use crate::error::Result;
use crate::vk::{BoundCompute, Commands, ComputePipeline, Device};

/// What is left out of the item buffer's draws. Every level gives the same item buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Culling {
    /// Every triangle is drawn in every face.
    Off,
    /// Meshlets outside the frustum, below the horizon, or showing their backs on a closed part.
    Meshlets,
    /// Also triangles that cover no pixel's centre or show their backs.
    #[default]
    Triangles,
}

pub struct Cull {
    bound: BoundCompute,
    parameters: Parameters,
    slot_count: u32,
}

impl Cull {
    pub fn new(
        device: &Arc<Device>,
        culling: Culling,
        scene: &SceneBuffers,
        batch: &Batch,
        lists: &DrawLists,
    ) -> Result<Self> {
        let constants = [
            device.limits().subgroup_size,
            (culling != Culling::Off).into(),
            (culling == Culling::Triangles).into(),
            device.limits().subpixel_bits,
        ];
        let pipeline = ComputePipeline::in_subgroups(device, "cull", &SHADER, &constants)?;
        let bindings = Bindings {
            slots: &batch.slots,
            sources: &scene.sources,
            meshlets: &scene.meshlets,
            components: &scene.components,
            corners: &scene.occluder_corners,
            vertices: &scene.vertices,
            planes: &scene.planes,
            drawn_corners: &lists.drawn_corners,
            drawn_items: &lists.drawn_items,
            draws: &lists.draws,
            views: &lists.views,
            counts: &lists.counts,
            items: &scene.occluder_items,
            resume: &lists.resume,
        };
        Ok(Self {
            bound: pipeline.bind(&bindings)?,
            parameters: Parameters {
                meshlet_count: scene.meshlet_count,
                room: lists.room,
                face_size: lists.face_size,
                part: 0,
            },
            slot_count: batch.slot_count,
        })
    }

    /// Lists what the part of this number draws: what found no room before.
    pub(super) fn record(&self, cmd: &Commands, part: u32) {
        let parameters = Parameters {
            part,
            ..self.parameters
        };
        cmd.dispatch(&self.bound, &parameters, [FACES, self.slot_count, 1]);
    }
}
