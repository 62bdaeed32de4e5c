//! Light as it may be before anything is solved: a few places on the lights, evenly by power, and a
//! few on all surfaces as if they were lit evenly.

use std::f64::consts::PI;

use glam::DVec3;

use crate::math::form_factor::spread_in_triangle;
use crate::scene::Lights;
use crate::scene::maps::LUMINANCE;

/// A triangle that emits and reflects, luminances.
pub(crate) struct Surface {
    pub corners: [DVec3; 3],
    /// Radiosity.
    pub emitted: f64,
    pub reflectance: f64,
}

/// A place that light comes from.
pub(crate) struct LightPlace {
    pub position: DVec3,
    /// None of a point light.
    normal: Option<DVec3>,
    /// Power, and the area that it stands for; of a point light π times the intensity.
    power: f64,
    area: f64,
}

/// What light comes from.
pub(crate) struct EvenLight {
    pub places: Vec<LightPlace>,
    /// Irradiance as it may be in the mean.
    pub mean: f64,
    /// Of all surfaces.
    pub area: f64,
}

impl EvenLight {
    /// By so many places on the emitters, and as many on all surfaces; point lights by position and
    /// intensity; far lights as [`far_lights`] gives them. None where nothing emits.
    pub fn new(
        surfaces: &[Surface],
        points: impl Iterator<Item = (DVec3, f64)>,
        far: &[(DVec3, f64)],
        count: usize,
    ) -> Option<Self> {
        let areas: Vec<f64> = surfaces.iter().map(|s| area(s.corners)).collect();
        let total: f64 = areas.iter().sum();
        let by_area = |of: fn(&Surface) -> f64| -> Vec<f64> {
            let surfaces = surfaces.iter().zip(&areas);
            surfaces.map(|(surface, area)| area * of(surface)).collect()
        };
        let emitted = by_area(|s| s.emitted);
        let reflecting = by_area(|s| s.reflectance);
        let points = points.map(|(position, intensity)| LightPlace {
            position,
            normal: None,
            power: PI * intensity,
            area: 0.0,
        });
        let mut places: Vec<LightPlace> = points.filter(|place| place.power > 0.0).collect();
        let of_points: f64 = places.iter().map(|place| 4.0 * place.power).sum();
        // A convex body's shadow is a quarter of its area in the mean.
        let of_far: f64 = far
            .iter()
            .map(|(_, irradiance)| 0.25 * total * irradiance)
            .sum();
        let corners = || surfaces.iter().flat_map(|surface| surface.corners);
        let low = corners().fold(DVec3::INFINITY, DVec3::min);
        let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let distance = FAR * low.distance(high);
        places.extend(far.iter().map(|(towards, irradiance)| LightPlace {
            position: low.midpoint(high) + distance * *towards,
            normal: None,
            power: PI * irradiance * distance * distance,
            area: 0.0,
        }));
        let power = of_points + of_far + emitted.iter().sum::<f64>();
        if power == 0.0 {
            return None;
        }
        let share = reflecting.iter().sum::<f64>() / total;
        let mean = power / (total * (1.0 - share).clamp(0.05, 1.0));
        let reflected: Vec<f64> = reflecting.iter().map(|of| of * mean).collect();
        places.extend(spread(surfaces, &areas, &emitted, count));
        places.extend(spread(surfaces, &areas, &reflected, count));
        Some(Self {
            places,
            mean,
            area: total,
        })
    }
}

impl EvenLight {
    /// Irradiance at a place without what stands before it.
    pub fn at(&self, at: DVec3, normal: DVec3) -> f64 {
        let places = self.places.iter();
        places.map(|place| place.irradiance(at, normal)).sum()
    }
}

impl LightPlace {
    /// Irradiance at a place without what stands before it.
    pub fn irradiance(&self, at: DVec3, normal: DVec3) -> f64 {
        let way = self.position - at;
        let square = way.length_squared();
        let height = way.dot(normal).max(0.0);
        if square == 0.0 {
            return 0.0;
        }
        match self.normal {
            Some(own) => {
                let facing = (-way.dot(own)).max(0.0);
                // As of a disc of its area, seen along its axis.
                self.power * facing * height / (square * (PI * square + self.area))
            }
            None => self.power * height / (PI * square * square.sqrt()),
        }
    }
}

/// Distance of what stands for far lights, in sizes of the scene.
const FAR: f64 = 1e4;

/// Directions of the whole sphere by which a sky is foreseen.
const SKY_DIRECTIONS: usize = 32;

/// Unit direction and irradiance, as luminance, of the suns and of directions of the sky.
pub(crate) fn far_lights(lights: &Lights) -> Vec<(DVec3, f64)> {
    let suns = lights.suns.iter();
    let mut far: Vec<(DVec3, f64)> = suns
        .map(|sun| (sun.towards, luminance(sun.irradiance)))
        .collect();
    if let Some(sky) = &lights.sky {
        let share = 4.0 * PI / SKY_DIRECTIONS as f64;
        for i in 0..SKY_DIRECTIONS {
            // Even on the sphere: Fibonacci's spiral.
            let z = 1.0 - (2.0 * i as f64 + 1.0) / SKY_DIRECTIONS as f64;
            let angle = 2.399_963_23 * i as f64;
            let around = (1.0 - z * z).sqrt();
            let towards = DVec3::new(around * angle.cos(), z, around * angle.sin());
            far.push((
                towards,
                share * luminance(sky.radiance(towards).as_vec3().to_array()),
            ));
        }
    }
    far.retain(|(_, irradiance)| *irradiance > 0.0);
    far
}

pub(crate) fn luminance(colour: [f32; 3]) -> f64 {
    let of = |c: usize| LUMINANCE[c] * colour[c];
    f64::from(of(0) + of(1) + of(2))
}

/// Places on triangles, evenly by the power of these, `[triangle]`.
fn spread(surfaces: &[Surface], areas: &[f64], powers: &[f64], count: usize) -> Vec<LightPlace> {
    let all: f64 = powers.iter().sum();
    let mut places = Vec::with_capacity(count);
    let mut before = 0.0;
    for (t, power) in powers.iter().enumerate() {
        before += power;
        while places.len() < count && (places.len() as f64 + 0.5) * all < before * count as f64 {
            let [v, w] = spread_in_triangle(places.len());
            let [a, b, c] = surfaces[t].corners;
            let share = all / count as f64;
            places.push(LightPlace {
                position: a + v * (b - a) + w * (c - a),
                normal: Some((b - a).cross(c - a).normalize_or_zero()),
                power: share,
                area: areas[t] * share / power,
            });
        }
    }
    places
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}
