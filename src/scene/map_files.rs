//! Textures and relief maps of a scene that is written out.

use std::collections::HashMap;
use std::io::Cursor;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb};

use super::texture::srgb_table;
use super::{HeightMap, NormalMap, Scene, Texture};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input_file;

/// The names of the files in the folder.
#[derive(Default)]
pub(super) struct MapFiles {
    /// By the path of the original.
    pub textures: HashMap<PathBuf, String>,
    /// By the address of the map: maps made by code may share a path.
    maps: HashMap<usize, String>,
}

impl MapFiles {
    pub fn of<T>(&self, map: &Arc<T>) -> &str {
        &self.maps[&address(map)]
    }
}

fn address<T>(map: &Arc<T>) -> usize {
    Arc::as_ptr(map).addr()
}

/// Writes each texture and map once.
pub(super) fn write(scene: &Scene, dir: &Path) -> Result<MapFiles> {
    let mut files = MapFiles::default();
    // All are read before any is written: a copy may replace an original.
    let mut contents: Vec<(String, Vec<u8>)> = Vec::new();
    let of = scene.materials.iter().flat_map(|m| [&m.map_kd, &m.map_ke]);
    for texture in of.flatten() {
        if files.textures.contains_key(&texture.path) {
            continue;
        }
        let number = files.textures.len();
        // Only in a scene without a file may a texture be made by code.
        let is_file = scene.path.is_some()
            || Texture::load(&texture.path).is_ok_and(|there| there == **texture);
        let (name, bytes) = if is_file {
            let bytes = input_file::read(&texture.path)?;
            (copy_name("texture", &texture.path, number), bytes)
        } else {
            let (extension, bytes) = encode_colours(texture)?;
            (format!("texture-{number}.{extension}"), bytes)
        };
        contents.push((name.clone(), bytes));
        files.textures.insert(texture.path.clone(), name);
    }
    for material in &scene.materials {
        if let Some(map) = &material.map_height {
            let same = HeightMap::load(&map.path).is_ok_and(|(there, _)| there == **map);
            add(
                &mut files,
                &mut contents,
                map,
                "height",
                &map.path,
                same,
                encode_heights,
            )?;
        }
        if let Some(map) = &material.map_normal {
            let same = NormalMap::load(&map.path).is_ok_and(|there| there == **map);
            add(
                &mut files,
                &mut contents,
                map,
                "normal",
                &map.path,
                same,
                encode_normals,
            )?;
        }
    }
    for (name, bytes) in contents {
        write_atomically(&dir.join(name), |out| out.write_all(&bytes))?;
    }
    Ok(files)
}

/// The map's own file if it still holds the map, else the map encoded again.
fn add<T>(
    files: &mut MapFiles,
    contents: &mut Vec<(String, Vec<u8>)>,
    map: &Arc<T>,
    kind: &str,
    path: &Path,
    same: bool,
    encode: impl Fn(&T) -> Result<(&'static str, Vec<u8>)>,
) -> Result<()> {
    if files.maps.contains_key(&address(map)) {
        return Ok(());
    }
    let number = files.maps.len();
    let (name, bytes) = if same {
        let bytes = input_file::read(path)?;
        (copy_name(kind, path, number), bytes)
    } else {
        let (extension, bytes) = encode(map)?;
        (format!("{kind}-{number}.{extension}"), bytes)
    };
    contents.push((name.clone(), bytes));
    files.maps.insert(address(map), name);
    Ok(())
}

/// Numbered, since maps of one name may come from several folders.
fn copy_name(kind: &str, path: &Path, number: usize) -> String {
    match path.extension() {
        Some(extension) => format!("{kind}-{number}.{}", extension.to_string_lossy()),
        None => format!("{kind}-{number}"),
    }
}

/// A 16-bit PNG in sRGB if that holds every texel exactly, else OpenEXR.
fn encode_colours(texture: &Texture) -> Result<(&'static str, Vec<u8>)> {
    let (width, height) = (texture.width, texture.height);
    let linear = || texture.texels.iter().flatten().copied();
    let table = srgb_table();
    let code = |c: f32| table.binary_search_by(|entry| entry.total_cmp(&c)).ok();
    let codes: Option<Vec<u16>> = linear().map(|c| code(c).map(|code| code as u16)).collect();
    match codes {
        Some(codes) => {
            let image = ImageBuffer::<Rgb<u16>, Vec<u16>>::from_raw(width, height, codes);
            encode(
                &texture.path,
                image.map(DynamicImage::from),
                ImageFormat::Png,
            )
        }
        None => {
            let image =
                ImageBuffer::<Rgb<f32>, Vec<f32>>::from_raw(width, height, linear().collect());
            encode(
                &texture.path,
                image.map(DynamicImage::from),
                ImageFormat::OpenExr,
            )
        }
    }
}

/// A 16-bit grey PNG if that holds every value exactly, else OpenEXR.
fn encode_heights(map: &HeightMap) -> Result<(&'static str, Vec<u8>)> {
    let code = |value: f32| (value * f32::from(u16::MAX)).round() as u16;
    let exact = |&value: &f32| f32::from(code(value)) / f32::from(u16::MAX) == value;
    if map.values.iter().all(exact) {
        let codes = map.values.iter().map(|&value| code(value)).collect();
        let grey = ImageBuffer::<Luma<u16>, Vec<u16>>::from_raw(map.width, map.height, codes);
        encode(&map.path, grey.map(DynamicImage::from), ImageFormat::Png)
    } else {
        let spread = map.values.iter().flat_map(|&value| [value; 3]).collect();
        let floats = ImageBuffer::<Rgb<f32>, Vec<f32>>::from_raw(map.width, map.height, spread);
        encode(
            &map.path,
            floats.map(DynamicImage::from),
            ImageFormat::OpenExr,
        )
    }
}

fn encode_normals(map: &NormalMap) -> Result<(&'static str, Vec<u8>)> {
    let code = |&c: &f32| ((f64::from(c) + 1.0) / 2.0 * f64::from(u16::MAX)).round() as u16;
    let codes = map.normals.iter().flatten().map(code).collect();
    let image = ImageBuffer::<Rgb<u16>, Vec<u16>>::from_raw(map.width, map.height, codes);
    encode(&map.path, image.map(DynamicImage::from), ImageFormat::Png)
}

pub(super) fn encode(
    path: &Path,
    image: Option<DynamicImage>,
    format: ImageFormat,
) -> Result<(&'static str, Vec<u8>)> {
    let image =
        image.ok_or_else(|| Error::file(path, "the map has not width times height texels"))?;
    let mut bytes = Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, format)
        .map_err(|error| Error::file(path, format!("cannot be encoded: {error}")))?;
    let extension = match format {
        ImageFormat::OpenExr => "exr",
        _ => "png",
    };
    Ok((extension, bytes.into_inner()))
}
