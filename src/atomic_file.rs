//! Files that are written completely or not at all: written beside their path, synced, then renamed
//! to it.

use std::collections::hash_map::RandomState;
use std::fs::{self, File, OpenOptions};
use std::hash::BuildHasher;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Error, Result};

/// Writes `path` through `fill`, so that a crash, a full disk or an error from `fill` leaves the
/// previous file.
///
/// A path that is not a regular file, such as a pipe or `/dev/null`, is written in place: renaming
/// over it would destroy it.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let special = fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir());
    if special {
        write_in_place(path, fill)
    } else {
        write_beside(path, fill)
    }
    .map_err(|source| Error::write(path, source))
}

fn write_in_place(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::new(OpenOptions::new().write(true).open(path)?);
    fill(&mut out)?;
    out.flush()
}

fn write_beside(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let dir = match path.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    };
    let (beside, file) = Beside::create(dir)?;
    let mut out = BufWriter::new(file);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.sync_all()?;
    // Closed first: some systems do not rename what is open.
    drop(file);
    beside.rename_to(path)?;
    // The rename itself lasts only once the folder is synced; other systems cannot open a folder.
    #[cfg(unix)]
    File::open(dir)?.sync_all()?;
    Ok(())
}

/// A file under a name of its own, removed unless it is renamed.
struct Beside {
    path: Option<PathBuf>,
}

impl Beside {
    /// The umask decides who may read it, as for any other file.
    fn create(dir: &Path) -> io::Result<(Self, File)> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            // Seeded at random: processes of two containers may share a folder and a number.
            let random = RandomState::new().hash_one(count);
            let path = dir.join(format!(".mesolux-{random:016x}"));
            match OpenOptions::new().write(true).create_new(true).open(&path) {
                Ok(file) => return Ok((Self { path: Some(path) }, file)),
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn rename_to(mut self, to: &Path) -> io::Result<()> {
        if let Some(path) = &self.path {
            fs::rename(path, to)?;
        }
        self.path = None;
        Ok(())
    }
}

impl Drop for Beside {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // What cannot be removed is left lying; the error that led here says more.
            let _ = fs::remove_file(path);
        }
    }
}
