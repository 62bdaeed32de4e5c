//! The relief of a picture, ready to be drawn.

use std::sync::Arc;

use super::mesh::parameters;
use super::projection::{Projection, Tile};
use super::relief_mesh::ReliefMesh;
use super::relief_scene::ReliefScene;
use super::textures::Textures;
use super::{Lighting, ReliefShading};
use crate::error::Result;
use crate::passes;
use crate::passes::shadow_rays::LightBuffers;
use crate::scene::Scene;
use crate::vk::{Commands, DescriptorSet, Device, Sampler};

/// The relief of a picture, ready to be drawn.
pub struct Relief {
    pass: Arc<passes::relief::Relief>,
    pub mesh: ReliefMesh,
    /// One for each range of the mesh.
    sets: Vec<DescriptorSet>,
    shading: u32,
}

impl Relief {
    /// None where nothing with relief is drawn as such.
    pub fn new(
        device: &Arc<Device>,
        kept: Option<&ReliefScene>,
        scene: &Scene,
        lighting: &Lighting<'_>,
        (textures, lights): (&Textures, &LightBuffers),
        (projection, samples): (&Projection, u32),
    ) -> Result<Option<Self>> {
        let Some(((light, shading), kept)) = lighting.relief().zip(kept) else {
            return Ok(None);
        };
        let pass = Arc::clone(&kept.pass);
        let mesh = ReliefMesh::new(
            device,
            scene,
            lighting,
            (light, kept),
            (projection, samples),
        )?;
        let sampler = Sampler::new(device, "relief albedo", true)?;
        let sets = mesh
            .ranges
            .iter()
            .map(|&(material, ..)| {
                pass.bind(textures.image(material), &sampler, &mesh.buffers, lights)
            })
            .collect::<Result<_>>()?;
        Ok(Some(Self {
            pass,
            mesh,
            sets,
            shading,
        }))
    }

    pub fn record(
        &self,
        cmd: &Commands,
        scene: &Scene,
        lighting: &Lighting<'_>,
        (projection, lights): (&Projection, &LightBuffers),
        (tile, samples): (Tile, u32),
    ) {
        let rows = projection.rows(tile);
        let directions = self.mesh.directions;
        let counts = if lighting.shading == ReliefShading::Factored {
            lights.counts
        } else {
            [0; 2]
        };
        let draws = self.mesh.ranges.iter().zip(&self.sets);
        let draws = draws.map(|(&(material, first, count), set)| {
            let material = &scene.materials[material as usize];
            passes::relief::Draw {
                first_prism: first,
                prism_count: count,
                set,
                parameters: passes::relief::Parameters {
                    shade: parameters(rows, Some(material), lighting.part).lit_by(counts),
                    shading: self.shading,
                    view: lighting.show.code(),
                    pixel: projection.sample_angle(samples),
                    cells: [directions.columns, directions.rows],
                },
            }
        });
        self.pass.record(cmd, &self.mesh.buffers, draws);
    }
}
