//! The paper's equations (1) to (4), one invocation a pixel of the item buffers. Shader:
//! `bin_shots.comp`; twin: [`crate::reference::paper`].

use std::sync::Arc;

use super::batch::Batch;
use super::buffers::{SceneBuffers, upload};
use super::groups;
use super::shaders::bin_shots::{Bindings, Parameters, SHADER};
use super::shot_light::ShotLight;
use crate::error::Result;
use crate::math::hemicube::{pixel_count, pixel_form_factors};
use crate::vk::{BoundCompute, BufferUse, Commands, ComputePipeline, Device};

pub struct BinShots {
    bound: BoundCompute,
    parameters: Parameters,
    size: [u32; 3],
}

impl BinShots {
    pub fn new(
        device: &Arc<Device>,
        scene: &SceneBuffers,
        light: &ShotLight,
        batch: &Batch,
    ) -> Result<Self> {
        let hemicubes = batch.hemicubes();
        let face_size = hemicubes.face_size;
        let table = pixel_form_factors(face_size);
        let deltas = upload(device, "pixel form factors", &table, BufferUse::Texels)?;
        let bindings = Bindings {
            shots: &light.shots,
            items: hemicubes.sampled_items(),
            planes: &scene.planes,
            balls: &scene.balls,
            deltas: &deltas,
            received: &light.received,
            patches: &light.patches,
            texels: &light.texels,
            direction_list: &light.direction_list,
            exits: &light.exits,
            incoming: &light.incoming,
            reflected: &light.reflected,
            hidden: &light.hidden,
        };
        let directions = &light.directions;
        Ok(Self {
            bound: ComputePipeline::new(device, "bin shots", &SHADER)?.bind(&bindings)?,
            parameters: Parameters {
                face_size,
                first_relief: light.first_relief,
                cells: [directions.columns, directions.rows],
            },
            size: [groups(pixel_count(face_size) as u32), batch.slot_count, 1],
        })
    }

    pub fn record(&self, cmd: &Commands) {
        cmd.dispatch(&self.bound, &self.parameters, self.size);
    }
}
