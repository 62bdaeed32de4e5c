//! Normals and reflectance of a tile by its maps.

use glam::{DVec3, Vec3};

use super::HeightField;
use crate::scene::Material;

/// Normals and reflectance of a tile's facets, `[facet]`.
pub struct Shading {
    pub normals: Vec<DVec3>,
    pub reflectance: Vec<Vec3>,
    /// Whether the normals come from a normal map.
    pub from_map: bool,
}

impl Shading {
    pub fn new(material: &Material, field: &HeightField) -> Self {
        let kd = Vec3::from_array(material.kd);
        let (normals, reflectance) = (0..field.facet_count())
            .map(|q| {
                let facet = field.facet(q);
                let u = (facet.centre.x + 0.5) / f64::from(field.columns);
                let v = (facet.centre.y + 0.5) / f64::from(field.rows);
                let normal = material.map_normal.as_deref().map_or(facet.normal, |map| {
                    let column = (u.rem_euclid(1.0) * f64::from(map.width)) as u32 % map.width;
                    let row =
                        ((1.0 - v).rem_euclid(1.0) * f64::from(map.height)) as u32 % map.height;
                    let n = map.normals[(row * map.width + column) as usize];
                    DVec3::from_array(n.map(f64::from))
                });
                let texel = material.map_kd.as_deref().map_or(Vec3::ONE, |map| {
                    Vec3::from_array(map.sample_bilinear(u as f32, v as f32))
                });
                (normal, kd * texel)
            })
            .unzip();
        Self {
            normals,
            reflectance,
            from_map: material.map_normal.is_some(),
        }
    }

    pub fn mean_reflectance(&self) -> Vec3 {
        self.reflectance.iter().sum::<Vec3>() / self.reflectance.len() as f32
    }
}
