//! The part of a scene's relief and its light that does not depend on the view; made once for a
//! series of pictures.

use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::relief_borders::{Borders, Relief as OfTriangle};
use super::relief_surfaces::Surfaces;
use super::{Light, Lighting, ReliefShading, Show};
use crate::bake::marcher;
use crate::beside::beside;
use crate::error::Result;
use crate::math::directions::Directions;
use crate::mesh::corners::Corners;
use crate::mesh::elements::Elements;
use crate::mesh::meso_vertices::MesoVertices;
use crate::mesh::tiles::{Tile, tiles};
use crate::meso::{FACTOR_ERROR, Factors, KnownFactors, visibility};
use crate::passes::relief::{Kind, Relief};
use crate::passes::relief_hits::ReliefHits;
use crate::passes::relief_overdraw::ReliefOverdraw;
use crate::passes::shade::Passes;
use crate::passes::shadow_rays::LightKinds;
use crate::scene::{Scene, relief_normals};
use crate::vk::Device;

/// How relief is drawn.
pub enum ReliefPasses {
    /// What is seen, then how it looks.
    Shaded(ReliefHits, Relief),
    Overdraw(ReliefOverdraw),
}

/// The relief of a scene, without a view.
pub struct ReliefScene {
    pub passes: Arc<ReliefPasses>,
    pub directions: Directions,
    pub tiles: Vec<Tile>,
    /// Index into `tiles`, `[triangle]`; `u32::MAX` for triangles without.
    pub surface_of: Vec<u32>,
    /// None where no lights are drawn sharply.
    pub borders: Borders,
    /// `[surface]`, in the order of `tiles`.
    pub factors: Vec<Arc<Factors>>,
    pub surfaces: Surfaces,
    pub vertices: MesoVertices,
    /// Of the relief's base, `[vertex of the scene]`.
    pub normals: Vec<DVec3>,
    /// Moments at the vertices, `[vertex][slot][colour]`: all of the light and what is direct.
    pub all: Vec<[Vec3; 3]>,
    pub direct: Vec<[Vec3; 3]>,
}

impl ReliefScene {
    /// None where no relief is drawn by rays or its response.
    ///
    /// # Errors
    /// As [`super::render`].
    pub fn new(
        device: &Arc<Device>,
        passes: &Passes,
        (scene, neighbours): (&Scene, &Corners),
        lighting: &Lighting<'_>,
        lights: LightKinds,
    ) -> Result<Option<Self>> {
        let Some((light, shading)) = lighting.relief() else {
            return Ok(None);
        };
        let directions = Directions::new(light.directions.len() as u32)?;
        let elements = Elements::new(scene);
        let (tiles, _) = tiles(scene, &elements)?;
        let mut surface_of = vec![u32::MAX; scene.triangles.len()];
        for (surface, tile) in (0..).zip(&tiles) {
            for &e in &tile.members {
                surface_of[elements.input_index[e] as usize] = surface;
            }
        }
        let mut march = marcher(device);
        let none = KnownFactors::default();
        let reliefs = tiles.iter().map(|tile| (&tile.field, &tile.shading));
        let known = lighting.known.unwrap_or(&none);
        let factors = known.of(&directions, reliefs, lighting.cache, |field, shading| {
            let (seen, _) = visibility(field, lighting.cache, &mut march)?;
            Ok(Factors::new(
                &directions,
                field,
                &seen,
                shading,
                FACTOR_ERROR,
            ))
        })?;
        let vertices = MesoVertices::new(scene, neighbours, &light.elements, &light.frames);
        let sharp = lighting.sharp() && lighting.shading == ReliefShading::Factored;
        let clustered = lighting.shading == ReliefShading::Clusters;
        let skipped = lighting.skip_open && (sharp || clustered);
        let surfaces = Surfaces::new(scene, &tiles, &factors, skipped);
        let relief = |i: usize| {
            let surface = surface_of[i];
            (sharp && surface != u32::MAX).then(|| OfTriangle {
                surface,
                rise: surfaces.ranges[surface as usize].rise(),
            })
        };
        let borders = Borders::new(scene, relief);
        let kind = Kind {
            shading,
            view: lighting.show.code(),
            // Light inside the relief, which is indirect, and that which arrives by slots.
            factored: lighting.part != Light::Direct || !(sharp || clustered),
            sharp,
            clustered,
            lights,
            borders: !borders.is_empty(),
            levels: clustered || surfaces.long_ways,
        };
        let gather = |moments| vertices.gather(&directions, &light.frames, moments);
        let make_passes = || -> Result<ReliefPasses> {
            Ok(match lighting.show {
                Show::Overdraw => {
                    ReliefPasses::Overdraw(ReliefOverdraw::new(device, passes, shading)?)
                }
                _ => ReliefPasses::Shaded(
                    ReliefHits::new(device, shading)?,
                    Relief::new(device, passes, kind)?,
                ),
            })
        };
        let gathered = || {
            let [all, direct] = [&light.incident_moment, &light.incident_moment_direct];
            (gather(all), gather(direct))
        };
        let ((all, direct), passes) = beside(gathered, make_passes);
        Ok(Some(Self {
            passes: Arc::new(passes?),
            normals: relief_normals(scene),
            surfaces,
            all,
            direct,
            directions,
            borders,
            tiles,
            surface_of,
            factors,
            vertices,
        }))
    }
}
