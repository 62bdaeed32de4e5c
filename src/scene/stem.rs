//! Names of scenes by their files.

use std::path::Path;

/// The name of a scene without one: its file's, without the extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem()
        .map(|s| s.to_string_lossy().into_owned())
        .unwrap_or_default()
}
