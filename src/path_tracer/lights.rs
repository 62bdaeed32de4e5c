//! Emitters and point lights, and the light straight from them.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use super::geometry::{ABOVE, Geometry, Hit};
use super::sampling::{Choice, on_triangle};
use crate::picture::tone::luminance;
use crate::scene::sky::Sky;
use crate::scene::{Beam, Material, Scene};

/// Emitters by power and point lights by intensity.
pub struct Lights {
    areas: Choice,
    /// Emitting triangles, in the order of the input, with area in internal units and radiance.
    emitters: Vec<Emitter>,
    /// `[triangle]`, its place in `emitters`.
    emitter_of: Vec<u32>,
    points: Choice,
    point_lights: Vec<Point>,
    suns: Choice,
    sun_discs: Vec<Disc>,
    sky: Option<Sky>,
}

struct Emitter {
    corners: [DVec3; 3],
    normal: DVec3,
    area: f64,
    /// In the mean, by which emitters are chosen.
    radiance: DVec3,
    texture: Option<Glow>,
}

/// Radiance by place.
struct Glow {
    material: Material,
    uv: [DVec3; 3],
}

impl Emitter {
    /// Radiance at the place that a sample gives.
    fn radiance_at(&self, at: DVec2) -> DVec3 {
        self.texture.as_ref().map_or(self.radiance, |glow| {
            let uv = on_triangle(glow.uv, at);
            glow.at(uv.truncate())
        })
    }
}

impl Glow {
    fn at(&self, uv: DVec2) -> DVec3 {
        Vec3::from_array(self.material.emitted_at(uv.x, uv.y)).as_dvec3()
    }
}

struct Point {
    place: DVec3,
    /// Irradiance at one internal unit.
    intensity: DVec3,
    beam: Option<Beam>,
}

struct Disc {
    towards: DVec3,
    /// Sine of half the angle that it is seen under.
    sine: f64,
    /// Of a surface that faces its middle.
    irradiance: DVec3,
}

/// Where a light path begins, internal units.
pub struct Start {
    pub place: DVec3,
    /// Of the emitter; none of a point light, which the path leaves in any direction.
    pub normal: Option<DVec3>,
    /// Radiant flux over the probability of this start, RGB.
    pub power: DVec3,
}

const NONE: u32 = u32::MAX;

impl Lights {
    pub fn new(scene: &Scene, geometry: &Geometry) -> Self {
        let mut emitters = Vec::new();
        let mut emitter_of = vec![NONE; scene.triangles.len()];
        for (index, triangle) in scene.triangles.iter().enumerate() {
            let material = &scene.materials[triangle.material as usize];
            let corners = geometry.corners(index);
            let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            if material.emits() && cross.length() > 0.0 {
                emitter_of[index] = emitters.len() as u32;
                emitters.push(Emitter {
                    corners,
                    normal: cross.normalize(),
                    area: 0.5 * cross.length(),
                    radiance: Vec3::from_array(material.emitted_over(&triangle.uv_of_emission()))
                        .as_dvec3(),
                    texture: material.map_ke.is_some().then(|| Glow {
                        material: material.clone(),
                        uv: (triangle.uv_of_emission())
                            .map(|[u, v]| DVec3::new(u.into(), v.into(), 0.0)),
                    }),
                });
            }
        }
        let point_lights: Vec<_> = scene
            .lights
            .points
            .iter()
            .map(|light| Point {
                place: geometry.inside(light.position),
                intensity: Vec3::from_array(light.intensity).as_dvec3() / geometry.unit.powi(2),
                beam: light.beam.clone(),
            })
            .collect();
        let sun_discs: Vec<_> = (scene.lights.suns.iter())
            .map(|sun| Disc {
                towards: sun.towards,
                sine: (0.5 * sun.angle.to_radians()).sin(),
                irradiance: Vec3::from_array(sun.irradiance).as_dvec3(),
            })
            .collect();
        let bright = |colour: DVec3| f64::from(luminance(colour.as_vec3().to_array()));
        Self {
            areas: Choice::new(emitters.iter().map(|e| e.area * bright(e.radiance))),
            emitters,
            emitter_of,
            points: Choice::new(point_lights.iter().map(|p| bright(p.intensity))),
            point_lights,
            suns: Choice::new(sun_discs.iter().map(|sun| bright(sun.irradiance))),
            sun_discs,
            sky: scene.lights.sky.clone(),
        }
    }

    /// Radiance of the sky from a direction.
    pub fn sky(&self, direction: DVec3) -> DVec3 {
        let sky = self.sky.as_ref();
        sky.map_or(DVec3::ZERO, |sky| sky.radiance(direction))
    }

    /// The start of a light path, chosen by power among emitters and point lights; None where
    /// nothing emits. `choice` in 0..1 picks the light, `at` the place on it.
    pub fn start(&self, choice: f64, at: DVec2) -> Option<Start> {
        // An emitter sends π Le A, a point light 4π I.
        let (areas, points) = (PI * self.areas.total(), 4.0 * PI * self.points.total());
        let from_areas = areas / (areas + points);
        if choice < from_areas {
            let (index, probability) = self.areas.choose(choice / from_areas)?;
            let emitter = &self.emitters[index];
            let chance = probability * from_areas;
            return Some(Start {
                place: on_triangle(emitter.corners, at),
                normal: Some(emitter.normal),
                power: emitter.radiance_at(at) * (PI * emitter.area / chance),
            });
        }
        let (index, probability) = self
            .points
            .choose((choice - from_areas) / (1.0 - from_areas))?;
        let light = &self.point_lights[index];
        Some(Start {
            place: light.place,
            normal: None,
            power: light.intensity * (4.0 * PI / (probability * (1.0 - from_areas))),
        })
    }

    /// Places and radiant intensities of the point lights.
    pub fn points(&self) -> impl Iterator<Item = (DVec3, DVec3)> + '_ {
        self.point_lights.iter().map(|p| (p.place, p.intensity))
    }

    /// Whether the front of a triangle emits anywhere.
    pub fn emits(&self, triangle: usize) -> bool {
        self.emitter_of[triangle] != NONE
    }

    /// Radiance that the front of a triangle emits at a hit.
    pub fn emitted(&self, hit: &Hit) -> DVec3 {
        match self.emitter_of[hit.triangle] {
            NONE => DVec3::ZERO,
            place => {
                let emitter = &self.emitters[place as usize];
                emitter.texture.as_ref().map_or(emitter.radiance, |glow| {
                    glow.at(hit.interpolate(glow.uv.map(DVec3::truncate)))
                })
            }
        }
    }

    /// One sample of the irradiance at `place` from point lights and suns, and of that from
    /// emitters weighted by the balance heuristic (Veach 1997) against sampling directions with
    /// density cos θ / π.
    pub fn sample(
        &self,
        geometry: &Geometry,
        place: DVec3,
        normal: DVec3,
        choices: (f64, f64),
        at: DVec2,
    ) -> DVec3 {
        let above = place + ABOVE * normal;
        let mut sum = DVec3::ZERO;
        if let Some((index, probability)) = self.points.choose(choices.0) {
            let light = &self.point_lights[index];
            let to = light.place - place;
            let cosine = normal.dot(to.normalize_or_zero());
            if cosine > 0.0 && geometry.sees(above, light.place) {
                let share = light.beam.as_ref().map_or(1.0, |beam| beam.share(-to));
                sum += light.intensity * (share * cosine / (to.length_squared() * probability));
            }
        }
        if let Some((index, probability)) = self.suns.choose(choices.1) {
            // Even over the disc's projection.
            let sun = &self.sun_discs[index];
            let (x, y) = sun.towards.any_orthonormal_pair();
            let radius = sun.sine * at.x.sqrt();
            let (sin, cos) = (2.0 * PI * at.y).sin_cos();
            let middle = (1.0 - radius * radius).sqrt();
            let to = middle * sun.towards + radius * (cos * x + sin * y);
            let cosine = normal.dot(to);
            if cosine > 0.0 && geometry.hit(above, to).is_none() {
                sum += sun.irradiance * (cosine / probability);
            }
        }
        if let Some((index, probability)) = self.areas.choose(choices.1) {
            let emitter = &self.emitters[index];
            let target = on_triangle(emitter.corners, at);
            let to = target - place;
            let direction = to.normalize_or_zero();
            let (here, there) = (normal.dot(direction), -emitter.normal.dot(direction));
            if here > 0.0 && there > 0.0 && geometry.sees(above, target + ABOVE * emitter.normal) {
                let density = probability / emitter.area * to.length_squared() / there;
                sum += emitter.radiance_at(at) * (here / (density + here / PI));
            }
        }
        sum
    }

    /// The balance heuristic's weight of an emitter hit by a direction of density cos θ / π.
    pub fn weight_when_met(&self, hit: &Hit, direction: DVec3, cosine: f64) -> f64 {
        let place = self.emitter_of[hit.triangle];
        if place == NONE {
            return 1.0;
        }
        let there = -hit.normal.dot(direction);
        let probability = self.areas.probability(place as usize);
        let density =
            probability / self.emitters[place as usize].area * hit.distance.powi(2) / there;
        let met = cosine / PI;
        if probability > 0.0 {
            met / (met + density)
        } else {
            1.0
        }
    }
}
