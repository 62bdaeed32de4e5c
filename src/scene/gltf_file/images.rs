//! Images of a glTF file.

use std::borrow::Cow;
use std::path::PathBuf;

use gltf::image::Source;
use image::DynamicImage;

use super::document::File;
use super::uri;
use crate::error::{Error, Result};
use crate::scene::texture;

/// An image with the name that it is reported by: its file, or its number in the glTF file.
///
/// # Errors
/// An image that cannot be read or decoded.
pub(super) fn read(file: &File, image: &gltf::Image) -> Result<(PathBuf, DynamicImage)> {
    let base = file.path.parent();
    let mut said = format!("image {}", image.index());
    let mut inside = file.path.clone().into_os_string();
    inside.push(format!("#image{}", image.index()));
    let mut name = PathBuf::from(inside);
    if let Source::Uri { uri, .. } = image.source()
        && !uri.starts_with("data:")
    {
        said += &format!(" ({})", uri.escape_debug());
        name = base.map_or_else(PathBuf::new, PathBuf::from).join(uri);
    }
    let refuse = |what: String| Error::file(&file.path, format!("{said}: {what}"));
    let bytes = match image.source() {
        Source::Uri { uri, .. } => uri::read(base, uri)
            .map(Cow::Owned)
            .map_err(|what| refuse(format!("cannot be read: {what}")))?,
        Source::View { view, .. } => {
            let all: &[u8] = &file.buffers[view.buffer().index()];
            let range = view.offset()..view.offset() + view.length();
            let bytes = all.get(range);
            Cow::Borrowed(bytes.ok_or_else(|| refuse("lies beyond its buffer".into()))?)
        }
    };
    Ok((name, texture::decode_bytes(&bytes).map_err(refuse)?))
}
