//! Where textured emission changes: triangles that emit unevenly.

use super::cutting::Cutting;
use super::{Scene, area};
use crate::scene::even_light::luminance;

/// Emission by textures.
pub(super) struct Glow<'a> {
    input: &'a Scene,
    /// Power that the scene emits over π, luminance.
    power: f64,
}

impl<'a> Glow<'a> {
    /// None where no texture emits.
    pub fn new(input: &'a Scene) -> Option<Self> {
        if input.materials.iter().all(|m| m.map_ke.is_none()) {
            return None;
        }
        let of = |t: &super::Triangle| {
            let material = &input.materials[t.material as usize];
            area(input.corners(t)) * luminance(material.emitted_over(&t.uv_of_emission()))
        };
        let power: f64 = input.triangles.iter().map(of).sum();
        (power > 0.0).then_some(Self { input, power })
    }

    /// Power that the four quarters of a triangle emit more or less than its mean, as a share of
    /// the scene's.
    pub fn error(&self, cut: &Cutting, t: usize) -> f64 {
        let triangle = &cut.scene.triangles[t];
        let material = &self.input.materials[triangle.material as usize];
        let relief = material.map_height.is_some() || material.map_normal.is_some();
        // Relief stays on its texels.
        if material.map_ke.is_none() || relief {
            return 0.0;
        }
        let [a, b, c] = triangle.uv_of_emission();
        let middle = |p: [f32; 2], q: [f32; 2]| [0, 1].map(|i| 0.5 * (p[i] + q[i]));
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        let quarters = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]];
        let emitted = quarters.map(|uv| luminance(material.emitted_over(&uv)));
        let mean = emitted.iter().sum::<f64>() / 4.0;
        let off: f64 = emitted.iter().map(|of| (of - mean).abs()).sum();
        area(cut.scene.corners(triangle)) * off / 4.0 / self.power
    }
}
