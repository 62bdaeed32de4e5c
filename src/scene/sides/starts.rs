//! Where paths begin: the lights of a scene, by power.

use glam::DVec3;

use super::super::Scene;
use super::super::even_light::luminance;
use super::super::geometry::{ABOVE, Geometry};
use crate::math::sampling::{Choice, Random, cosine_direction, on_triangle, sphere_direction};

/// Lights by power.
pub(super) struct Starts {
    list: Vec<Light>,
    choice: Choice,
}

/// In internal units.
#[derive(Clone, Copy)]
enum Light {
    Triangle([DVec3; 3]),
    Point(DVec3),
}

impl Starts {
    pub fn of(scene: &Scene, geometry: &Geometry) -> Self {
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
            let emitted = luminance(scene.materials[triangle.material as usize].ke);
            add(Light::Triangle(corners), area * emitted);
        }
        for light in &scene.lights.points {
            let power = 4.0 * luminance(light.intensity) / geometry.unit.powi(2);
            add(Light::Point(geometry.inside(light.position)), power);
        }
        let choice = Choice::new(powers.into_iter());
        Self { list, choice }
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
            Light::Point(from) => (from, sphere_direction(random.square())),
        })
    }
}
