//! What a renderer has ready: of the scene, and of the view.

use std::sync::Arc;

use super::flat_relief::SortedRelief;
use super::lights::{LightScene, light_buffers, light_kinds, sharp_emitters};
use super::mesh::Mesh;
use super::mesh_scene::MeshScene;
use super::relief::Relief;
use super::relief_scene::ReliefScene;
use super::seen_scene::SeenScene;
use super::textures::{Bound, Textures};
use super::{Cuts, Lighting, Show, View};
use crate::beside::beside;
use crate::error::Result;
use crate::mesh::corners::Corners;
use crate::passes::shade::{Passes, Shade};
use crate::passes::shadow_rays::LightBuffers;
use crate::picture::{Light, Projection};
use crate::scene::Scene;
use crate::scene::sky::Sky;
use crate::vk::Device;

/// What does not depend on the view.
pub struct Fixed<'a> {
    pub device: Arc<Device>,
    pub scene: &'a Scene,
    pub lighting: Lighting<'a>,
    /// Samples along a pixel's side that the view is prepared for.
    pub samples: u32,
    pub shade: Shade,
    pub textures: Textures,
    relief: Option<ReliefScene>,
    mesh: MeshScene,
    light_scene: LightScene,
}

impl<'a> Fixed<'a> {
    pub fn new(
        device: &Arc<Device>,
        scene: &'a Scene,
        lighting: Lighting<'a>,
        samples: u32,
    ) -> Result<Self> {
        let emitters = sharp_emitters(scene, &lighting);
        let is_sharp = emitters.is_some();
        let lights = light_kinds(scene, emitters.as_ref());
        let passes = Passes::new(device)?;
        let pipelines = || {
            let glows = scene.materials.iter().any(|m| m.map_ke.is_some());
            let shade = Shade::new(device, &passes, glows, lights)?;
            Ok((shade, Textures::new(device, scene)?))
        };
        let surfaces = || {
            let neighbours = Corners::new(scene);
            let (of_relief, mesh) = beside(
                || ReliefScene::new(device, &passes, (scene, &neighbours), &lighting, lights),
                || MeshScene::new(scene, &lighting, &neighbours, is_sharp),
            );
            Ok((of_relief?, mesh))
        };
        let (surfaces, (pipelines, light_scene)) = beside(surfaces, || {
            (pipelines(), LightScene::new(scene, &lighting, emitters))
        });
        let (relief, mesh) = surfaces?;
        let (shade, textures) = pipelines?;
        Ok(Self {
            device: Arc::clone(device),
            scene,
            lighting,
            samples,
            shade,
            textures,
            relief,
            mesh,
            light_scene,
        })
    }

    /// The sky, if the picture shows it.
    pub fn sky(&self) -> Option<&Sky> {
        let shows = self.lighting.show == Show::Shaded && self.lighting.part != Light::Direct;
        self.scene.lights.sky.as_ref().filter(|_| shows)
    }
}

/// What depends on the view.
pub struct ViewParts {
    /// Pixels across and down.
    pub size: (u32, u32),
    pub projection: Projection,
    pub lights: LightBuffers,
    pub bound: Bound,
    pub mesh: Mesh,
    pub relief: Option<Relief>,
}

impl ViewParts {
    pub fn new(fixed: &Fixed<'_>, view: &View<'_>) -> Result<Self> {
        let device = &fixed.device;
        let projection = Projection::new(fixed.scene, view)?;
        let seen = SeenScene {
            scene: fixed.scene,
            lighting: &fixed.lighting,
            projection: &projection,
            samples: fixed.samples,
            cuts: Cuts::default(),
        };
        let (lights, shafts) = light_buffers(device, &seen, &fixed.light_scene)?;
        let shafts = shafts.as_ref();
        let sorted = SortedRelief::new(&seen, fixed.relief.as_ref());
        let flat = sorted.as_ref().map(|relief| &relief.flat);
        let (relief, mesh) = beside(
            || {
                let relief = sorted.as_ref();
                relief.map(|relief| Relief::new(device, &seen, relief, shafts))
            },
            || Mesh::new(device, &seen, &fixed.mesh, flat, shafts),
        );
        let mesh = mesh?;
        Ok(Self {
            size: (view.width, view.height),
            bound: fixed.textures.bind(&fixed.shade, &lights, &mesh.lit)?,
            lights,
            mesh,
            relief: relief.transpose()?,
            projection,
        })
    }
}
