//! Textures of reflectance and emission on the device, with levels of detail.

use std::collections::HashMap;
use std::sync::Arc;

use rayon::prelude::*;

use crate::error::Result;
use crate::passes::shade::{LitBuffers, Shade};
use crate::passes::shadow_rays::LightBuffers;
use crate::scene::{Scene, Texture};
use crate::vk::{Buffer, BufferUse, Commands, DescriptorSet, Device, Format, Image, Sampler};

/// Every texture of a scene, once.
pub struct Textures {
    /// `[material]`, its place in `images`.
    of_material: Vec<usize>,
    /// The same of its emission.
    of_emission: Vec<usize>,
    /// The first is white, for materials without one.
    images: Vec<Image>,
    sampler: Sampler,
}

/// The same bound for drawing, each with the light on plain triangles.
pub struct Bound {
    of_material: Vec<usize>,
    of_emission: Vec<usize>,
    sets: Vec<DescriptorSet>,
}

const TEXEL_BYTES: u64 = 16;

impl Textures {
    /// # Errors
    /// A texture that does not fit the device's memory or its largest image.
    pub fn new(device: &Arc<Device>, scene: &Scene) -> Result<Self> {
        let mut images = vec![upload(device, "white", (1, 1), &[[1.0; 3]])?];
        let mut places: HashMap<*const Texture, usize> = HashMap::new();
        let mut place = |map: &Option<Arc<Texture>>| -> Result<usize> {
            let Some(map) = map else {
                return Ok(0);
            };
            Ok(match places.get(&Arc::as_ptr(map)) {
                Some(&place) => place,
                None => {
                    images.push(upload(
                        device,
                        &map.path.display().to_string(),
                        (map.width, map.height),
                        &map.texels,
                    )?);
                    places.insert(Arc::as_ptr(map), images.len() - 1);
                    images.len() - 1
                }
            })
        };
        let materials = scene.materials.iter();
        let of_material = materials
            .clone()
            .map(|m| place(&m.map_kd))
            .collect::<Result<_>>()?;
        let of_emission = materials.map(|m| place(&m.map_ke)).collect::<Result<_>>()?;
        Ok(Self {
            of_material,
            of_emission,
            images,
            sampler: Sampler::new(device, "albedo", true)?,
        })
    }

    pub fn image(&self, material: u32) -> &Image {
        &self.images[self.of_material[material as usize]]
    }

    /// Binds the textures with `lights` and the triangles of `lit`, see [`Shade::bind`].
    ///
    /// # Errors
    /// A device without the memory.
    pub fn bind(&self, shade: &Shade, lights: &LightBuffers, lit: &LitBuffers) -> Result<Bound> {
        let set = |image| shade.bind(image, &self.sampler, lights, lit);
        Ok(Bound {
            of_material: self.of_material.clone(),
            of_emission: self.of_emission.clone(),
            sets: self.images.iter().map(set).collect::<Result<_>>()?,
        })
    }
}

impl Bound {
    pub fn white(&self) -> &DescriptorSet {
        &self.sets[0]
    }

    pub fn of_emission(&self, material: u32) -> &DescriptorSet {
        &self.sets[self.of_emission[material as usize]]
    }

    pub fn of_material(&self, material: u32) -> &DescriptorSet {
        &self.sets[self.of_material[material as usize]]
    }
}

/// A texture of linear RGB, with its levels of detail.
///
/// # Errors
/// A device without the memory, or whose largest image is smaller.
pub fn upload(
    device: &Arc<Device>,
    name: &str,
    (width, height): (u32, u32),
    texels: &[[f32; 3]],
) -> Result<Image> {
    let image = Image::mipped(device, name, (width, height), Format::R32G32B32A32_SFLOAT)?;
    let mut levels: Vec<[f32; 4]> = texels.iter().map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    let (mut size, mut start) = ((width as usize, height as usize), 0);
    while size != (1, 1) {
        let (below, smaller) = half(&levels[start..], size);
        start = levels.len();
        levels.extend(below);
        size = smaller;
    }
    let mut staging = Buffer::new(
        device,
        "texture staging",
        levels.len() as u64 * TEXEL_BYTES,
        BufferUse::Upload,
    )?;
    staging.write(0, &levels);
    Commands::run(device, "texture upload", |cmd| {
        cmd.upload_texture(&staging, &image, TEXEL_BYTES);
        Ok(())
    })?;
    Ok(image)
}

/// The next level of detail, half the size rounded down: each texel is the mean over the area that
/// it covers, in linear light.
fn half(texels: &[[f32; 4]], (width, height): (usize, usize)) -> (Vec<[f32; 4]>, (usize, usize)) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    let out = (0..w * h)
        .into_par_iter()
        .map(|place| {
            let mut sum = [0.0; 4];
            for (row, down) in covered(place / w, height, h) {
                for (column, across) in covered(place % w, width, w) {
                    let texel = texels[row * width + column];
                    (0..4).for_each(|c| sum[c] += texel[c] * down * across);
                }
            }
            sum
        })
        .collect();
    (out, (w, h))
}

/// The texels along one side that a texel of the smaller level covers, and their shares of it. For
/// an odd size they are three.
fn covered(place: usize, size: usize, smaller: usize) -> impl Iterator<Item = (usize, f32)> {
    let (from, to) = (place * size, (place + 1) * size);
    (from / smaller..to.div_ceil(smaller)).map(move |texel| {
        let overlap = to.min((texel + 1) * smaller) - from.max(texel * smaller);
        (texel, overlap as f32 / size as f32)
    })
}
