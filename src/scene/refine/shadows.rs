//! Where shadows end: triangles that see part of what light comes from.

use glam::DVec3;
use obvhs::ray::Ray;

use super::cutting::Cutting;
use super::surroundings::Surroundings;
use super::{Scene, area};
use crate::scene::even_light::{EvenLight, Surface, far_lights, luminance};

/// Places on the lights, evenly by power, and on all surfaces, evenly by what they reflect.
const PLACES: usize = 48;

/// How far from a triangle's corners it is looked from, as a share of the way to its middle.
const INSIDE: f64 = 0.02;

/// What light comes from, once in full and once as if all surfaces were lit evenly.
pub(super) struct Shadows<'a> {
    input: &'a Scene,
    surroundings: &'a Surroundings,
    light: EvenLight,
}

impl<'a> Shadows<'a> {
    /// None where nothing emits.
    pub fn new(input: &'a Scene, surroundings: &'a Surroundings) -> Option<Self> {
        let material = |t: usize| &input.materials[input.triangles[t].material as usize];
        let surface = |t: usize| Surface {
            corners: input.corners(&input.triangles[t]),
            emitted: std::f64::consts::PI
                * luminance(material(t).emitted_over(&input.triangles[t].uv_of_emission())),
            reflectance: luminance(material(t).kd),
        };
        let surfaces: Vec<Surface> = (0..input.triangles.len()).map(surface).collect();
        let points =
            (input.lights.points.iter()).map(|light| (light.position, luminance(light.intensity)));
        Some(Self {
            input,
            surroundings,
            light: EvenLight::new(&surfaces, points, &far_lights(&input.lights), PLACES)?,
        })
    }

    /// What light between a triangle's corners is off, for a shadow that ends there or because it
    /// falls off with distance: squared, in means of the scene, times the share of its area.
    pub fn error(&self, cut: &Cutting, t: usize) -> f64 {
        let triangle = &cut.scene.triangles[t];
        let material = &self.input.materials[triangle.material as usize];
        // Relief stays on its texels.
        if material.map_height.is_some() || material.map_normal.is_some() {
            return 0.0;
        }
        let corners @ [a, b, c] = cut.scene.corners(triangle);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let middle = (a + b + c) / 3.0;
        let mut most = 0.0_f64;
        let (mut low, mut high) = (1.0_f64, 0.0_f64);
        let mut lights = [0.0; 4];
        for (corner, light) in [a, b, c, middle].into_iter().zip(&mut lights) {
            let from = corner + INSIDE * (middle - corner);
            let (mut all, mut seen) = (0.0, 0.0);
            for place in &self.light.places {
                let light = place.irradiance(from, normal);
                if light > 0.0 {
                    all += light;
                    seen += match self.blocked(from, normal, place.position) {
                        true => 0.0,
                        false => light,
                    };
                }
            }
            if all > 0.0 {
                most = most.max(all);
                (low, high) = (low.min(seen / all), high.max(seen / all));
            }
            *light = all;
        }
        // Of a light's share that rises by so much over a triangle, a straight line misses about
        // its square over four: all of it rises along an edge, and a small part nearly straight.
        let share = (high - low).max(0.0);
        // And of smooth light what it misses in the middle.
        let [a, b, c, middle] = lights;
        let bend = high * (middle - (a + b + c) / 3.0).abs();
        let error = (0.25 * share * share * most + bend) / self.light.mean;
        error * error * area(corners) / self.light.area
    }

    /// Whether a triangle of the input stands between a place on a surface and another. One whose
    /// plane holds either does not.
    fn blocked(&self, from: DVec3, normal: DVec3, to: DVec3) -> bool {
        let (flat, way) = (self.surroundings.flat, to - from);
        let start = from + 2.0 * flat * normal;
        let ray = Ray::new(start.as_vec3a(), way.as_vec3a(), 0.0, 1.0);
        !self.surroundings.bvh.ray_traverse_miss(ray, |_, place| {
            let t = self.surroundings.bvh.primitive_indices[place] as usize;
            let corners = self.input.corners(&self.input.triangles[t]);
            match stands_between(corners, from, to, flat) {
                true => 0.0,
                false => f32::INFINITY,
            }
        })
    }
}

fn stands_between([a, b, c]: [DVec3; 3], from: DVec3, to: DVec3, flat: f64) -> bool {
    let normal = (b - a).cross(c - a).normalize_or_zero();
    let (start, end) = ((from - a).dot(normal), (to - a).dot(normal));
    if start.min(end) > -flat || start.max(end) < flat {
        return false;
    }
    let way = to - from;
    let [a, b, c] = [a - from, b - from, c - from];
    let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|over| way.dot(over));
    let all = |is: fn(&f64) -> bool| volumes.iter().all(is);
    all(|&v| v >= 0.0) || all(|&v| v <= 0.0)
}
