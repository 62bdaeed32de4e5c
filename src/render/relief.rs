//! The relief of a picture, ready to be drawn.

use std::sync::Arc;

use super::ReliefShading;
use super::flat_relief::SortedRelief;
use super::mesh::parameters;
use super::relief_mesh::{PrismRange, ReliefMesh};
use super::relief_scene::ReliefPasses;
use super::seen_scene::SeenScene;
use super::shafts::Shafts;
use super::textures::Textures;
use crate::error::Result;
use crate::passes::pass_parts::PartedPass;
use crate::passes::relief::{Draw, Parameters};
use crate::passes::relief_hits::{self, Drawn, Hits};
use crate::passes::shade::Target;
use crate::passes::shadow_rays::{LightBuffers, LightCounts};
use crate::picture::Tile;
use crate::vk::{Commands, DescriptorSet, Device};

/// The relief of a picture, ready to be drawn.
pub struct Relief {
    passes: Arc<ReliefPasses>,
    pub mesh: ReliefMesh,
    /// Of what finds or counts fragments.
    set: DescriptorSet,
}

/// Where the relief of a tile is drawn.
pub struct ReliefTarget {
    /// None where fragments are counted.
    hits: Option<Hits>,
    /// `[range of the mesh]`.
    sets: Vec<DescriptorSet>,
}

impl Relief {
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        seen: &SeenScene<'_>,
        sorted: &SortedRelief<'_>,
        shafts: Option<&Shafts>,
    ) -> Result<Self> {
        let kept = sorted.kept;
        let mesh = ReliefMesh::new(device, seen, sorted, shafts)?;
        let set = match &*kept.passes {
            ReliefPasses::Shaded(hits, _) => hits.bind(&mesh.shape)?,
            ReliefPasses::Overdraw(overdraw) => overdraw.bind(&mesh.shape)?,
        };
        Ok(Self {
            passes: Arc::clone(&kept.passes),
            mesh,
            set,
        })
    }

    /// What the relief of a tile needs beside the target of the tile.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn target(
        &self,
        device: &Arc<Device>,
        target: &Target,
        textures: &Textures,
        lights: &LightBuffers,
    ) -> Result<ReliefTarget> {
        let ReliefPasses::Shaded(finding, shading) = &*self.passes else {
            return Ok(ReliefTarget {
                hits: None,
                sets: Vec::new(),
            });
        };
        let hits = finding.target(device, target)?;
        let bind = |range: &PrismRange| {
            let albedo = textures.image(range.material);
            shading.bind(&hits, albedo, &self.mesh.shape, &self.mesh.lights, lights)
        };
        Ok(ReliefTarget {
            sets: self.mesh.ranges.iter().map(bind).collect::<Result<_>>()?,
            hits: Some(hits),
        })
    }

    /// Finds what is seen of one tile, with its depths, before the render pass that shows it.
    /// False where fragments are counted instead.
    pub fn find(
        &self,
        cmd: &Commands,
        seen: &SeenScene<'_>,
        tile: Tile,
        target: &ReliefTarget,
    ) -> bool {
        let (ReliefPasses::Shaded(finding, _), Some(hits)) = (&*self.passes, &target.hits) else {
            return false;
        };
        let size = (tile.width * seen.samples, tile.height * seen.samples);
        let drawn = self.drawn(seen, tile);
        finding.record(cmd, hits, size, &self.set, &self.mesh.shape, &drawn);
        true
    }

    /// Draws one tile within the render pass that has begun, before all else.
    pub fn record(
        &self,
        cmd: &Commands,
        pass: &mut PartedPass<'_>,
        seen: &SeenScene<'_>,
        tile: Tile,
        target: &ReliefTarget,
        lights: &LightBuffers,
    ) {
        let shading = match &*self.passes {
            ReliefPasses::Shaded(_, shading) => shading,
            ReliefPasses::Overdraw(overdraw) => {
                let drawn = self.drawn(seen, tile);
                return overdraw.record(pass, &self.set, &self.mesh.shape, &drawn);
            }
        };
        let rows = seen.projection.rows(tile);
        let corner = tile.corner(seen.samples);
        let directions = self.mesh.directions;
        let counts = if seen.lighting.shading == ReliefShading::Factored {
            lights.counts
        } else {
            LightCounts::default()
        };
        let draws = self.mesh.ranges.iter().zip(&target.sets);
        let draws = draws.map(|(range, set)| {
            let material = &seen.scene.materials[range.material as usize];
            let shade = parameters(rows, Some(material), seen.lighting).lit_by(counts, corner);
            Draw {
                set,
                parameters: Parameters {
                    first_prism: range.first,
                    prism_count: range.count,
                    reflectance: shade.reflectance,
                    emitted: shade.emitted,
                    metered: shade.metered,
                    light_count: shade.light_count,
                    emitter_points: shade.emitter_points,
                    polygon_count: shade.polygon_count,
                    corner: shade.corner,
                    pixel: seen.projection.sample_angle(seen.samples),
                    cells: [directions.columns, directions.rows],
                },
            }
        });
        shading.record(cmd, draws);
    }

    fn drawn(&self, seen: &SeenScene<'_>, tile: Tile) -> Drawn {
        let all = 0..self.mesh.prism_count;
        Drawn {
            prisms: self.mesh.blocks.shown(all, tile, seen.cuts),
            parameters: self.rays(seen, tile),
            part_triangles: seen.cuts.part_triangles,
        }
    }

    fn rays(&self, seen: &SeenScene<'_>, tile: Tile) -> relief_hits::Parameters {
        let shade = parameters(seen.projection.rows(tile), None, seen.lighting);
        relief_hits::Parameters {
            x: shade.x,
            y: shade.y,
            w: shade.w,
            near: shade.near,
            pixel: seen.projection.sample_angle(seen.samples),
        }
    }
}
