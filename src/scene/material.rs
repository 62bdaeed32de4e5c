//! Diffuse materials.

use super::*;

/// A diffuse (Lambertian) material, one-sided.
#[derive(Debug, Clone, Default)]
pub struct Material {
    pub name: String,
    /// Reflectance ρ, RGB in 0..=1; multiplied by the texture where there is one.
    pub kd: [f32; 3],
    /// Reflectance texture, linear RGB.
    pub map_kd: Option<Arc<Texture>>,
    /// Emitted radiance Le, W·m⁻²·sr⁻¹, RGB.
    pub ke: [f32; 3],
}
