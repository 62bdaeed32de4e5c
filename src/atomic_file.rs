//! Files that are written completely or not at all: written beside their path, synced, then renamed
//! to it.

use std::collections::BTreeSet;
use std::collections::hash_map::RandomState;
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions};
use std::hash::BuildHasher;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime};

use crate::error::{Error, Result};

/// Writes `path` through `fill`, so that a crash, a full disk or an error from `fill` leaves the
/// previous file.
///
/// A symbolic link stays, and what it leads to is written. A path that is not a regular file, such
/// as a pipe or `/dev/null`, is written in place: renaming over it would destroy it.
pub fn write_atomically(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    let special = fs::metadata(path).is_ok_and(|found| !found.is_file() && !found.is_dir());
    if special {
        write_in_place(path, fill)
    } else {
        write_beside(&target(path), fill)
    }
    .map_err(|source| Error::write(path, source))
}

/// A path with the same folder and stem and something after it: `dir/out.exr` with `-2.png` is
/// `dir/out-2.png`. Names need not be UTF-8.
pub fn with_ending(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_owned();
    name.push(ending);
    path.with_file_name(name)
}

/// Most links in a row, as on Linux.
const MOST_LINKS: u32 = 40;

/// Where a path's links lead to, whether there is a file or not.
fn target(path: &Path) -> PathBuf {
    let mut at = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&at) else {
            break;
        };
        at = at.parent().unwrap_or(Path::new("")).join(next);
    }
    at
}

fn write_in_place(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let mut out = BufWriter::new(open_special(path)?);
    fill(&mut out)?;
    out.flush()
}

/// Opens a pipe or a device for writing, without waiting for a reader.
#[cfg(unix)]
fn open_special(path: &Path) -> io::Result<File> {
    use std::os::unix::fs::OpenOptionsExt;

    use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};

    let opened = OpenOptions::new()
        .write(true)
        .custom_flags(OFlags::NONBLOCK.bits() as i32)
        .open(path);
    let file = opened.map_err(|error| match error.raw_os_error() {
        Some(code) if code == rustix::io::Errno::NXIO.raw_os_error() => {
            io::Error::new(error.kind(), "nothing reads this pipe")
        }
        _ => error,
    })?;
    // From here on writes wait for the reader.
    let flags = fcntl_getfl(&file)?;
    fcntl_setfl(&file, flags - OFlags::NONBLOCK)?;
    Ok(file)
}

#[cfg(not(unix))]
fn open_special(path: &Path) -> io::Result<File> {
    OpenOptions::new().write(true).open(path)
}

fn write_beside(
    path: &Path,
    fill: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    let dir = match path.parent() {
        Some(dir) if !dir.as_os_str().is_empty() => dir,
        _ => Path::new("."),
    };
    clear_away(dir);
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

/// Of files that programs left which were killed while they wrote.
const PREFIX: &str = ".mesolux-";

/// Whether a name is of a file that a program was writing when it was killed, or is writing.
pub(crate) fn is_temporary(name: &OsStr) -> bool {
    let random = name.to_str().and_then(|name| name.strip_prefix(PREFIX));
    random.is_some_and(|random| {
        [6, 16].contains(&random.len()) && random.bytes().all(|b| b.is_ascii_alphanumeric())
    })
}

/// No program writes to one file for so long without changing its time.
const LEFT: Duration = Duration::from_secs(3600);

/// Removes what killed programs have left in a folder; once a folder, by what cannot fail.
fn clear_away(dir: &Path) {
    static CLEARED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let mut cleared = CLEARED.lock().unwrap_or_else(|e| e.into_inner());
    if !cleared.insert(dir.to_owned()) {
        return;
    }
    for entry in fs::read_dir(dir).into_iter().flatten().flatten() {
        let is_ours = is_temporary(&entry.file_name());
        let changed = || entry.metadata().and_then(|found| found.modified()).ok();
        let is_left = |at: SystemTime| at.elapsed().is_ok_and(|since| since > LEFT);
        if is_ours && changed().is_some_and(is_left) {
            let _ = fs::remove_file(entry.path());
        }
    }
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
            let path = dir.join(format!("{PREFIX}{random:016x}"));
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
