//! One path.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, Vec3};

use super::PathTracer;
use super::geometry::{ABOVE, Hit};
use super::sampling::{Random, cosine_direction};
use crate::picture::Light;

/// Bounces before Russian roulette: most of the light has been found by then.
const SURE_BOUNCES: u32 = 3;

/// Highest probability of continuing after that: a path in a closed white room would never end
/// otherwise.
const MOST_CHANCE: f64 = 0.98;

impl PathTracer<'_> {
    /// One sample of the radiance that leaves a hit towards the eye.
    pub(super) fn radiance(&self, hit: &Hit, light: Light, random: &mut Random) -> DVec3 {
        if !hit.front {
            return DVec3::ZERO;
        }
        let emitted = match light {
            Light::Global | Light::Direct => self.lights.emitted(hit),
            Light::Indirect => DVec3::ZERO,
        };
        let reflectance = self.reflectance(hit);
        if reflectance == DVec3::ZERO {
            return emitted;
        }
        emitted + reflectance / PI * self.gathered(hit.place, hit.normal, light, random)
    }

    /// One sample of the irradiance at a place, internal units.
    pub(super) fn gathered(
        &self,
        place: DVec3,
        normal: DVec3,
        light: Light,
        random: &mut Random,
    ) -> DVec3 {
        let (mut place, mut normal) = (place, normal);
        let mut sum = DVec3::ZERO;
        // Weight of irradiance here at the start of the path.
        let mut carried = DVec3::ONE;
        for bounce in 0_u32.. {
            let counts = match light {
                Light::Global => true,
                Light::Direct => bounce == 0,
                Light::Indirect => bounce > 0,
            };
            // Sample the lights
            if counts {
                let choices = (random.unit(), random.unit());
                let at = random.square();
                sum += carried
                    * self
                        .lights
                        .sample(&self.geometry, place, normal, choices, at);
            }
            // Continue in a direction of density cos θ / π
            let direction = cosine_direction(normal, random.square());
            let Some(hit) = self.geometry.hit(place + ABOVE * normal, direction) else {
                // The sky counts as indirect light.
                if light != Light::Direct {
                    sum += carried * PI * self.lights.sky(direction);
                }
                break;
            };
            if !hit.front {
                break;
            }
            if counts {
                let cosine = normal.dot(direction);
                let weight = self.lights.weight_when_met(&hit, direction, cosine);
                sum += carried * self.lights.emitted(&hit) * (PI * weight);
            }
            carried *= self.reflectance(&hit);
            if light == Light::Direct || carried == DVec3::ZERO {
                break;
            }
            // End the path by roulette
            if bounce >= SURE_BOUNCES {
                let chance = carried.max_element().min(MOST_CHANCE);
                if random.unit() >= chance {
                    break;
                }
                carried /= chance;
            }
            (place, normal) = (hit.place, hit.normal);
        }
        sum
    }

    /// ρ at a hit, textures looked up bilinearly.
    pub(super) fn reflectance(&self, hit: &Hit) -> DVec3 {
        let triangle = &self.scene.triangles[hit.triangle];
        let material = &self.scene.materials[triangle.material as usize];
        let plain = Vec3::from_array(material.kd).as_dvec3();
        let Some(texture) = &material.map_kd else {
            return plain;
        };
        let uv = hit.interpolate(
            triangle
                .uv
                .map(|[u, v]| DVec2::new(f64::from(u), f64::from(v))),
        );
        plain * Vec3::from_array(texture.bilinear(uv.x, uv.y)).as_dvec3()
    }
}
