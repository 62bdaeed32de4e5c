//! Lists the triangles that each hemicube face must draw. Shader: `cull.comp`; twin:
//! [`crate::reference::cull`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::shaders::cull::{Bindings, Parameters, SHADER};
use crate::constants::FACES;
use crate::error::Result;
use crate::vk::{Commands, ComputePipeline, DescriptorSet, Device};

/// What is left out of the item buffer's draws. Every level gives the same item buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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
    pipeline: ComputePipeline,
}

impl Cull {
    pub fn new(device: &Arc<Device>, culling: Culling) -> Result<Self> {
        let constants = [
            device.limits().subgroup_size,
            (culling != Culling::Off).into(),
            (culling == Culling::Triangles).into(),
            device.limits().subpixel_bits,
        ];
        Ok(Self {
            pipeline: ComputePipeline::in_subgroups(device, "cull", &SHADER, &constants)?,
        })
    }

    pub fn bind(&self, scene: &SceneBuffers, batch: &Batch) -> Result<DescriptorSet> {
        let hemicubes = batch.hemicubes();
        self.pipeline.bind(
            "cull",
            &Bindings {
                slots: &batch.slots,
                sources: &scene.sources,
                meshlets: &scene.meshlets,
                components: &scene.components,
                corners: &scene.occluder_corners,
                vertices: &scene.vertices,
                planes: &scene.planes,
                drawn_corners: &hemicubes.drawn_corners,
                drawn_items: &hemicubes.drawn_items,
                draws: &hemicubes.draws,
                views: &hemicubes.views,
                counts: &hemicubes.counts,
                items: &scene.occluder_items,
                resume: &hemicubes.resume,
            },
        )
    }

    /// Lists what the part of this number draws: what found no room before.
    pub(super) fn record(
        &self,
        cmd: &Commands,
        set: &DescriptorSet,
        scene: &SceneBuffers,
        batch: &Batch,
        part: u32,
    ) {
        let hemicubes = batch.hemicubes();
        let parameters = Parameters {
            meshlet_count: scene.meshlet_count,
            room: hemicubes.room,
            face_size: hemicubes.face_size,
            part,
        };
        cmd.dispatch(
            &self.pipeline,
            set,
            &parameters,
            [FACES, batch.slot_count, 1],
        );
    }
}
