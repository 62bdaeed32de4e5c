//! The relief of a picture, ready to be drawn.

use std::sync::Arc;

use super::ReliefShading;
use super::mesh::parameters;
use super::relief_mesh::ReliefMesh;
use super::relief_scene::ReliefScene;
use super::seen_scene::SeenScene;
use super::textures::Textures;
use crate::error::Result;
use crate::passes;
use crate::passes::shadow_rays::{LightBuffers, LightCounts};
use crate::picture::Tile;
use crate::vk::{Commands, DescriptorSet, Device, Sampler};

/// The relief of a picture, ready to be drawn.
pub struct Relief {
    pass: Arc<passes::relief::Relief>,
    pub mesh: ReliefMesh,
    /// `[range of the mesh]`.
    sets: Vec<DescriptorSet>,
    shading: u32,
}

impl Relief {
    /// None where no relief is drawn by rays or its response.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        seen: &SeenScene<'_>,
        kept: Option<&ReliefScene>,
        textures: &Textures,
        lights: &LightBuffers,
    ) -> Result<Option<Self>> {
        let Some(((light, shading), kept)) = seen.lighting.relief().zip(kept) else {
            return Ok(None);
        };
        let pass = Arc::clone(&kept.pass);
        let mesh = ReliefMesh::new(device, seen, light, kept)?;
        let sampler = Sampler::new(device, "relief albedo", true)?;
        let sets = mesh
            .ranges
            .iter()
            .map(|range| {
                let albedo = textures.image(range.material);
                pass.bind(albedo, &sampler, &mesh.buffers, lights)
            })
            .collect::<Result<_>>()?;
        Ok(Some(Self {
            pass,
            mesh,
            sets,
            shading,
        }))
    }

    /// Draws one tile within the render pass that has begun.
    pub fn record(&self, cmd: &Commands, seen: &SeenScene<'_>, tile: Tile, lights: &LightBuffers) {
        let rows = seen.projection.rows(tile);
        let corner = tile.corner(seen.samples);
        let directions = self.mesh.directions;
        let counts = if seen.lighting.shading == ReliefShading::Factored {
            lights.counts
        } else {
            LightCounts::default()
        };
        let draws = self.mesh.ranges.iter().zip(&self.sets);
        let draws = draws.map(|(range, set)| {
            let material = &seen.scene.materials[range.material as usize];
            let shade = parameters(rows, Some(material), seen.lighting.part).lit_by(counts, corner);
            passes::relief::Draw {
                first_prism: range.first,
                prism_count: range.count,
                set,
                parameters: passes::relief::Parameters {
                    x: shade.x,
                    y: shade.y,
                    w: shade.w,
                    near: shade.near,
                    reflectance: shade.reflectance,
                    emitted: shade.emitted,
                    metered: shade.metered,
                    light_count: shade.light_count,
                    emitter_points: shade.emitter_points,
                    polygon_count: shade.polygon_count,
                    corner: shade.corner,
                    shading: self.shading,
                    view: seen.lighting.show.code(),
                    pixel: seen.projection.sample_angle(seen.samples),
                    cells: [directions.columns, directions.rows],
                },
            }
        });
        self.pass.record(cmd, &self.mesh.buffers, draws);
    }
}
