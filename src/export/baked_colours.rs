//! Light and reflectance together, as a viewer without any light shows them.

use std::io::Cursor;

use glam::Vec3;
use image::ImageEncoder;
use image::codecs::png::PngEncoder;
use rayon::prelude::*;

use super::light_map::LightMap;
use super::map_files::Part;
use super::surface::Surface;
use super::texels::quarters;
use super::vertex_light::VertexLight;
use crate::error::{Error, Result};
use crate::mesh::sources::triangle_area;
use crate::picture::tone::luminance;
use crate::picture::{Development, Picture, exposure_by_area};

/// Pages as PNG, exposed and tone-mapped as pictures are, and the exposure that was used: without
/// one, the brightest tenth of the texels that do not emit is brought to 0.6 and more.
///
/// # Errors
/// A page that cannot be encoded.
pub fn pages(
    surface: &Surface,
    map: &LightMap,
    part: Part,
    exposure: Option<f32>,
) -> Result<(Vec<Vec<u8>>, f32)> {
    let radiance: Vec<(Vec3, bool)> = (map.map.texels.par_iter().zip(&map.light))
        .map(|(texel, light)| {
            let triangle = &surface.scene.triangles[texel.triangle as usize];
            let material = &surface.scene.materials[triangle.material as usize];
            let (mut reflectance, mut emitted) = (Vec3::ZERO, Vec3::ZERO);
            for weights in quarters(surface, texel) {
                let at = |uv: [[f32; 2]; 3]| -> [f32; 2] {
                    [0, 1].map(|i| (0..3).map(|k| weights[k] as f32 * uv[k][i]).sum())
                };
                let [u, v] = at(triangle.uv);
                let colour = material
                    .map_kd
                    .as_ref()
                    .map_or([1.0; 3], |map| map.sample_bilinear(u, v));
                reflectance += Vec3::from_array(colour) * 0.25;
                let [u, v] = at(triangle.uv_of_emission());
                let glow = material
                    .map_ke
                    .as_ref()
                    .map_or([1.0; 3], |map| map.sample_bilinear(u, v));
                emitted += Vec3::from_array(glow) * 0.25;
            }
            let kd = Vec3::from_array(material.kd) * reflectance;
            let emits = part != Part::Indirect;
            let ke = if emits {
                Vec3::from_array(material.ke) * emitted
            } else {
                Vec3::ZERO
            };
            (
                kd * part.of(light) / std::f32::consts::PI + ke,
                !material.emits(),
            )
        })
        .collect();
    let metered = radiance.iter().map(|(_, metered)| *metered);
    let count = radiance.len() as u32;
    let colours: Vec<[f32; 3]> = radiance
        .iter()
        .map(|(colour, _)| colour.to_array())
        .collect();
    let meter = Picture::new((count, 1), colours, &metered.collect::<Vec<_>>());
    let exposure = exposure.unwrap_or(meter.automatic_exposure);
    let pages = (0..map.pages.count).map(|page| {
        let page = map.page_of(page, |t| radiance[t].0);
        let (width, height) = (page.width, page.height);
        let colours: Vec<[f32; 3]> = page.irradiance.iter().map(|c| c.to_array()).collect();
        let metered = vec![false; colours.len()];
        let picture = Picture::new((width, height), colours, &metered);
        let mut png = Cursor::new(Vec::new());
        PngEncoder::new(&mut png)
            .write_image(
                &picture.srgb_codes(Some(exposure)),
                width,
                height,
                image::ExtendedColorType::Rgb8,
            )
            .map_err(|e| Error::Usage(format!("a page cannot be encoded: {e}")))?;
        Ok(png.into_inner())
    });
    Ok((pages.collect::<Result<_>>()?, exposure))
}

/// Colours of the corners of a scene's triangles, `[triangle][corner]`.
pub struct CornerColours {
    /// Linear RGB in 0..=1, exposed and tone-mapped: of a material without a texture of its
    /// reflectance light and reflectance together; of others what makes the mean of the texture so.
    pub colours: Vec<[[f32; 3]; 3]>,
    /// Irradiance, W·m⁻², RGB.
    pub irradiance: Vec<[[f32; 3]; 3]>,
    /// Powers of two.
    pub exposure: f32,
}

/// Light at vertices as colours; the exposure is found as for [`pages`].
pub fn corners(light: &VertexLight, part: Part, exposure: Option<f32>) -> CornerColours {
    let scene = &light.surface.scene;
    let irradiance: Vec<[Vec3; 3]> = (light.corners.iter())
        .map(|corners| corners.map(|at| part.of(&light.light[at as usize])))
        .collect();
    let reflectance: Vec<Vec3> = (scene.materials.iter())
        .map(|material| Vec3::from(material.mean_reflectance()))
        .collect();
    let reflected = |t: usize, light: Vec3| {
        reflectance[scene.triangles[t].material as usize] * light / std::f32::consts::PI
    };
    let exposure = exposure.unwrap_or_else(|| {
        let dark = (irradiance.iter().enumerate()).filter_map(|(t, [a, b, c])| {
            let triangle = &scene.triangles[t];
            let mean = reflected(t, (a + b + c) / 3.0).to_array();
            let area = triangle_area(scene.corners(triangle));
            let emits = scene.materials[triangle.material as usize].emits();
            (!emits).then(|| (luminance(mean), area))
        });
        exposure_by_area(dark)
    });
    let develop = Development::from(Some(exposure)).shown(exposure);
    let colour = |t: usize, k: usize| -> [f32; 3] {
        let triangle = &scene.triangles[t];
        let material = &scene.materials[triangle.material as usize];
        let mut radiance = reflected(t, irradiance[t][k]);
        if part != Part::Indirect && material.emits() {
            let [u, v] = triangle.uv_of_emission()[k];
            let map = material.map_ke.as_ref();
            let glow = map.map_or([1.0; 3], |map| map.sample_bilinear(u, v));
            radiance += Vec3::from(material.ke) * Vec3::from(glow);
        }
        let shown = Vec3::from(develop(radiance.to_array()));
        let shown = match material.map_kd {
            // The texture multiplies it.
            Some(_) => shown / reflectance[triangle.material as usize].max(Vec3::splat(1e-6)),
            None => shown,
        };
        shown.clamp(Vec3::ZERO, Vec3::ONE).to_array()
    };
    let each = 0..irradiance.len();
    CornerColours {
        colours: each.map(|t| [0, 1, 2].map(|k| colour(t, k))).collect(),
        irradiance: (irradiance.iter())
            .map(|of| of.map(|light| light.to_array()))
            .collect(),
        exposure,
    }
}
