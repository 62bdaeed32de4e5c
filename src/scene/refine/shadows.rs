//! Where shadows end: triangles that see part of what light comes from.

use glam::DVec3;
use obvhs::ray::Ray;

use super::cutting::Cutting;
use super::surroundings::Surroundings;
use super::{Scene, area, at_place};
use crate::math::form_factor::spread_in_triangle;
use crate::scene::maps::LUMINANCE;

/// Places on the lights, evenly by power, and on all surfaces, evenly by what they reflect.
const PLACES: usize = 48;

/// How far from a triangle's corners it is looked from, as a share of the way to its middle.
const INSIDE: f64 = 0.02;

/// A place that light comes from.
struct Place {
    position: DVec3,
    /// None of a point light.
    normal: Option<DVec3>,
    /// Power, and the area that it stands for; of a point light π times the intensity.
    power: f64,
    area: f64,
}

/// What light comes from, once in full and once as if all surfaces were lit evenly.
pub(super) struct Shadows<'a> {
    input: &'a Scene,
    surroundings: &'a Surroundings,
    places: Vec<Place>,
    /// Irradiance as it may be in the mean.
    mean: f64,
    area: f64,
}

impl<'a> Shadows<'a> {
    /// None where nothing emits.
    pub fn new(input: &'a Scene, surroundings: &'a Surroundings) -> Option<Self> {
        let material = |t: usize| &input.materials[input.triangles[t].material as usize];
        let areas: Vec<f64> = (input.triangles.iter())
            .map(|t| area(input.corners(t)))
            .collect();
        let total: f64 = areas.iter().sum();
        let emitted: Vec<f64> = (areas.iter().enumerate())
            .map(|(t, area)| std::f64::consts::PI * area * f64::from(luminance(material(t).ke)))
            .collect();
        let reflecting: Vec<f64> = (areas.iter().enumerate())
            .map(|(t, area)| area * f64::from(luminance(material(t).kd)))
            .collect();
        let points = input.point_lights.iter().map(|light| Place {
            position: light.position,
            normal: None,
            power: std::f64::consts::PI * f64::from(luminance(light.intensity)),
            area: 0.0,
        });
        let mut places: Vec<Place> = points.filter(|place| place.power > 0.0).collect();
        let of_points: f64 = places.iter().map(|place| 4.0 * place.power).sum();
        let power = of_points + emitted.iter().sum::<f64>();
        if power == 0.0 {
            return None;
        }
        let share = reflecting.iter().sum::<f64>() / total;
        let mean = power / (total * (1.0 - share).clamp(0.05, 1.0));
        let reflected: Vec<f64> = reflecting.iter().map(|of| of * mean).collect();
        places.extend(spread(input, &areas, &emitted));
        places.extend(spread(input, &areas, &reflected));
        Some(Self {
            input,
            surroundings,
            places,
            mean,
            area: total,
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
            for place in &self.places {
                let light = irradiance(from, normal, place);
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
        let error = (0.25 * share * share * most + bend) / self.mean;
        error * error * area(corners) / self.area
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

fn luminance(colour: [f32; 3]) -> f32 {
    (0..3).map(|c| LUMINANCE[c] * colour[c]).sum()
}

/// Places on triangles, evenly by the power of these, `[triangle]`.
fn spread(input: &Scene, areas: &[f64], powers: &[f64]) -> Vec<Place> {
    let all: f64 = powers.iter().sum();
    let mut places = Vec::with_capacity(PLACES);
    let mut before = 0.0;
    for (t, power) in powers.iter().enumerate() {
        before += power;
        while places.len() < PLACES && (places.len() as f64 + 0.5) * all < before * PLACES as f64 {
            let at = spread_in_triangle(places.len());
            let corners @ [a, b, c] = input.corners(&input.triangles[t]);
            let share = all / PLACES as f64;
            places.push(Place {
                position: at_place(corners, at),
                normal: Some((b - a).cross(c - a).normalize_or_zero()),
                power: share,
                area: areas[t] * share / power,
            });
        }
    }
    places
}

/// Of a place without what stands before it.
fn irradiance(from: DVec3, normal: DVec3, place: &Place) -> f64 {
    let way = place.position - from;
    let square = way.length_squared();
    let height = way.dot(normal).max(0.0);
    if square == 0.0 {
        return 0.0;
    }
    match place.normal {
        Some(of_place) => {
            let facing = (-way.dot(of_place)).max(0.0);
            // As of a disc of its area, seen along its axis.
            place.power * facing * height / (square * (std::f64::consts::PI * square + place.area))
        }
        None => place.power * height / (std::f64::consts::PI * square * square.sqrt()),
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
