//! Files that are written at the end of long work.

use std::path::{Path, PathBuf};

use mesolux::atomic_file::with_ending;
use mesolux::error::{Error, Result};

/// Refuses an output that cannot be written before the work, not after it.
pub fn writable(path: &Path) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(Error::write(path, std::io::ErrorKind::IsADirectory.into()));
    }
    tempfile::Builder::new()
        .prefix(".mesolux-")
        .tempfile_in(folder)
        .map(|_| ())
        // Its own text names the file that was tried.
        .map_err(|e| Error::write(path, e.kind().into()))
}

/// Where a bake goes that was stopped: not over a file that may be a whole one.
pub fn unfinished(output: &Path) -> PathBuf {
    if !output.is_file() {
        return output.to_owned();
    }
    let path = with_ending(output, ".unfinished.safetensors");
    tracing::warn!(
        "{} is left as it is; what is solved goes to {}",
        output.display(),
        path.display()
    );
    path
}

/// Saves to `output`, or where that fails, after all the work, to the folder of temporary files.
///
/// # Errors
/// That of the output, even where the other was written.
pub fn save_somewhere(output: &Path, save: impl Fn(&Path) -> Result<()>) -> Result<()> {
    let failed = match save(output) {
        Ok(()) => return Ok(()),
        Err(error) => error,
    };
    let folder = tempfile::Builder::new().prefix("mesolux-").tempdir();
    let kept = folder.ok().and_then(|folder| {
        save(&folder.path().join("bake.safetensors")).ok()?;
        Some(folder.keep().join("bake.safetensors"))
    });
    match kept {
        Some(path) => tracing::warn!("the bake is kept as {}", path.display()),
        None => tracing::warn!("nor is there room for the bake among temporary files"),
    }
    Err(failed)
}
