//! Maps of materials as images of a glTF file, each written once.

use std::collections::HashMap;
use std::io::Cursor;
use std::sync::Arc;

use image::{DynamicImage, ImageBuffer, ImageFormat, Luma, Rgb};
use serde_json::{Value, json};

use super::document::Document;
use crate::error::{Error, Result};
use crate::picture::tone::coded;
use crate::scene::{HeightMap, NormalMap, Texture};

#[derive(Default)]
pub struct Images {
    /// Textures by the address of their map.
    known: HashMap<usize, usize>,
}

/// As long as the scene is there, no two maps share an address.
fn address<T>(map: &Arc<T>) -> usize {
    Arc::as_ptr(map) as usize
}

impl Images {
    pub fn colours(&mut self, document: &mut Document, map: &Arc<Texture>) -> Result<Value> {
        let codes = |texel: &[f32; 3]| texel.map(|c| (65535.0 * coded(c)).round() as u16);
        let codes: Vec<u16> = map.texels.iter().flat_map(codes).collect();
        self.add(document, address(map), &map.path, || {
            rgb(map.width, map.height, codes)
        })
    }

    pub fn normals(&mut self, document: &mut Document, map: &Arc<NormalMap>) -> Result<Value> {
        let code = |&c: &f32| ((c + 1.0) / 2.0 * 65535.0).round() as u16;
        let codes: Vec<u16> = map.normals.iter().flatten().map(code).collect();
        self.add(document, address(map), &map.path, || {
            rgb(map.width, map.height, codes)
        })
    }

    /// None of heights outside of 0..=1.
    pub fn heights(
        &mut self,
        document: &mut Document,
        map: &Arc<HeightMap>,
    ) -> Result<Option<Value>> {
        if !map.values.iter().all(|value| (0.0..=1.0).contains(value)) {
            return Ok(None);
        }
        let codes: Vec<u16> = (map.values.iter())
            .map(|value| (65535.0 * value).round() as u16)
            .collect();
        let texture = self.add(document, address(map), &map.path, || {
            let grey = ImageBuffer::<Luma<u16>, Vec<u16>>::from_raw(map.width, map.height, codes);
            grey.map(DynamicImage::from)
        })?;
        Ok(Some(texture))
    }

    fn add(
        &mut self,
        document: &mut Document,
        address: usize,
        path: &std::path::Path,
        image: impl FnOnce() -> Option<DynamicImage>,
    ) -> Result<Value> {
        if let Some(texture) = self.known.get(&address) {
            return Ok(json!({ "index": texture }));
        }
        let image = image()
            .ok_or_else(|| Error::file(path, "the map has not width times height texels"))?;
        let mut png = Cursor::new(Vec::new());
        (image.write_to(&mut png, ImageFormat::Png))
            .map_err(|e| Error::file(path, format!("cannot be encoded: {e}")))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let image = document.image(&name, png.get_ref());
        let sampler = document.repeating_sampler();
        let texture = document.texture(image, sampler);
        self.known.insert(address, texture);
        Ok(json!({ "index": texture }))
    }
}

/// Of 8 bits where these hold all codes.
fn rgb(width: u32, height: u32, codes: Vec<u16>) -> Option<DynamicImage> {
    match codes.iter().all(|code| code % 257 == 0) {
        true => {
            let codes = codes.iter().map(|code| (code / 257) as u8).collect();
            ImageBuffer::<Rgb<u8>, _>::from_raw(width, height, codes).map(DynamicImage::from)
        }
        false => ImageBuffer::<Rgb<u16>, _>::from_raw(width, height, codes).map(DynamicImage::from),
    }
}
