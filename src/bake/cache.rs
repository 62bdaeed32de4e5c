//! Bakes kept on disk, keyed by their input, so that a scene that is drawn again is not solved
//! again.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::bake::solution::{Bake, Origin, Solution, VERSION};
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::solver::{Settings, StopReason};

/// Most bakes that are kept, and most bytes in all; the least recently used are deleted first.
pub const MOST_BAKES: usize = 16;
pub const MOST_BYTES: u64 = 1 << 30;

/// The place of one bake in a cache.
pub struct CachedBake {
    pub path: PathBuf,
    hash: String,
}

impl CachedBake {
    /// The place of the bake of a scene by these settings.
    /// `maker` identifies the program and the device: the bake of another one is not used.
    pub fn new(folder: &Path, scene: &Scene, settings: &Settings, maker: &str) -> Self {
        let scene_hash = scene.hash();
        let settings = settings.key();
        let key = format!("bake cache 10, layout {VERSION}\n{maker}\n{scene_hash}\n{settings}");
        let name: String = Sha256::digest(key)[..16]
            .iter()
            .map(|byte| format!("{byte:02x}"))
            .collect();
        Self {
            path: folder.join(format!("bake-{name}.safetensors")),
            hash: scene.input_hash(),
        }
    }

    /// The kept bake; None if there is none.
    ///
    /// # Errors
    /// A file that cannot be read or is damaged: the scene is to be baked again.
    pub fn load(&self) -> Result<Option<Bake>> {
        if !self.path.exists() {
            return Ok(None);
        }
        let bake = Bake::load(&self.path)?;
        if bake.origin.hash != self.hash {
            return Err(Error::file(&self.path, "a bake of another scene"));
        }
        // Marks the bake as just used; if that fails, it is only deleted earlier.
        let _ = File::open(&self.path).and_then(|file| file.set_modified(SystemTime::now()));
        Ok(Some(bake))
    }

    /// Keeps a solution and deletes bakes beyond [`MOST_BAKES`] and [`MOST_BYTES`]. A solution that
    /// was stopped by the clock or by Ctrl-C is not kept. Returns whether it was kept.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    pub fn save(
        &self,
        solution: &Solution,
        origin: &Origin,
        settings: &impl Serialize,
    ) -> Result<bool> {
        if matches!(
            solution.report.stop,
            StopReason::Budget | StopReason::Interrupted
        ) {
            return Ok(false);
        }
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
        solution.save(&self.path, origin, settings)?;
        trim(folder, &self.path, MOST_BAKES, MOST_BYTES);
        Ok(true)
    }
}

/// Deletes bakes of the cache, least recently used first, until both limits hold; `newest` always
/// stays. Files that cannot be read or deleted are left: another process may be doing the same.
fn trim(folder: &Path, newest: &Path, most: usize, most_bytes: u64) {
    let Ok(entries) = fs::read_dir(folder) else {
        return;
    };
    let mut bakes: Vec<(SystemTime, u64, PathBuf)> = entries
        .flatten()
        .filter(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            name.starts_with("bake-") && name.ends_with(".safetensors")
        })
        .filter(|entry| entry.path() != newest)
        .filter_map(|entry| {
            let found = entry.metadata().ok()?;
            Some((found.modified().ok()?, found.len(), entry.path()))
        })
        .collect();
    bakes.sort();
    let mut bytes = fs::metadata(newest).map_or(0, |found| found.len());
    for (kept, (_, size, path)) in (1..).zip(bakes.iter().rev()) {
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

    /// Five bakes of 10 bytes, a minute apart, beside another file.
    #[test]
    fn what_was_used_longest_ago_goes_first() {
        for (most, most_bytes, left) in [(3, 1000, 3), (9, 25, 2), (9, 1000, 5), (1, 5, 1)] {
            let folder = tempfile::tempdir().expect("a folder for the test");
            let path = |i: u64| folder.path().join(format!("bake-{i}.safetensors"));
            let now = SystemTime::now();
            for i in 0..5 {
                fs::write(path(i), [0; 10]).expect("written");
                let file = File::options().write(true).open(path(i)).expect("open");
                file.set_modified(now - Duration::from_secs(60 * i))
                    .expect("set");
            }
            fs::write(folder.path().join("relief-1.bin"), [0; 10]).expect("written");
            trim(folder.path(), &path(0), most, most_bytes);
            for i in 0..5 {
                assert_eq!(path(i).exists(), i < left, "{i} of {most}, {most_bytes}");
            }
            assert!(folder.path().join("relief-1.bin").exists());
        }
    }
}
