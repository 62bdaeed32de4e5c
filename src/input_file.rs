//! Files that are read as a whole.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use crate::error::{Error, Result};

/// The content of a file.
///
/// # Errors
/// What cannot be read, or is not a regular file: a pipe could be waited for without end, and
/// `/dev/zero` read without end; a file that does not fit into memory.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let failed = |source| Error::read(path, source);
    let (mut file, length) = open(path)?;
    let mut bytes = Vec::new();
    let room = usize::try_from(length).map_err(|_| failed(ErrorKind::OutOfMemory.into()))?;
    bytes
        .try_reserve_exact(room.saturating_add(1))
        .map_err(|_| {
            failed(io::Error::other(format!(
                "no memory for its {length} bytes"
            )))
        })?;
    file.read_to_end(&mut bytes).map_err(failed)?;
    Ok(bytes)
}

/// The text of a file without its byte order mark.
///
/// # Errors
/// As [`read`]; text that is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    let bytes = read(path)?;
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = 1 + valid.iter().filter(|&&byte| byte == b'\n').count();
        Error::line(path, line, "this is not UTF-8 text")
    })?;
    Ok(match text.strip_prefix('\u{feff}') {
        Some(rest) => rest.to_owned(),
        None => text,
    })
}

/// A regular file that is open for reading, and its length.
///
/// # Errors
/// What cannot be opened, or is not a regular file.
pub fn open(path: &Path) -> Result<(File, u64)> {
    let failed = |source| Error::read(path, source);
    // Looked at before it is opened, which would wait at a pipe that nobody writes to.
    let found = std::fs::metadata(path).map_err(failed)?;
    if found.is_dir() {
        return Err(failed(ErrorKind::IsADirectory.into()));
    }
    if !found.is_file() {
        let what = "a pipe or a device, where a regular file is wanted";
        return Err(failed(io::Error::other(what)));
    }
    let file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    Ok((file, length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(unix)]
    #[test]
    fn only_regular_files_are_read() {
        let folder = std::env::temp_dir();
        let name = |path: &Path| read(path).expect_err("no file").to_string();
        assert!(name(Path::new("/dev/zero")).ends_with("a regular file is wanted"));
        assert!(
            name(&folder).ends_with("is a directory"),
            "{}",
            name(&folder)
        );
    }
}
