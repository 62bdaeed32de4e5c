//! Files that are written completely or not at all: written beside their path, synced, then renamed
//! to it.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

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
    let mut builder = tempfile::Builder::new();
    builder.prefix(".mesolux-");
    // Temporary files are private by default; the umask decides, as for any other file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));

    let mut out = BufWriter::new(builder.tempfile_in(dir)?);
    fill(&mut out)?;
    let file = out.into_inner().map_err(io::IntoInnerError::into_error)?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(|failed| failed.error)?;
    // The rename is durable only once the folder is synced; other systems cannot open a folder.
    #[cfg(unix)]
    File::open(dir)?.sync_all()?;
    Ok(())
}
