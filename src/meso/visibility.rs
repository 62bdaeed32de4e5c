//! Visibility of one tile of relief and its cache on disk.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::HeightField;
use crate::cache_folder;
use crate::constants::{AZIMUTHS, RAY_STRATA};
use crate::error::Result;

/// The parts of the sky and of the relief that each facet of a [`HeightField`] sees.
#[derive(Debug, Clone, PartialEq)]
pub struct Visibility {
    /// Tangent of the elevation of the horizon, `[facet][azimuth]`, azimuth a at 2π a / AZIMUTHS
    /// from u towards v.
    pub horizons: Vec<f32>,
    /// The facet that each ray lands on, NONE for the sky, `[facet][ray]`; the rays are
    /// cosine-weighted about the normal.
    pub hits: Vec<u32>,
}

/// Incremented when the shaders' results change.
const VERSION: &str = "relief visibility 1";

/// Most bytes of reliefs that are kept; the least recently used are deleted first.
const MOST_BYTES: u64 = 2 << 30;

/// The file of what is kept of a relief by this key.
pub(super) fn file(cache: &Path, key: &[u8; 32]) -> PathBuf {
    let name: String = key.iter().map(|byte| format!("{byte:02x}")).collect();
    cache.join(format!("relief-{name}.bin"))
}

/// Keeps parts of a relief in a file, and deletes others beyond [`MOST_BYTES`].
///
/// # Errors
/// A folder or file that cannot be written.
pub(super) fn keep(path: &Path, parts: &[&[u8]]) -> Result<()> {
    cache_folder::save(path, parts)?;
    let ours = |name: &str| name.starts_with("relief-") && name.ends_with(".bin");
    cache_folder::trim(path, ours, usize::MAX, MOST_BYTES);
    Ok(())
}

/// Rays from each facet.
pub const RAYS: usize = (RAY_STRATA * RAY_STRATA) as usize;

impl Visibility {
    /// A hash of everything the visibility of a height field depends on.
    pub(super) fn key(field: &HeightField) -> [u8; 32] {
        let mut hash = Sha256::new();
        hash.update(VERSION);
        hash.update(format!(
            "{} {} {AZIMUTHS} {RAYS}",
            field.columns, field.rows
        ));
        hash.update(field.aspect.to_le_bytes());
        field
            .heights
            .iter()
            .for_each(|h| hash.update(h.to_le_bytes()));
        hash.finalize().into()
    }

    /// Its file in the cache.
    fn file(field: &HeightField, cache: &Path) -> PathBuf {
        file(cache, &Self::key(field))
    }

    /// The cached visibility of a height field; None if there is none or its file is damaged.
    pub fn load(field: &HeightField, cache: &Path) -> Option<Self> {
        let bytes = cache_folder::load(&Self::file(field, cache))?;
        let (horizons, hits) =
            bytes.split_at_checked(4 * field.facet_count() * AZIMUTHS as usize)?;
        let found = Self {
            horizons: bytemuck::pod_collect_to_vec(horizons),
            hits: bytemuck::pod_collect_to_vec(hits),
        };
        (found.hits.len() == field.facet_count() * RAYS).then_some(found)
    }

    pub fn save(&self, field: &HeightField, cache: &Path) -> Result<()> {
        let parts = [
            bytemuck::cast_slice(&self.horizons),
            bytemuck::cast_slice(&self.hits),
        ];
        keep(&Self::file(field, cache), &parts)
    }

    /// Tangents of the horizon of a facet, `[azimuth]`.
    pub(super) fn horizons(&self, facet: usize) -> &[f32] {
        &self.horizons[facet * AZIMUTHS as usize..][..AZIMUTHS as usize]
    }
}

/// An azimuth between two stored ones.
#[derive(Debug, Clone, Copy)]
pub(super) struct Azimuth {
    between: [usize; 2],
    /// Weight of the second.
    share: f32,
}

impl Azimuth {
    /// From u towards v, in radians.
    pub fn new(angle: f64) -> Self {
        let at = (angle / std::f64::consts::TAU).rem_euclid(1.0) * f64::from(AZIMUTHS);
        let low = at as usize;
        Self {
            between: [low, low + 1].map(|i| i % AZIMUTHS as usize),
            share: (at - low as f64) as f32,
        }
    }

    /// Tangent of the horizon of a facet, linear between its stored ones, `[azimuth]`.
    pub fn horizon(&self, kept: &[f32]) -> f32 {
        let [low, high] = self.between.map(|i| kept[i]);
        low + (high - low) * self.share
    }
}
