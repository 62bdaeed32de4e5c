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
use crate::error::{Error, Result};
use crate::picture::Picture;

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
