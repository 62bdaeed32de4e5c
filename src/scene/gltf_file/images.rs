//! Images of a glTF file.

use std::path::PathBuf;

use gltf::image::{Data, Format};
use image::{DynamicImage, ImageBuffer, Pixel};

use super::document::File;
use crate::error::{Error, Result};

/// An image with the name that it is reported by: its file, or its number in the glTF file.
///
/// # Errors
/// An image that cannot be read or decoded.
pub(super) fn read(file: &File, image: &gltf::Image) -> Result<(PathBuf, DynamicImage)> {
    let base = file.path.parent();
    let mut said = format!("image {}", image.index());
    let name = match image.source() {
        gltf::image::Source::Uri { uri, .. } if !uri.starts_with("data:") => {
            said += &format!(" ({})", uri.escape_debug());
            base.map_or_else(PathBuf::new, PathBuf::from).join(uri)
        }
        _ => {
            let mut name = file.path.clone().into_os_string();
            name.push(format!("#image{}", image.index()));
            name.into()
        }
    };
    let refuse = |what: String| Error::file(&file.path, format!("{said}: {what}"));
    let data = Data::from_source(image.source(), base, &file.buffers)
        .map_err(|error| refuse(format!("cannot be read: {error}")))?;
    let decoded = decoded(data).ok_or_else(|| refuse("has no texels".into()))?;
    Ok((name, decoded))
}

fn decoded(data: Data) -> Option<DynamicImage> {
    let (w, h) = (data.width, data.height);
    let shorts = |bytes: &[u8]| -> Vec<u16> {
        let words = bytes.as_chunks::<2>().0.iter();
        words.map(|&b| u16::from_ne_bytes(b)).collect()
    };
    let floats = |bytes: &[u8]| -> Vec<f32> {
        let words = bytes.as_chunks::<4>().0.iter();
        words.map(|&b| f32::from_ne_bytes(b)).collect()
    };
    fn of<P: Pixel>(w: u32, h: u32, texels: Vec<P::Subpixel>) -> Option<DynamicImage>
    where
        DynamicImage: From<ImageBuffer<P, Vec<P::Subpixel>>>,
    {
        ImageBuffer::<P, _>::from_raw(w, h, texels).map(DynamicImage::from)
    }
    let bytes = data.pixels;
    match data.format {
        Format::R8 => of::<image::Luma<u8>>(w, h, bytes),
        Format::R8G8 => of::<image::LumaA<u8>>(w, h, bytes),
        Format::R8G8B8 => of::<image::Rgb<u8>>(w, h, bytes),
        Format::R8G8B8A8 => of::<image::Rgba<u8>>(w, h, bytes),
        Format::R16 => of::<image::Luma<u16>>(w, h, shorts(&bytes)),
        Format::R16G16 => of::<image::LumaA<u16>>(w, h, shorts(&bytes)),
        Format::R16G16B16 => of::<image::Rgb<u16>>(w, h, shorts(&bytes)),
        Format::R16G16B16A16 => of::<image::Rgba<u16>>(w, h, shorts(&bytes)),
        Format::R32G32B32FLOAT => of::<image::Rgb<f32>>(w, h, floats(&bytes)),
        Format::R32G32B32A32FLOAT => of::<image::Rgba<f32>>(w, h, floats(&bytes)),
    }
}
