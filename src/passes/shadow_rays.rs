//! What casts shadows, on the device. Shaders: `shared/shadow_rays.glsl`, and `shadow_rays.comp`
//! for tests; twin: [`crate::reference::shadow_rays`].

use std::sync::Arc;

use bytemuck::Zeroable;

use super::buffers::{download, upload};
use super::groups;
use super::shaders::shadow_rays::{Bindings, Parameters, SHADER};
use super::types::{LightPoint, LightPolygon, ShadowRay};
use crate::constants::KIND_SURFACE;
use crate::error::Result;
use crate::mesh::shadow_tree::ShadowTree;
use crate::vk::{Buffer, BufferUse, Commands, ComputePipeline, Device};

/// Light points and what casts shadows, on the device; empty where nothing is lit by them.
pub struct LightBuffers {
    pub points: Buffer,
    pub nodes: Buffer,
    pub triangles: Buffer,
    /// Shares of the intensity of beams.
    pub webs: Buffer,
    pub polygons: Buffer,
    pub counts: LightCounts,
}

/// How many lights there are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LightCounts {
    /// All light points.
    pub points: u32,
    /// Those of emitters, which come first.
    pub of_emitters: u32,
    /// Emitters and suns in closed form; without any, emitters shine by their points alone.
    pub polygons: u32,
}

/// What shaders of light points are made for.
#[derive(Debug, Clone, Copy)]
pub struct LightKinds {
    /// Whether point lights have beams.
    pub beams: bool,
    /// Ways to lights that a sample follows together, at least 1.
    pub ways: u32,
    /// Whether places that nothing shadows are lit by points.
    pub points: bool,
}

/// Lights that are seen from places.
#[derive(Debug, Default)]
pub struct Lights {
    /// Points of emitters first, LIGHT_SETS · LIGHT_POINTS or none.
    pub points: Vec<LightPoint>,
    /// Shares of the intensity of beams.
    pub webs: Vec<f32>,
    /// All emitters and suns, or none.
    pub polygons: Vec<LightPolygon>,
}

impl LightBuffers {
    /// # Errors
    /// A device without the memory.
    pub fn new(device: &Arc<Device>, lights: &Lights, tree: &ShadowTree) -> Result<Self> {
        let Lights {
            points,
            webs,
            polygons,
        } = lights;
        let emitters = points.iter().filter(|p| p.kind == KIND_SURFACE).count();
        let texels = BufferUse::Texels;
        // Shaders look at one whether there is any or none.
        let none = [LightPolygon::zeroed()];
        let listed = match polygons.is_empty() {
            true => &none[..],
            false => polygons,
        };
        Ok(Self {
            points: upload(device, "light points", points, texels)?,
            nodes: upload(device, "shadow nodes", tree.nodes(), texels)?,
            triangles: upload(device, "shadow triangles", &tree.triangles, texels)?,
            webs: upload(device, "webs", webs, BufferUse::Storage)?,
            polygons: upload(device, "light polygons", listed, texels)?,
            counts: LightCounts {
                points: points.len() as u32,
                of_emitters: emitters as u32,
                polygons: polygons.len() as u32,
            },
        })
    }
}

/// Walks ways alone, for tests.
pub struct ShadowRays {
    pipeline: ComputePipeline,
    device: Arc<Device>,
}

impl ShadowRays {
    /// # Errors
    /// A device that fails.
    pub fn new(device: &Arc<Device>) -> Result<Self> {
        Ok(Self {
            pipeline: ComputePipeline::new(device, "shadow rays", &SHADER)?,
            device: Arc::clone(device),
        })
    }

    /// Whether something stands on each way, `[ray]`.
    ///
    /// # Errors
    /// A device that lacks the memory or fails.
    pub fn run(&self, tree: &ShadowTree, rays: &[ShadowRay]) -> Result<Vec<bool>> {
        let scene = LightBuffers::new(&self.device, &Lights::default(), tree)?;
        let count = rays.len() as u32;
        let rays = upload(&self.device, "shadow rays", rays, BufferUse::Storage)?;
        let bytes = u64::from(count) * 4;
        let hits = Buffer::new(&self.device, "shadow hits", bytes, BufferUse::Storage)?;
        let bound = self.pipeline.bind(&Bindings {
            shadow_nodes: &scene.nodes,
            shadow_triangles: &scene.triangles,
            rays: &rays,
            hits: &hits,
        })?;
        Commands::run(&self.device, "shadow rays", |cmd| {
            let size = [groups(count), 1, 1];
            cmd.dispatch(&bound, &Parameters { count }, size);
            Ok(())
        })?;
        let hits: Vec<u32> = download(&self.device, &hits, count as usize)?;
        Ok(hits.into_iter().map(|hit| hit != 0).collect())
    }
}
