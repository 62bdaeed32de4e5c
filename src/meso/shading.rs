//! Normals and reflectance of a tile's facets.

use glam::{DVec3, Vec3};

use super::HeightField;
use crate::scene::Material;

/// Normals and reflectance of a tile's facets, `[facet]`.
pub struct Shading {
    /// Of the heights, which cast the shadows too: a normal map would send other light than the
    /// surface that is seen.
    pub normals: Vec<DVec3>,
    pub reflectance: Vec<Vec3>,
}

impl Shading {
    pub fn new(material: &Material, field: &HeightField) -> Self {
        let kd = Vec3::from_array(material.kd);
        let (normals, reflectance) = (0..field.facet_count())
            .map(|q| {
                let facet = field.facet(q);
                let u = (facet.centre.x + 0.5) / f64::from(field.columns);
                let v = (facet.centre.y + 0.5) / f64::from(field.rows);
                let texel = material.map_kd.as_deref().map_or(Vec3::ONE, |map| {
                    Vec3::from_array(map.sample_bilinear(u as f32, v as f32))
                });
                (facet.normal, kd * texel)
            })
            .unzip();
        Self {
            normals,
            reflectance,
        }
    }

    pub fn mean_reflectance(&self) -> Vec3 {
        self.reflectance.iter().sum::<Vec3>() / self.reflectance.len() as f32
    }
}
