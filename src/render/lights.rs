//! Lights where their light is drawn sharply, and the shadow casters.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::DVec3;

use super::Lighting;
use super::emitters::{Emitters, Shining};
use super::seen_scene::SeenScene;
use super::shafts::Shafts;
use crate::constants::{KIND_BEAM, KIND_POINT, KIND_SURFACE};
use crate::error::Result;
use crate::mesh::merged::{Merged, merged};
use crate::mesh::shadow_tree::ShadowTree;
use crate::passes::shadow_rays::{LightBuffers, LightKinds, Lights};
use crate::passes::types::{LightPoint, ShadowTriangle};
use crate::picture::Projection;
use crate::scene::{Scene, Sun, Triangle};
use crate::vk::Device;

/// Distance of what stands for suns, in sizes of the scene: shadows of places a size apart then
/// turn by a tenth of a millirad, a hundredth of the sun's own angle.
const FAR: f64 = 1e4;

pub(super) fn sun_distance(scene: &Scene) -> f64 {
    let (low, high) = scene.bounds();
    FAR * low.distance(high)
}

/// Triangles in place of a sun, which face the scene, scene units; of one without a size as small
/// ones as make a sharp shadow.
pub(super) fn sun_disc(scene: &Scene, sun: &Sun) -> Vec<[DVec3; 3]> {
    const SIDES: u32 = 24;
    let (low, high) = scene.bounds();
    let distance = sun_distance(scene);
    let middle = low.midpoint(high) + distance * sun.towards;
    let radius = distance * (0.5 * sun.angle.to_radians()).sin().max(1e-6);
    let (x, y) = (-sun.towards).any_orthonormal_pair();
    let corner = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(SIDES);
        middle + radius * (angle.cos() * x + angle.sin() * y)
    };
    (0..SIDES)
        .map(|i| [middle, corner(i), corner(i + 1)])
        .collect()
}

/// Ways to several lights at least are followed together.
const MOST_WAYS: usize = 4;

/// What shaders are made for where these lights are drawn sharply.
pub(super) fn light_kinds(scene: &Scene, emitters: Option<&Emitters>) -> LightKinds {
    let emits = |t: &Triangle| scene.materials[t.material as usize].emits();
    let most = match scene.lights.suns.is_empty() && !scene.triangles.iter().any(emits) {
        true => scene.lights.points.len().clamp(1, MOST_WAYS),
        false => MOST_WAYS,
    };
    LightKinds {
        beams: scene.lights.have_beams(),
        ways: most as u32,
        points: emitters.is_none_or(|lit| lit.light_by_points(scene)),
    }
}

impl Shining {
    /// Appends the shares of a beam to `webs`.
    fn seen_from(&self, projection: &Projection, webs: &mut Vec<f32>) -> LightPoint {
        let square = projection.unit * projection.unit;
        let mut point = LightPoint {
            position: ((self.position - projection.eye) / projection.unit).as_vec3(),
            kind: if self.normal.is_some() {
                KIND_SURFACE
            } else {
                KIND_POINT
            },
            normal: self.normal.unwrap_or_default().as_vec3(),
            area: (self.area / square) as f32,
            strength: (self.strength / square).as_vec3(),
            ..LightPoint::zeroed()
        };
        if let Some(beam) = &self.beam {
            point.kind = KIND_BEAM;
            point.normal = beam.axis.as_vec3();
            point.zero = beam.zero.as_vec3();
            point.first_share = webs.len() as u32;
            (point.rows, point.columns) = (beam.web.rows, beam.web.columns);
            webs.extend(&beam.web.shares);
        }
        point
    }
}

/// What shines in a scene and what stands in the way, for any eye; nothing where no light is drawn
/// sharply.
#[derive(Default)]
pub struct LightScene {
    emitters: Option<Emitters>,
    /// Of one kind those with relief, at its mean height.
    casters: Vec<Merged<bool>>,
}

/// What shines in a scene; None where no light is drawn sharply.
pub(super) fn sharp_emitters(scene: &Scene, lighting: &Lighting<'_>) -> Option<Emitters> {
    let emitters = lighting.sharp().then(|| Emitters::new(scene));
    emitters.filter(|emitters| !emitters.points.is_empty())
}

impl LightScene {
    pub fn new(scene: &Scene, lighting: &Lighting<'_>, emitters: Option<Emitters>) -> Self {
        if emitters.is_none() {
            return Self::default();
        }
        let relief_is_drawn = lighting.relief().is_some();
        let has_relief = |t: &Triangle| scene.materials[t.material as usize].has_relief();
        let kind = |i: usize| Some(relief_is_drawn && has_relief(&scene.triangles[i]));
        Self {
            emitters,
            casters: merged(scene, kind),
        }
    }

    fn casters(&self, scene: &Scene, projection: &Projection) -> Vec<ShadowTriangle> {
        let seen = |v: u32| {
            let place = scene.vertices[v as usize];
            ((place - projection.eye) / projection.unit).as_vec3()
        };
        let caster = |t: &Merged<bool>| {
            let [a, b, c] = t.vertices.map(seen);
            ShadowTriangle {
                a,
                b,
                c,
                relief: t.kind.into(),
                ..ShadowTriangle::zeroed()
            }
        };
        self.casters.iter().map(caster).collect()
    }
}

/// The scene's light points and shadow casters on the device, and, where any light is drawn
/// sharply, the shafts.
///
/// All positions are relative to the eye and rounded like those of the drawn triangles, so that
/// casters and drawn places agree.
///
/// # Errors
/// A device without the memory.
pub fn light_buffers(
    device: &Arc<Device>,
    seen: &SeenScene<'_>,
    light_scene: &LightScene,
) -> Result<(LightBuffers, Option<Shafts>)> {
    let SeenScene {
        scene,
        lighting,
        projection,
        ..
    } = *seen;
    let mut lights = Lights::default();
    let Some(emitters) = &light_scene.emitters else {
        let none = LightBuffers::new(device, &lights, &ShadowTree::default())?;
        return Ok((none, None));
    };
    let of_point = |point: &Shining| point.seen_from(projection, &mut lights.webs);
    lights.points = emitters.points.iter().map(of_point).collect();
    lights.polygons = emitters.seen_from(scene, projection);
    let tree = ShadowTree::new(light_scene.casters(scene, projection));
    let buffers = LightBuffers::new(device, &lights, &tree)?;
    let shafts = if lighting.skip_open {
        Shafts::new(tree, scene, projection)
    } else {
        Shafts::closed()
    };
    Ok((buffers, Some(shafts)))
}
