//! Exposes by what surfaces reflect of their light.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::picture::exposure_by_area;
use crate::render::tone;
use crate::scene::Scene;

/// The surfaces of a scene.
pub struct Meter {
    /// Reflectance and area, square scene units, `[triangle]`.
    surfaces: Vec<(Vec3, f64)>,
}

impl Meter {
    /// Means of textures over triangles take longer than what a new light needs.
    pub fn new(scene: &Scene) -> Self {
        let surfaces = scene.triangles.par_iter().map(|triangle| {
            let material = &scene.materials[triangle.material as usize];
            let map = material.map_kd.as_ref();
            let of_map = map.map_or([1.0; 3], |map| map.about_over_triangle(&triangle.uv));
            let [a, b, c] = scene.corners(triangle);
            let area = DVec3::length((b - a).cross(c - a)) / 2.0;
            (Vec3::from(material.kd) * Vec3::from(of_map), area)
        });
        Self {
            surfaces: surfaces.collect(),
        }
    }

    /// The exposure, stops, for what does not emit: in this light `[triangle]` and `ambient`,
    /// W·m⁻², of the scene with its lights as they are now. It does not depend on the view: a
    /// window that orbits does not flicker.
    pub fn exposure(&self, scene: &Scene, irradiance: &[Vec3], ambient: Vec3) -> f32 {
        let lit = (self.surfaces.iter().zip(&scene.triangles).zip(irradiance))
            .filter(|((_, t), _)| !scene.materials[t.material as usize].emits())
            .map(|(((reflectance, area), _), irradiance)| {
                let radiance = reflectance * (*irradiance + ambient) / std::f32::consts::PI;
                (tone::luminance(radiance.to_array()), *area)
            });
        exposure_by_area(lit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Material, Triangle};

    /// Ten triangles of one area: the exposure is for the ninth of them by brightness.
    #[test]
    fn exposure_is_for_the_brightest_tenth_by_area() {
        let scene = Scene {
            vertices: vec![DVec3::ZERO, DVec3::X, DVec3::Y],
            triangles: vec![
                Triangle {
                    vertices: [0, 1, 2],
                    uv: [[0.0; 2]; 3],
                    emission_uv: None,
                    light_uv: None,
                    material: 0,
                };
                10
            ],
            materials: vec![Material {
                kd: [1.0; 3],
                ..Material::default()
            }],
            ..Scene::default()
        };
        let light: Vec<_> = (1..=10)
            .map(|i| Vec3::splat(i as f32 * std::f32::consts::PI))
            .collect();
        let stops = Meter::new(&scene).exposure(&scene, &light, Vec3::ZERO);
        assert!((stops.exp2() * 9.0 - 0.6).abs() < 1e-5, "{stops}");
    }
}
