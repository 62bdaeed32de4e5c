//! Points that emitters and point lights are taken for where their light is drawn sharply, and what casts shadows there.

use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::{Lighting, Projection};
use crate::constants::{KIND_POINT, KIND_SURFACE, LIGHT_POINTS, LIGHT_SETS};
use crate::error::Result;
use crate::passes::shadow_rays::{LightBuffers, ShadowTree};
use crate::passes::types::{LightPoint, ShadowTriangle};
use crate::scene::Scene;
use crate::sources::triangle_area;
use crate::vk::Device;

/// A light point in scene units.
struct Shining {
    position: DVec3,
    /// Of an emitter; none of a point light.
    normal: Option<DVec3>,
    area: f64,
    strength: DVec3,
}

/// LIGHT_SETS sets of LIGHT_POINTS points on the emitters, if there are any, each by their power, then the point lights.
fn shining(scene: &Scene) -> Vec<Shining> {
    let mut whole = 0.0;
    // Each with the power of all up to it.
    let emitters: Vec<(usize, DVec3, f64)> = scene
        .triangles
        .iter()
        .enumerate()
        .filter_map(|(e, t)| {
            let emitted = DVec3::from(scene.materials[t.material as usize].ke.map(f64::from));
            let power = emitted.element_sum() * triangle_area(scene.corners(t));
            whole += power;
            (power > 0.0).then_some((e, emitted, whole))
        })
        .collect();
    let share = whole / f64::from(LIGHT_POINTS);
    let mut points = Vec::new();
    for i in 0..LIGHT_SETS * LIGHT_POINTS {
        let (set, i_in_set) = (i / LIGHT_POINTS, i % LIGHT_POINTS);
        let in_share = (f64::from(set) + 0.5) / f64::from(LIGHT_SETS);
        let at = (f64::from(i_in_set) + in_share) * share;
        let place = emitters.partition_point(|e| e.2 < at);
        let Some(&(e, emitted, _)) = emitters.get(place).or(emitters.last()) else {
            break;
        };
        let [a, b, c] = scene.corners(&scene.triangles[e]);
        // The R2 sequence (Roberts 2018), folded into the triangle: each run of it is spread evenly.
        let along = |step: f64| (0.5 + step * f64::from(i)).fract();
        let (s, t) = (
            along(0.754_877_666_246_692_8),
            along(0.569_840_290_998_053_2),
        );
        let (s, t) = if s + t > 1.0 {
            (1.0 - s, 1.0 - t)
        } else {
            (s, t)
        };
        points.push(Shining {
            position: a + (b - a) * s + (c - a) * t,
            normal: Some((b - a).cross(c - a).normalize_or_zero()),
            area: share / emitted.element_sum(),
            strength: emitted * (share / emitted.element_sum()),
        });
    }
    points.extend(scene.point_lights.iter().map(|light| Shining {
        position: light.position,
        normal: None,
        area: 0.0,
        strength: DVec3::from(light.intensity.map(f64::from)),
    }));
    points
}

impl Shining {
    fn seen_from(&self, projection: &Projection) -> LightPoint {
        let square = projection.unit * projection.unit;
        LightPoint {
            position: ((self.position - projection.eye) / projection.unit).as_vec3(),
            kind: if self.normal.is_some() {
                KIND_SURFACE
            } else {
                KIND_POINT
            },
            normal: self.normal.unwrap_or_default().as_vec3(),
            area: (self.area / square) as f32,
            strength: (self.strength / square).as_vec3(),
        }
    }
}

/// The scene's light points and what casts shadows before them; nothing where no light is drawn sharply.
///
/// All is taken from the eye, rounded as what is drawn is: a place that is drawn is as near to what casts its shadow as to
/// itself.
///
/// # Errors
/// A device without the memory.
pub fn light_buffers(
    device: &Arc<Device>,
    scene: &Scene,
    lighting: &Lighting<'_>,
    projection: &Projection,
) -> Result<LightBuffers> {
    let points: Vec<_> = if lighting.sharp() {
        shining(scene)
            .iter()
            .map(|point| point.seen_from(projection))
            .collect()
    } else {
        Vec::new()
    };
    let tree = if points.is_empty() {
        ShadowTree::default()
    } else {
        ShadowTree::new(casters(scene, lighting, projection))
    };
    LightBuffers::new(device, &points, &tree)
}

/// Every triangle, those with relief at its mean height.
fn casters(scene: &Scene, lighting: &Lighting<'_>, projection: &Projection) -> Vec<ShadowTriangle> {
    let relief_is_drawn = lighting.relief().is_some();
    scene
        .triangles
        .par_iter()
        .map(|t| {
            let corners = scene.corners(t);
            let [a, b, c] = corners.map(|p| ((p - projection.eye) / projection.unit).as_vec3());
            let relief = relief_is_drawn && scene.materials[t.material as usize].has_relief();
            ShadowTriangle {
                a,
                b,
                c,
                relief: relief.into(),
            }
        })
        .collect()
}
