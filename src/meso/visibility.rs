//! Visibility of one tile of relief and its cache on disk.

use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};

use super::HeightField;
use crate::atomic_file::write_atomically;
use crate::constants::{AZIMUTHS, RAY_STRATA};
use crate::error::Result;
use crate::input_file;

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
        let name: String = Self::key(field)
            .iter()
            .map(|b| format!("{b:02x}"))
            .collect();
        cache.join(format!("relief-{name}.bin"))
    }

    /// The cached visibility of a height field; None if there is none or its file is damaged.
    pub fn load(field: &HeightField, cache: &Path) -> Option<Self> {
        let bytes = input_file::read(&Self::file(field, cache)).ok()?;
        let facets = field.facet_count();
        let (body, sum) = bytes.split_at_checked(4 * facets * (AZIMUTHS as usize + RAYS))?;
        if Sha256::digest(body).as_slice() != sum {
            return None;
        }
        let (horizons, hits) = body.split_at(4 * facets * AZIMUTHS as usize);
        let word = |b: &[u8]| [b[0], b[1], b[2], b[3]];
        Some(Self {
            horizons: horizons
                .chunks_exact(4)
                .map(|b| f32::from_le_bytes(word(b)))
                .collect(),
            hits: hits
                .chunks_exact(4)
                .map(|b| u32::from_le_bytes(word(b)))
                .collect(),
        })
    }

    pub fn save(&self, field: &HeightField, cache: &Path) -> Result<()> {
        std::fs::create_dir_all(cache).map_err(|e| crate::error::Error::write(cache, e))?;
        let mut bytes: Vec<u8> = self.horizons.iter().flat_map(|h| h.to_le_bytes()).collect();
        bytes.extend(self.hits.iter().flat_map(|h| h.to_le_bytes()));
        let sum = Sha256::digest(&bytes);
        bytes.extend_from_slice(&sum);
        write_atomically(&Self::file(field, cache), |out| out.write_all(&bytes))
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
