//! Where paths begin: the lights of a scene, by power.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::super::even_light::luminance;
use super::super::geometry::{ABOVE, Geometry};
use super::super::sky::Sky;
use super::super::{PointLight, Scene};
use crate::math::sampling::{Choice, Random, cosine_direction, on_triangle, sphere_direction};

/// Lights by power.
pub(super) struct Starts<'a> {
    list: Vec<Light<'a>>,
    choice: Choice,
    sky: Option<SkyCells>,
}

/// In internal units.
#[derive(Clone, Copy)]
enum Light<'a> {
    Triangle([DVec3; 3]),
    Point(DVec3, &'a PointLight),
    /// The direction towards it.
    Sun(DVec3),
    Sky,
}

/// Radius of a sphere about the scene, internal units.
const AROUND: f64 = 1.75;

/// Directions that are tried within a beam, at most: a spot 1° wide takes some 50,000.
const TRIES: usize = 100_000;

impl<'a> Starts<'a> {
    pub fn of(scene: &'a Scene, geometry: &Geometry) -> Self {
        let (mut list, mut powers) = (Vec::new(), Vec::new());
        // Powers over π.
        let mut add = |light, power: f64| {
            if power > 0.0 {
                list.push(light);
                powers.push(power);
            }
        };
        for (t, triangle) in scene.triangles.iter().enumerate() {
            let corners = geometry.corners(t);
            let [a, b, c] = corners;
            let area = 0.5 * (b - a).cross(c - a).length();
            let emitted = luminance(
                scene.materials[triangle.material as usize]
                    .emitted_over(&triangle.uv_of_emission()),
            );
            add(Light::Triangle(corners), area * emitted);
        }
        for light in &scene.lights.points {
            let power = light.solid_angle() / PI * luminance(light.intensity);
            let place = geometry.inside(light.position);
            add(Light::Point(place, light), power / geometry.unit.powi(2));
        }
        for sun in &scene.lights.suns {
            let power = luminance(sun.irradiance) * AROUND * AROUND;
            add(Light::Sun(sun.towards), power);
        }
        let sky = scene.lights.sky.as_ref().map(SkyCells::new);
        if let Some(cells) = &sky {
            add(Light::Sky, cells.choice.total() * AROUND * AROUND);
        }
        let choice = Choice::new(powers.into_iter());
        Self { list, choice, sky }
    }

    /// A place on the lights by power, and a direction; None where nothing shines.
    pub fn ray(&self, random: &mut Random) -> Option<(DVec3, DVec3)> {
        let (index, _) = self.choice.choose(random.unit())?;
        Some(match self.list[index] {
            Light::Triangle([a, b, c]) => {
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let from = on_triangle([a, b, c], random.square()) + ABOVE * normal;
                (from, cosine_direction(normal, random.square()))
            }
            Light::Point(from, light) => (from, in_beam(light, random)),
            Light::Sun(towards) => from_afar(towards, random),
            Light::Sky => from_afar(self.sky.as_ref()?.direction(random)?, random),
        })
    }
}

/// A direction by a light's shares.
fn in_beam(light: &PointLight, random: &mut Random) -> DVec3 {
    let Some(beam) = &light.beam else {
        return sphere_direction(random.square());
    };
    let highest = f64::from(beam.web.highest());
    let mut tries = (0..TRIES).map(|_| (sphere_direction(random.square()), random.unit()));
    let found = tries.find(|(direction, share)| share * highest < beam.share(*direction));
    found.map_or(beam.axis, |(direction, _)| direction)
}

/// A ray into the scene that comes from a direction.
fn from_afar(towards: DVec3, random: &mut Random) -> (DVec3, DVec3) {
    let (x, y) = towards.any_orthonormal_pair();
    let at = random.square();
    let (sin, cos) = (TAU * at.x).sin_cos();
    let radius = AROUND * at.y.sqrt();
    (AROUND * towards + radius * (cos * x + sin * y), -towards)
}

/// A sky's radiance times the solid angle by cells of direction.
struct SkyCells {
    /// Unit vectors through the middles.
    cells: Vec<DVec3>,
    choice: Choice,
}

const HEIGHTS: u32 = 32;
const AZIMUTHS: u32 = 64;

impl SkyCells {
    fn new(sky: &Sky) -> Self {
        let middle = |i: u32| {
            let height = 1.0 - 2.0 * (f64::from(i / AZIMUTHS) + 0.5) / f64::from(HEIGHTS);
            sky.towards(DVec2::new(
                height,
                f64::from(i % AZIMUTHS) / f64::from(AZIMUTHS),
            ))
        };
        let cells: Vec<DVec3> = (0..HEIGHTS * AZIMUTHS).map(middle).collect();
        let solid_angle = 4.0 * PI / f64::from(HEIGHTS * AZIMUTHS);
        let weight = |&towards: &DVec3| {
            luminance(sky.radiance(towards).to_array().map(|c| c as f32)) * solid_angle
        };
        let choice = Choice::new(cells.iter().map(weight));
        Self { cells, choice }
    }

    fn direction(&self, random: &mut Random) -> Option<DVec3> {
        let (index, _) = self.choice.choose(random.unit())?;
        Some(self.cells[index])
    }
}
