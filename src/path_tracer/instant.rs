//! Instant radiosity (Keller 1997): light paths leave virtual point lights where they meet the
//! scene, and irradiance is the sum of the lights that a place sees. On the CPU, with the path
//! tracer's own geometry and rays; a peer to measure against.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::PathTracer;
use super::geometry::ABOVE;
use super::lights::Start;
use super::sampling::{Random, cosine_direction, radical_inverse, sphere_direction};

/// Bases of the first random numbers of a path. Later numbers are pseudo-random, since high bases
/// need many paths to become even.
const BASES: [u32; 8] = [2, 3, 5, 7, 11, 13, 17, 19];

/// Highest probability of continuing a path: in a closed white room it would never end otherwise.
const MOST_CHANCE: f64 = 0.98;

/// A virtual point light, internal units.
#[derive(Debug, Clone, Copy)]
struct Light {
    place: DVec3,
    /// Unit normal of its surface; None for a point light, which emits in all directions.
    normal: Option<DVec3>,
    /// Radiant flux, RGB; of a point light radiant intensity.
    power: DVec3,
}

/// Virtual point lights of a scene: of its surfaces and point lights, which it takes to shine
/// evenly. Suns and skies are left out.
pub struct VirtualLights<'a> {
    tracer: &'a PathTracer<'a>,
    lights: Vec<Light>,
    /// Area of surface that a light represents, internal units.
    share: f64,
}

/// Random numbers of one path, evenly spread over the paths in its first dimensions (Halton).
struct Numbers {
    path: u64,
    used: usize,
    random: Random,
}

impl Numbers {
    fn unit(&mut self) -> f64 {
        let base = BASES.get(self.used);
        self.used += 1;
        match base {
            Some(&base) => radical_inverse(base, self.path + 1),
            None => self.random.unit(),
        }
    }

    fn square(&mut self) -> DVec2 {
        DVec2::new(self.unit(), self.unit())
    }
}

impl<'a> VirtualLights<'a> {
    /// Traces `paths` light paths. Each leaves a virtual light at its start and at each reflection.
    /// It continues with the probability of the largest reflectance there, so that lights differ
    /// little in power.
    pub fn new(tracer: &'a PathTracer<'a>, paths: u32, seed: u64) -> Self {
        let count = f64::from(paths.max(1));
        let walks: Vec<Vec<Light>> = (0..paths.max(1))
            .into_par_iter()
            .map(|path| {
                let mut numbers = Numbers {
                    path: u64::from(path),
                    used: 0,
                    random: Random::new(seed, u64::MAX - 1, u64::from(path)),
                };
                tracer.walk(count, &mut numbers)
            })
            .collect();
        let mut lights: Vec<Light> = walks.into_iter().flatten().collect();
        lights.extend(tracer.lights.points().map(|(place, intensity)| Light {
            place,
            normal: None,
            power: intensity,
        }));
        let area = tracer.geometry.area();
        Self {
            tracer,
            share: area / lights.len().max(1) as f64,
            lights,
        }
    }

    /// Number of virtual lights.
    pub fn count(&self) -> usize {
        self.lights.len()
    }

    /// Irradiance at a place (scene units) about a unit normal, W·m⁻², RGB.
    ///
    /// A light on a surface counts as a small disc of the area a that it represents, Φ cosθ cosθ' /
    /// (π d² + a). The formula of a point is unbounded near a corner; the area of the disc goes to
    /// 0 with more lights.
    pub fn irradiance(&self, point: DVec3, normal: DVec3) -> Vec3 {
        let place = self.tracer.geometry.inside(point);
        let above = place + ABOVE * normal;
        let mut sum = DVec3::ZERO;
        for light in &self.lights {
            let to = light.place - place;
            let squared = to.length_squared();
            let direction = to.normalize_or_zero();
            let here = normal.dot(direction);
            let (there, end) = match light.normal {
                Some(n) => (-n.dot(direction), light.place + ABOVE * n),
                None => (1.0, light.place),
            };
            if here <= 0.0 || there <= 0.0 || !self.tracer.geometry.sees(above, end) {
                continue;
            }
            let spread = match light.normal {
                Some(_) => PI * squared + self.share,
                None => squared,
            };
            sum += light.power * (here * there / spread);
        }
        sum.as_vec3()
    }
}

impl PathTracer<'_> {
    /// The lights that one of `count` light paths leaves.
    fn walk(&self, count: f64, numbers: &mut Numbers) -> Vec<Light> {
        let mut lights = Vec::new();
        let (choice, at) = (numbers.unit(), numbers.square());
        let Some(Start {
            mut place,
            normal,
            power,
        }) = self.lights.start(choice, at)
        else {
            return lights;
        };
        let mut power = power / count;
        let mut direction = match normal {
            Some(normal) => {
                lights.push(Light {
                    place,
                    normal: Some(normal),
                    power,
                });
                place += ABOVE * normal;
                cosine_direction(normal, numbers.square())
            }
            None => sphere_direction(numbers.square()),
        };
        loop {
            let Some(hit) = self.geometry.hit(place, direction).filter(|hit| hit.front) else {
                return lights;
            };
            let reflectance = self.reflectance(&hit);
            let chance = reflectance.max_element().min(MOST_CHANCE);
            if chance <= 0.0 || numbers.unit() >= chance {
                return lights;
            }
            power *= reflectance / chance;
            lights.push(Light {
                place: hit.place,
                normal: Some(hit.normal),
                power,
            });
            place = hit.place + ABOVE * hit.normal;
            direction = cosine_direction(hit.normal, numbers.square());
        }
    }
}
