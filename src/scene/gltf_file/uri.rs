//! What a glTF file refers to: other files, and data in the text itself.

use std::path::{Path, PathBuf};

use gltf::buffer::{Data, Source};

use crate::input_file;

/// The path that a URI names beside a file in `base`; none of data in the text.
///
/// # Errors
/// Another scheme than `file`; an escape that is no UTF-8.
pub(super) fn path(base: Option<&Path>, uri: &str) -> Result<Option<PathBuf>, String> {
    if uri.starts_with("data:") {
        return Ok(None);
    }
    let file = uri.strip_prefix("file:");
    let name = match file {
        Some(rest) => rest.strip_prefix("//").unwrap_or(rest),
        None if uri.contains(':') => return Err("neither a file nor data in the text".into()),
        None => uri,
    };
    let name = urlencoding::decode(name).map_err(|_| "the name is not UTF-8".to_string())?;
    Ok(Some(match base {
        Some(base) => base.join(&*name),
        None => PathBuf::from(&*name),
    }))
}

/// The bytes that a URI stands for; up to three zeros may follow.
///
/// # Errors
/// As [`path`]; a file that cannot be read, data that is not base64.
pub(super) fn read(base: Option<&Path>, uri: &str) -> Result<Vec<u8>, String> {
    match path(base, uri)? {
        Some(path) => input_file::read(&path).map_err(|error| error.to_string()),
        None => match Data::from_source(Source::Uri(uri), base) {
            Ok(data) => Ok(data.0),
            Err(error) => Err(error.to_string()),
        },
    }
}
