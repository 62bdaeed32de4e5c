//! A glTF file with its data, all of whose ranges are checked.

use std::path::{Path, PathBuf};

use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::{Data, Source};
use gltf::{Accessor, Document, Semantic};

use super::uri;
use crate::error::{Error, Result};
use crate::input_file;

/// Extensions whose content is used, or whose absence changes nothing that is.
const KNOWN: [&str; 9] = [
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_sheen",
    "KHR_materials_clearcoat",
    "KHR_materials_unlit",
    "KHR_texture_transform",
    "MOZ_lightmap",
];

/// Whether an accessor has these dimensions, and one of these types.
fn is(accessor: &Accessor, dimensions: Dimensions, types: &[DataType]) -> bool {
    accessor.dimensions() == dimensions && types.contains(&accessor.data_type())
}

/// Whether the length in the header of a binary file can be right: the `gltf` crate subtracts from
/// it.
fn check_binary(bytes: &[u8]) -> std::result::Result<(), String> {
    if !bytes.starts_with(b"glTF") {
        return Ok(());
    }
    let length = bytes
        .get(8..)
        .and_then(|rest| rest.first_chunk())
        .map_or(0, |&word| u32::from_le_bytes(word) as usize);
    match (12..=bytes.len()).contains(&length) {
        true => Ok(()),
        false => Err(format!(
            "its header says that it has {length} bytes; it has {}",
            bytes.len()
        )),
    }
}

pub(super) struct File {
    pub path: PathBuf,
    pub document: Document,
    pub buffers: Vec<Data>,
}

impl File {
    /// # Errors
    /// See [`super::read`].
    pub fn open(path: &Path) -> Result<Self> {
        let bytes = input_file::read(path)?;
        let refuse = |error: gltf::Error| {
            let text = error.to_string();
            Error::file(
                path,
                format!("is no valid glTF 2.0: {}", text.trim().replace('\n', "; ")),
            )
        };
        check_binary(&bytes).map_err(|what| Error::file(path, what))?;
        let gltf = gltf::Gltf::from_slice_without_validation(&bytes).map_err(refuse)?;
        let asset = &gltf.document.as_json().asset;
        let version = asset.min_version.as_ref().unwrap_or(&asset.version);
        if version.split('.').next() != Some("2") {
            let what = format!("is glTF {}, not 2.0", version.escape_debug());
            return Err(Error::file(path, what));
        }
        let unknown = (gltf.document.extensions_required()).find(|name| !KNOWN.contains(name));
        if let Some(name) = unknown {
            return Err(Error::file(
                path,
                format!("it requires {name}, which is not known here"),
            ));
        }
        // The crate's own validation panics at such an index.
        let json = gltf.document.as_json();
        let primitives = || json.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let mut attributes = primitives().flat_map(|p| p.attributes.values());
        if attributes.any(|index| index.value() >= json.accessors.len()) {
            let what = "is no valid glTF 2.0: a primitive has an accessor that is not there";
            return Err(Error::file(path, what));
        }
        let gltf = gltf::Gltf::from_slice(&bytes).map_err(refuse)?;
        let mut blob = gltf.blob;
        let buffers = (gltf.document.buffers())
            .map(|buffer| {
                let refuse = |what: String| {
                    let what = format!("buffer {} cannot be read: {what}", buffer.index());
                    Error::file(path, what)
                };
                let bytes = match buffer.source() {
                    Source::Uri(uri) => uri::read(path.parent(), uri),
                    Source::Bin => (blob.take()).ok_or_else(|| "the file has no data".into()),
                };
                let bytes = bytes.map_err(refuse)?;
                match bytes.len() < buffer.length() {
                    true => Err(refuse(format!(
                        "it has {} of {} bytes",
                        bytes.len(),
                        buffer.length()
                    ))),
                    false => Ok(Data(bytes)),
                }
            })
            .collect::<Result<Vec<_>>>()?;
        let file = Self {
            path: path.to_owned(),
            document: gltf.document,
            buffers,
        };
        file.check_ranges()?;
        file.check_kinds()?;
        Ok(file)
    }

    /// Whether all data is of a kind that it can be: the `gltf` crate takes it for that.
    fn check_kinds(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::file(&self.path, what));
        let primitives = || self.document.meshes().flat_map(|mesh| mesh.primitives());
        for primitive in primitives() {
            let attributes = primitive.attributes().map(|(semantic, of)| {
                let is_right = match semantic {
                    Semantic::Positions => is(&of, Dimensions::Vec3, &[DataType::F32]),
                    Semantic::TexCoords(_) => {
                        let coded = [DataType::F32, DataType::U8, DataType::U16];
                        is(&of, Dimensions::Vec2, &coded)
                    }
                    _ => true,
                };
                (of, is_right)
            });
            let words = [DataType::U8, DataType::U16, DataType::U32];
            let indices = (primitive.indices())
                .map(|of| (is(&of, Dimensions::Scalar, &words), of))
                .map(|(is_right, of)| (of, is_right));
            for (of, is_right) in attributes.chain(indices) {
                if !is_right {
                    let what = "does not hold what the primitive takes it for";
                    return refuse(format!("accessor {} {what}", of.index()));
                }
            }
        }
        let json = self.document.as_json();
        let lights = self.document.lights().map_or(0, |lights| lights.len());
        for (n, node) in json.nodes.iter().enumerate() {
            let own = node.extensions.as_ref();
            let light = own.and_then(|of| of.khr_lights_punctual.as_ref());
            if light.is_some_and(|of| of.light.value() >= lights) {
                return refuse(format!("node {n} has a light that is not there"));
            }
        }
        for (i, image) in json.images.iter().enumerate() {
            let is_there = match image.buffer_view {
                Some(_) => image.mime_type.is_some(),
                None => image.uri.is_some(),
            };
            if !is_there {
                return refuse(format!("image {i} has no uri and no mimeType"));
            }
        }
        Ok(())
    }

    /// Whether all data lies within its buffer: the `gltf` crate takes ranges as they are.
    fn check_ranges(&self) -> Result<()> {
        let refuse = |what: String| Err(Error::file(&self.path, what));
        for view in self.document.views() {
            let length = self.buffers[view.buffer().index()].len();
            let end = view.offset().checked_add(view.length());
            if end.is_none_or(|end| end > length) {
                return refuse(format!(
                    "buffer view {} reaches beyond its buffer",
                    view.index()
                ));
            }
        }
        for accessor in self.document.accessors() {
            let fits = |view: &gltf::buffer::View, offset: usize, count: usize, size: usize| {
                let stride = view.stride().unwrap_or(size);
                let last = count.saturating_sub(1).checked_mul(stride);
                let end = last.and_then(|last| last.checked_add(offset + size));
                count == 0 || end.is_some_and(|end| end <= view.length())
            };
            let (count, size) = (accessor.count(), accessor.size());
            let of_view = accessor
                .view()
                .is_none_or(|v| fits(&v, accessor.offset(), count, size));
            let of_sparse = accessor.sparse().is_none_or(|sparse| {
                let (indices, values) = (sparse.indices(), sparse.values());
                let width = indices.index_type().size();
                fits(&indices.view(), indices.offset(), sparse.count(), width)
                    && fits(&values.view(), values.offset(), sparse.count(), size)
            });
            if !of_view || !of_sparse {
                return refuse(format!(
                    "accessor {} reaches beyond its view",
                    accessor.index()
                ));
            }
        }
        Ok(())
    }
}
