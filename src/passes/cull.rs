//! Lists the triangles that each hemicube face must draw. Shader: `cull.comp`; twin: [`crate::reference::cull`].

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use super::batch::Batch;
use super::buffers::SceneBuffers;
use super::shaders;
use crate::constants::FACES;
use crate::error::Result;
use crate::vk::{Bind, Binding, Commands, ComputePipeline, DescriptorSet, Device};

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

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct Parameters {
    meshlet_count: u32,
    room: u32,
    face_size: u32,
    part: u32,
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
            pipeline: ComputePipeline::new(
                device,
                "cull",
                shaders::CULL_COMP,
                &[Binding::Storage; 14],
                size_of::<Parameters>(),
                &constants,
                true,
            )?,
        })
    }

    pub fn bind(&self, scene: &SceneBuffers, batch: &Batch) -> Result<DescriptorSet> {
        let hemicubes = batch.hemicubes();
        self.pipeline.bind(
            "cull",
            &[
                &batch.slots,
                &scene.sources,
                &scene.meshlets,
                &scene.components,
                &scene.occluder_corners,
                &scene.vertices,
                &scene.planes,
                &hemicubes.drawn_corners,
                &hemicubes.drawn_items,
                &hemicubes.draws,
                &hemicubes.views,
                &hemicubes.counts,
                &scene.occluder_items,
                &hemicubes.resume,
            ]
            .map(Bind::Buffer),
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
