//! Bakes kept on disk, keyed by their input, so that a scene that is drawn again is not solved
//! again.

use std::fs;
use std::path::{Path, PathBuf};

use serde::Serialize;
use sha2::{Digest, Sha256};

use crate::bake::solution::{Bake, Origin, Solution, VERSION};
use crate::cache_folder::{mark_used, trim};
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
        mark_used(&self.path);
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
        let is_bake = |name: &str| name.starts_with("bake-") && name.ends_with(".safetensors");
        trim(&self.path, is_bake, MOST_BAKES, MOST_BYTES);
        Ok(true)
    }
}
