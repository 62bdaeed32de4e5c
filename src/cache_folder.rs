//! The folder of what is kept from run to run: what was used longest ago is deleted first.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use sha2::{Digest, Sha256};

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::input_file;

/// What the folder `cache` keeps, or what `find` finds, which is then kept there as `what`; and
/// whether it was kept.
///
/// # Errors
/// Those of `find`.
pub(crate) fn kept_or_found<T>(
    cache: Option<&Path>,
    what: &str,
    load: impl FnOnce(&Path) -> Option<T>,
    find: impl FnOnce() -> Result<T>,
    save: impl FnOnce(&T, &Path) -> Result<()>,
) -> Result<(T, bool)> {
    if let Some(kept) = cache.and_then(load) {
        return Ok((kept, true));
    }
    let found = find()?;
    // A cache that cannot be written costs time in the next run but does not harm this one.
    if let Some(Err(error)) = cache.map(|folder| save(&found, folder)) {
        tracing::warn!("cannot keep {what}: {error}");
    }
    Ok((found, false))
}

/// The content of a file that [`save`] has written; None where there is none, or it is damaged.
pub(crate) fn load(path: &Path) -> Option<Vec<u8>> {
    let mut bytes = input_file::read(path).ok()?;
    let body = bytes.len().checked_sub(Sha256::output_size())?;
    if Sha256::digest(&bytes[..body]).as_slice() != &bytes[body..] {
        return None;
    }
    bytes.truncate(body);
    mark_used(path);
    Some(bytes)
}

/// Writes a file with a checksum of its parts after them, and makes the folder if there is none.
///
/// # Errors
/// A folder or file that cannot be written.
pub(crate) fn save(path: &Path, parts: &[&[u8]]) -> Result<()> {
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let mut sum = Sha256::new();
    parts.iter().for_each(|part| sum.update(part));
    write_atomically(path, |out| {
        parts.iter().try_for_each(|part| out.write_all(part))?;
        out.write_all(&sum.finalize())
    })
}

/// Marks a file as just used; if that fails, it is only deleted earlier.
pub(crate) fn mark_used(path: &Path) {
    let _ = File::open(path).and_then(|file| file.set_modified(SystemTime::now()));
}

/// Deletes files beside `newest` whose names are `ours`, least recently used first, until there are
/// at most so many with at most so many bytes; `newest` always stays. Files that cannot be read or
/// deleted are left: another process may be doing the same.
pub(crate) fn trim(newest: &Path, ours: impl Fn(&str) -> bool, most: usize, most_bytes: u64) {
    let Ok(entries) = fs::read_dir(newest.parent().unwrap_or(Path::new("."))) else {
        return;
    };
    let mut found: Vec<(SystemTime, u64, PathBuf)> = entries
        .flatten()
        .filter(|entry| ours(&entry.file_name().to_string_lossy()))
        .filter(|entry| entry.path() != newest)
        .filter_map(|entry| {
            let found = entry.metadata().ok()?;
            Some((found.modified().ok()?, found.len(), entry.path()))
        })
        .collect();
    found.sort();
    let mut bytes = fs::metadata(newest).map_or(0, |found| found.len());
    for (kept, (_, size, path)) in (1..).zip(found.iter().rev()) {
        bytes += size;
        if kept >= most || bytes > most_bytes {
            let _ = fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    /// Five files of 10 bytes, a minute apart, beside another.
    #[test]
    fn what_was_used_longest_ago_goes_first() {
        for (most, most_bytes, left) in [(3, 1000, 3), (9, 25, 2), (9, 1000, 5), (1, 5, 1)] {
            let folder = tempfile::tempdir().expect("a folder for the test");
            let path = |i: u64| folder.path().join(format!("bake-{i}"));
            let now = SystemTime::now();
            for i in 0..5 {
                fs::write(path(i), [0; 10]).expect("written");
                let file = File::options().write(true).open(path(i)).expect("open");
                file.set_modified(now - Duration::from_secs(60 * i))
                    .expect("set");
            }
            fs::write(folder.path().join("relief-1"), [0; 10]).expect("written");
            trim(&path(0), |name| name.starts_with("bake-"), most, most_bytes);
            for i in 0..5 {
                assert_eq!(path(i).exists(), i < left, "{i} of {most}, {most_bytes}");
            }
            assert!(folder.path().join("relief-1").exists());
        }
    }

    /// Every byte changed, and every length.
    #[test]
    fn what_is_damaged_is_not_read() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let path = folder.path().join("of").join("its own");
        assert_eq!(load(&path), None);
        save(&path, &[b"so", b"", b"me"]).expect("written");
        assert_eq!(load(&path).as_deref(), Some(&b"some"[..]));
        let whole = fs::read(&path).expect("read");
        for i in 0..whole.len() {
            let mut other = whole.clone();
            other[i] ^= 1;
            fs::write(&path, &other).expect("written");
            assert_eq!(load(&path), None, "byte {i}");
            fs::write(&path, &whole[..i]).expect("written");
            assert_eq!(load(&path), None, "{i} bytes");
        }
    }
}
