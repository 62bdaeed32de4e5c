//! Where shadows end: triangles that see part of what light comes from.

use glam::DVec3;
use obvhs::ray::Ray;

use super::cutting::Cutting;
use super::surroundings::{Facet, Surroundings};
use super::{Scene, area};
use crate::scene::even_light::{EvenLight, Surface, far_lights, luminance};

/// Places on the lights, evenly by power, and on all surfaces, evenly by what they reflect.
const PLACES: usize = 48;

/// Of so many places one is asked for first; the others where a triangle's corners do not all see
/// the same of those.
const FEW: usize = 4;

/// How far from a triangle's corners it is looked from, as a share of the way to its middle.
const INSIDE: f64 = 0.02;

/// What light comes from, once in full and once as if all surfaces were lit evenly.
pub(super) struct Shadows<'a> {
    input: &'a Scene,
    surroundings: &'a Surroundings,
    light: EvenLight,
}

/// The least and the greatest share of the light that some points see.
struct Seen {
    least: f64,
    most: f64,
    /// Whether no place is seen by one point and hidden from another.
    alike: bool,
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
        let points = [a, b, c, middle].map(|corner| corner + INSIDE * (middle - corner));
        let lights = points.map(|from| self.light.at(from, normal));
        let most = lights.into_iter().fold(0.0, f64::max);
        let few = self.seen(points, normal, FEW);
        let seen = match few.alike {
            true => few,
            false => self.seen(points, normal, 1),
        };
        // Of a light's share that rises by so much over a triangle, a straight line misses about
        // its square over four: all of it rises along an edge, and a small part nearly straight.
        let share = (seen.most - seen.least).max(0.0);
        // And of smooth light what it misses in the middle.
        let [a, b, c, middle] = lights;
        let bend = seen.most * (middle - (a + b + c) / 3.0).abs();
        let error = (0.25 * share * share * most + bend) / self.light.mean;
        error * error * area(corners) / self.light.area
    }

    /// What points see of every `step`th place.
    fn seen(&self, points: [DVec3; 4], normal: DVec3, step: usize) -> Seen {
        let (mut all, mut seen, mut alike) = ([0.0; 4], [0.0; 4], true);
        for place in self.light.places.iter().step_by(step) {
            let (mut some, mut none) = (false, false);
            for (k, from) in points.into_iter().enumerate() {
                let light = place.irradiance(from, normal);
                if light > 0.0 {
                    let open = !self.blocked(from, normal, place.position);
                    all[k] += light;
                    seen[k] += if open { light } else { 0.0 };
                    (some, none) = (some || open, none || !open);
                }
            }
            alike &= !(some && none);
        }
        let lit = (seen.into_iter().zip(all)).filter(|&(_, all)| all > 0.0);
        let shares = lit.map(|(seen, all)| seen / all);
        Seen {
            least: shares.clone().fold(1.0, f64::min),
            most: shares.fold(0.0, f64::max),
            alike,
        }
    }

    /// Whether a triangle of the input stands between a place on a surface and another. One whose
    /// plane holds either does not.
    fn blocked(&self, from: DVec3, normal: DVec3, to: DVec3) -> bool {
        let (flat, way) = (self.surroundings.flat, to - from);
        let start = from + 2.0 * flat * normal;
        let ray = Ray::new(start.as_vec3a(), way.as_vec3a(), 0.0, 1.0);
        !self.surroundings.bvh.ray_traverse_miss(ray, |_, place| {
            let t = self.surroundings.bvh.primitive_indices[place] as usize;
            match stands_between(&self.surroundings.facets[t], from, to, flat) {
                true => 0.0,
                false => f32::INFINITY,
            }
        })
    }
}

fn stands_between(facet: &Facet, from: DVec3, to: DVec3, flat: f64) -> bool {
    let [a, b, c] = facet.corners;
    let (start, end) = ((from - a).dot(facet.normal), (to - a).dot(facet.normal));
    if start.min(end) > -flat || start.max(end) < flat {
        return false;
    }
    let way = to - from;
    let [a, b, c] = [a - from, b - from, c - from];
    let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|over| way.dot(over));
    let all = |is: fn(&f64) -> bool| volumes.iter().all(is);
    all(|&v| v >= 0.0) || all(|&v| v <= 0.0)
}
