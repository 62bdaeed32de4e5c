//! Where paths begin: the lights of a scene, by power.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::super::even_light::luminance;
use super::super::sky::Sky;
use super::super::{PointLight, Scene};
use super::{ABOVE, Rays, SCALE, diffuse, frame, uniform};
use crate::math::random;

/// Lights with the sums of their powers over π up to each.
pub(super) struct Starts<'a> {
    list: Vec<(Light<'a>, f64)>,
    /// Of the sky by direction.
    sky: Option<SkyCells>,
}

#[derive(Clone, Copy)]
enum Light<'a> {
    /// Corners, in the frame of [`Rays`].
    Triangle([DVec3; 3]),
    Point(DVec3, &'a PointLight),
    /// The direction towards it.
    Sun(DVec3),
    Sky,
}

/// Radius of a sphere about the scene, in the frame of [`Rays`].
const AROUND: f64 = 1.75 * SCALE;

/// Directions that are tried within a beam, at most: a spot 1° wide takes some 50,000.
const TRIES: usize = 100_000;

impl<'a> Starts<'a> {
    /// None where nothing shines.
    pub fn of(scene: &'a Scene) -> Option<Self> {
        let (origin, unit) = frame(scene);
        let within = |p: DVec3| (p - origin) / unit;
        let (mut list, mut sum) = (Vec::new(), 0.0);
        let mut add = |light, power: f64| {
            if power > 0.0 {
                sum += power;
                list.push((light, sum));
            }
        };
        for triangle in &scene.triangles {
            let corners = scene.corners(triangle).map(within);
            let [a, b, c] = corners;
            let area = 0.5 * (b - a).cross(c - a).length();
            let emitted = luminance(scene.materials[triangle.material as usize].ke);
            add(Light::Triangle(corners), area * emitted);
        }
        for light in &scene.lights.points {
            let power = light.solid_angle() / PI * luminance(light.intensity) / (unit * unit);
            add(Light::Point(within(light.position), light), power);
        }
        for sun in &scene.lights.suns {
            let power = luminance(sun.irradiance) * AROUND * AROUND;
            add(Light::Sun(sun.towards), power);
        }
        let sky = scene.lights.sky.as_ref().map(SkyCells::new);
        if let Some(cells) = &sky {
            add(Light::Sky, cells.total() * AROUND * AROUND);
        }
        (!list.is_empty()).then_some(Self { list, sky })
    }

    /// A place on the lights by power, and a direction.
    pub fn ray(&self, rays: &Rays, state: &mut u64) -> (DVec3, DVec3) {
        let total = self.list.last().map_or(0.0, |last| last.1);
        let at = random::unit(state) * total;
        let index = self.list.partition_point(|(_, sum)| *sum <= at);
        match self.list[index.min(self.list.len() - 1)].0 {
            Light::Triangle([a, b, c]) => {
                let (s, t) = (random::unit(state), random::unit(state));
                let (s, t) = if s + t > 1.0 {
                    (1.0 - s, 1.0 - t)
                } else {
                    (s, t)
                };
                let normal = (b - a).cross(c - a).normalize_or_zero();
                let from = a + s * (b - a) + t * (c - a) + ABOVE * normal;
                (from, diffuse(normal, state))
            }
            Light::Point(from, light) => (rays.inside(from), in_beam(light, state)),
            Light::Sun(towards) => from_afar(towards, state),
            Light::Sky => {
                let towards = self
                    .sky
                    .as_ref()
                    .map_or(DVec3::Y, |sky| sky.direction(state));
                from_afar(towards, state)
            }
        }
    }
}

/// A direction by a light's shares.
fn in_beam(light: &PointLight, state: &mut u64) -> DVec3 {
    let Some(beam) = &light.beam else {
        return uniform(state);
    };
    let highest = f64::from(beam.web.highest());
    let mut tries = (0..TRIES).map(|_| (uniform(state), random::unit(state)));
    let found = tries.find(|(direction, share)| share * highest < beam.share(*direction));
    found.map_or(beam.axis, |(direction, _)| direction)
}

/// A ray into the scene that comes from a direction.
fn from_afar(towards: DVec3, state: &mut u64) -> (DVec3, DVec3) {
    let (x, y) = towards.any_orthonormal_pair();
    let (sin, cos) = (TAU * random::unit(state)).sin_cos();
    let radius = AROUND * random::unit(state).sqrt();
    (AROUND * towards + radius * (cos * x + sin * y), -towards)
}

/// A sky's radiance times the solid angle by cells of direction, summed up to each.
struct SkyCells {
    /// Unit vectors through the middles.
    cells: Vec<(DVec3, f64)>,
}

const HEIGHTS: u32 = 32;
const AZIMUTHS: u32 = 64;

impl SkyCells {
    fn new(sky: &Sky) -> Self {
        let east = sky.north.cross(sky.up);
        let solid_angle = 4.0 * PI / f64::from(HEIGHTS * AZIMUTHS);
        let mut sum = 0.0;
        let cell = |i: u32| {
            let height = 1.0 - 2.0 * (f64::from(i / AZIMUTHS) + 0.5) / f64::from(HEIGHTS);
            let (sin, cos) = (TAU * f64::from(i % AZIMUTHS) / f64::from(AZIMUTHS)).sin_cos();
            let flat = (1.0 - height * height).sqrt();
            let towards = height * sky.up + flat * (cos * sky.north + sin * east);
            let radiance = sky.radiance(towards).to_array().map(|c| c as f32);
            sum += luminance(radiance) * solid_angle;
            (towards, sum)
        };
        Self {
            cells: (0..HEIGHTS * AZIMUTHS).map(cell).collect(),
        }
    }

    fn total(&self) -> f64 {
        self.cells.last().map_or(0.0, |last| last.1)
    }

    fn direction(&self, state: &mut u64) -> DVec3 {
        let at = random::unit(state) * self.total();
        let index = self.cells.partition_point(|(_, sum)| *sum <= at);
        self.cells[index.min(self.cells.len() - 1)].0
    }
}
