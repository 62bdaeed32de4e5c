//! Lights where their light is drawn sharply: emitters in closed form, points that stand for them
//! where shadows are looked for, point lights; and the shadow casters.

use std::f64::consts::PI;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::Lighting;
use super::seen_scene::SeenScene;
use super::shafts::Shafts;
use crate::constants::{KIND_BEAM, KIND_POINT, KIND_SURFACE, LIGHT_POINTS, LIGHT_SETS};
use crate::error::Result;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::triangle_area;
use crate::passes::shadow_rays::{LightBuffers, LightKinds, Lights};
use crate::passes::types::{LightPoint, LightPolygon, ShadowTriangle};
use crate::picture::Projection;
use crate::scene::{Beam, Scene, Sun, Triangle};
use crate::vk::Device;

/// A light point in scene units.
struct Shining {
    position: DVec3,
    /// Normal of an emitter; None for a point light.
    normal: Option<DVec3>,
    area: f64,
    strength: DVec3,
    beam: Option<Beam>,
}

/// A triangle that emits.
struct Emitter {
    corners: [DVec3; 3],
    radiance: DVec3,
    /// Its area over its power.
    area_of_power: f64,
    /// Power of it and of all before it.
    whole: f64,
}

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
pub(super) fn light_kinds(scene: &Scene) -> LightKinds {
    let emits = |t: &Triangle| scene.materials[t.material as usize].emits();
    let most = match scene.lights.suns.is_empty() && !scene.triangles.iter().any(emits) {
        true => scene.lights.points.len().clamp(1, MOST_WAYS),
        false => MOST_WAYS,
    };
    LightKinds {
        beams: scene.lights.have_beams(),
        ways: most as u32,
    }
}

/// Most polygons whose light is found in closed form: each costs about as much as a light point.
const MOST_POLYGONS: usize = 16;

/// An emitter in closed form, its last corner twice if it is a triangle.
struct Polygon {
    corners: [DVec3; 4],
    radiance: [f32; 3],
}

impl Polygon {
    /// The same with a triangle that continues it across an edge to a convex quadrangle in one
    /// plane, of the same radiance.
    fn joined(&self, corners: [DVec3; 3], radiance: [f32; 3]) -> Option<Self> {
        let [a, b, c, d] = self.corners;
        if radiance != self.radiance || c != d {
            return None;
        }
        let own = [a, b, c];
        // The edge runs the other way in the other triangle.
        let (k, l) = (0..3)
            .flat_map(|k| (0..3).map(move |l| (k, l)))
            .find(|&(k, l)| own[k] == corners[(l + 1) % 3] && own[(k + 1) % 3] == corners[l])?;
        let new = corners[(l + 2) % 3];
        let quad = [own[k], new, own[(k + 1) % 3], own[(k + 2) % 3]];
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let turns = |i: usize| {
            let [p, q, r] = [0, 1, 2].map(|j| quad[(i + j) % 4]);
            let turn = (q - p).cross(r - q);
            turn.normalize_or_zero().dot(normal) > 1.0 - 1e-9
        };
        (0..4).all(turns).then_some(Self {
            corners: quad,
            ..*self
        })
    }
}

/// Emitters and suns whose light is found in closed form: all, or none where they are many.
fn polygons(scene: &Scene, projection: &Projection) -> Vec<LightPolygon> {
    let mut found: Vec<Polygon> = Vec::new();
    for t in &scene.triangles {
        let material = &scene.materials[t.material as usize];
        let radiance = material.emitted_over(&t.uv_of_emission());
        if !radiance.iter().any(|&c| c > 0.0) {
            continue;
        }
        let corners = scene.corners(t);
        // Those of one lamp come one after another.
        let joined = found.last().and_then(|last| last.joined(corners, radiance));
        match (found.last_mut(), joined) {
            (Some(last), Some(joined)) => *last = joined,
            _ => {
                let [a, b, c] = corners;
                found.push(Polygon {
                    corners: [a, b, c, c],
                    radiance,
                });
            }
        }
        if found.len() > MOST_POLYGONS {
            return Vec::new();
        }
    }
    let emitters = found.into_iter().map(|polygon| {
        let seen = |p: DVec3| ((p - projection.eye) / projection.unit).as_vec3();
        let [a, b, c, d] = polygon.corners.map(seen);
        let strength = std::f32::consts::PI * Vec3::from(polygon.radiance);
        LightPolygon {
            a,
            b,
            c,
            d,
            strength,
            far: 0,
        }
    });
    let suns = scene.lights.suns.iter().map(|sun| {
        let towards = sun.towards.as_vec3();
        LightPolygon {
            a: towards,
            b: towards,
            c: towards,
            d: towards,
            strength: sun.irradiance.into(),
            far: 1,
        }
    });
    emitters.chain(suns).collect()
}

/// LIGHT_SETS sets of LIGHT_POINTS points on the emitters, distributed by power, if there are
/// emitters; then the point lights.
fn shining(scene: &Scene) -> Vec<Shining> {
    let mut whole = 0.0;
    // Each with the cumulative power up to and including it.
    let mut emitters: Vec<Emitter> = Vec::new();
    let mut area = 0.0;
    for t in &scene.triangles {
        let corners = scene.corners(t);
        let radiance = scene.materials[t.material as usize].emitted_over(&t.uv_of_emission());
        let radiance = DVec3::from(radiance.map(f64::from));
        let of_triangle = triangle_area(corners);
        let power = radiance.element_sum() * of_triangle;
        area += of_triangle;
        if power > 0.0 {
            whole += power;
            emitters.push(Emitter {
                corners,
                radiance,
                area_of_power: 1.0 / radiance.element_sum(),
                whole,
            });
        }
    }
    for sun in &scene.lights.suns {
        let discs = sun_disc(scene, sun);
        let irradiance = DVec3::from(sun.irradiance.map(f64::from));
        // What arrives, over π as the power of the others: a convex body's shadow is a quarter of
        // its area in the mean.
        let power = irradiance.element_sum() * area / (4.0 * PI * discs.len() as f64);
        let square = discs
            .iter()
            .map(|&corners| triangle_area(corners))
            .sum::<f64>();
        let distance = sun_distance(scene);
        for corners in discs.into_iter().filter(|_| power > 0.0) {
            whole += power;
            emitters.push(Emitter {
                corners,
                radiance: irradiance * (distance * distance / square),
                area_of_power: triangle_area(corners) / power,
                whole,
            });
        }
    }
    let share = whole / f64::from(LIGHT_POINTS);
    let mut points = Vec::new();
    // Number of points that each emitter has so far: those of the next set fall between them.
    let mut taken = vec![0; emitters.len()];
    for i in 0..LIGHT_SETS * LIGHT_POINTS {
        let (set, i_in_set) = (i / LIGHT_POINTS, i % LIGHT_POINTS);
        let in_share = (f64::from(set) + 0.5) / f64::from(LIGHT_SETS);
        let at = (f64::from(i_in_set) + in_share) * share;
        let place = emitters.partition_point(|e| e.whole < at);
        let place = place.min(emitters.len().saturating_sub(1));
        let Some(emitter) = emitters.get(place) else {
            break;
        };
        let corners = emitter.corners;
        let [a, b, c] = corners;
        let of_point = share * emitter.area_of_power;
        let position = spread(corners, taken[place]);
        taken[place] += 1;
        points.push(Shining {
            position,
            normal: Some((b - a).cross(c - a).normalize_or_zero()),
            area: of_point,
            strength: emitter.radiance * of_point,
            beam: None,
        });
    }
    points.extend(scene.lights.points.iter().map(|light| Shining {
        position: light.position,
        normal: None,
        area: 0.0,
        strength: DVec3::from(light.intensity.map(f64::from)),
        beam: light.beam.clone(),
    }));
    points
}

/// Place i of a sequence in a triangle. If the triangle is cut into 4ⁿ similar ones, each of the
/// first 4ⁿ places lies in another of them: the triangular van der Corput sequence of Basu and Owen
/// 2015, with each digit permuted by those before it. Without the permutation places lie in rows,
/// and many would pass a shadow's edge at once.
fn spread(corners: [DVec3; 3], i: u32) -> DVec3 {
    let [mut a, mut b, mut c] = corners;
    let mut digits = i;
    let mut turn = 0_u32;
    // All digits of any i, and zeros, which shrink the triangle towards its centroid.
    for _ in 0..16 {
        let (ab, bc, ca) = ((a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0);
        let child = (digits % 4 + (turn >> 30)) % 4;
        turn = (turn ^ (child + 1)).wrapping_mul(0x9e37_79b9);
        (a, b, c) = match child {
            0 => (bc, ca, ab),
            1 => (a, ab, ca),
            2 => (ab, b, bc),
            _ => (ca, bc, c),
        };
        digits /= 4;
    }
    (a + b + c) / 3.0
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

/// The scene's light points and shadow casters on the device, and, where any light is drawn
/// sharply, the shafts.
///
/// All positions are relative to the eye and rounded like those of the drawn triangles, so that
/// casters and drawn places agree exactly.
///
/// # Errors
/// A device without the memory.
pub fn light_buffers(
    device: &Arc<Device>,
    seen: &SeenScene<'_>,
) -> Result<(LightBuffers, Option<Shafts>)> {
    let SeenScene {
        scene,
        lighting,
        projection,
        ..
    } = *seen;
    let mut lights = Lights::default();
    if lighting.sharp() {
        let points = shining(scene);
        let seen = |point: &Shining| point.seen_from(projection, &mut lights.webs);
        lights.points = points.iter().map(seen).collect();
        lights.polygons = polygons(scene, projection);
    }
    if lights.points.is_empty() {
        let none = LightBuffers::new(device, &lights, &ShadowTree::default())?;
        return Ok((none, None));
    }
    let tree = ShadowTree::new(casters(scene, lighting, projection));
    let buffers = LightBuffers::new(device, &lights, &tree)?;
    let shafts = if lighting.skip_open {
        Shafts::new(tree, scene, projection)
    } else {
        Shafts::closed()
    };
    Ok((buffers, Some(shafts)))
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
                ..ShadowTriangle::zeroed()
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 4³ places in a row, one lies in each of the 64 parts; and their mean is the middle, each
    /// part's being its own.
    #[test]
    fn places_are_spread_evenly() {
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y];
        let mut found = std::collections::HashSet::new();
        let mut mean = DVec3::ZERO;
        for i in 64..128 {
            let place = spread(corners, i);
            mean += place / 64.0;
            let (x, y) = (8.0 * place.x, 8.0 * place.y);
            let upper = x.fract() + y.fract() > 1.0;
            found.insert((x as u32, y as u32, upper));
        }
        assert_eq!(found.len(), 64);
        // Half the size of a part: the most by which the mean place can be shifted.
        const SHIFT: f64 = 1.0 / 16.0;
        assert!((mean - DVec3::new(1.0, 1.0, 0.0) / 3.0).length() < SHIFT);
    }
}
