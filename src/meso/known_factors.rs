//! Factors of reliefs, kept while only the light changes, and on disk from run to run.

use std::path::Path;
use std::sync::{Arc, Mutex};

use glam::Vec3;
use sha2::{Digest, Sha256};

use super::{CORNERS, Factors, HeightField, Shading, Visibility, visibility};
use crate::cache_folder;
use crate::constants::MOST_RANK;
use crate::error::Result;
use crate::math::directions::Directions;

/// A hash of everything the factors depend on.
type Key = [u8; 32];

/// Factors of the reliefs of a scene, in memory.
#[derive(Default)]
pub struct KnownFactors(Mutex<Vec<(Key, Arc<Factors>)>>);

/// Largest error of known factors, see [`Factors::error`].
pub const FACTOR_ERROR: f64 = 0.01;

/// Incremented when other factors are found of the same relief.
const VERSION: &str = "relief factors 1";

/// The key of a relief with its shading and directions.
fn key(directions: &Directions, field: &HeightField, shading: &Shading) -> Key {
    let mut hash = Sha256::new();
    hash.update(format!("{VERSION} {FACTOR_ERROR} {MOST_RANK}"));
    hash.update(directions.columns.to_le_bytes());
    hash.update(directions.rows.to_le_bytes());
    hash.update(Visibility::key(field));
    for normal in &shading.normals {
        let axes = normal.to_array();
        axes.iter().for_each(|c| hash.update(c.to_le_bytes()));
    }
    for reflectance in &shading.reflectance {
        let colours = reflectance.to_array();
        colours.iter().for_each(|c| hash.update(c.to_le_bytes()));
    }
    hash.finalize().into()
}

impl KnownFactors {
    /// The factors of each relief, `[relief]`, computed by `find` where they are neither known nor
    /// kept in the folder `cache`. Those of other reliefs are dropped from memory.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn of<'a>(
        &self,
        directions: &Directions,
        reliefs: impl Iterator<Item = (&'a HeightField, &'a Shading)>,
        cache: Option<&Path>,
        mut find: impl FnMut(&HeightField, &Shading) -> Result<Factors>,
    ) -> Result<Vec<Arc<Factors>>> {
        let mut known = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let before = std::mem::take(&mut *known);
        let mut factors = Vec::new();
        for (field, shading) in reliefs {
            let key = key(directions, field, shading);
            let (slots, facets) = (directions.count(), field.facet_count());
            let same = |(of, _): &&(Key, Arc<Factors>)| *of == key;
            let found = match known.iter().chain(&before).find(same) {
                Some((_, found)) => Arc::clone(found),
                None => {
                    let kept = cache_folder::kept_or_found(
                        cache,
                        "factors of a relief",
                        |folder| Factors::load(folder, &key, slots, facets),
                        || find(field, shading),
                        |found, folder| found.save(folder, &key),
                    );
                    Arc::new(kept?.0)
                }
            };
            known.push((key, Arc::clone(&found)));
            factors.push(found);
        }
        Ok(factors)
    }
}

/// Bytes of the numbers at the head of a file: rank, vectors of the basis, error.
const HEAD: usize = 3 * size_of::<u64>();

impl Factors {
    /// Those kept by a key, of so many slots and facets; None if there are none, or their file is
    /// damaged.
    fn load(cache: &Path, key: &Key, slots: usize, facets: usize) -> Option<Self> {
        let bytes = cache_folder::load(&visibility::file(cache, key))?;
        let (head, rest) = bytes.split_first_chunk::<HEAD>()?;
        let [rank, basis, error]: [u64; 3] = bytemuck::pod_read_unaligned(head);
        let rank = usize::try_from(rank).ok()?;
        let size = usize::try_from(basis)
            .ok()?
            .checked_mul(size_of::<Vec3>())?;
        let (basis, corners) = rest.split_at_checked(size)?;
        let found = Self {
            rank,
            basis: bytemuck::pod_collect_to_vec(basis),
            corners: bytemuck::pod_collect_to_vec(corners),
            error: f64::from_bits(error),
        };
        let fits = (1..=MOST_RANK as usize).contains(&rank)
            && found.basis.len() == rank * slots
            && found.corners.len() == facets / 2 * CORNERS * rank;
        fits.then_some(found)
    }

    /// Keeps them by a key.
    ///
    /// # Errors
    /// A folder or file that cannot be written.
    fn save(&self, cache: &Path, key: &Key) -> Result<()> {
        let head = [
            self.rank as u64,
            self.basis.len() as u64,
            self.error.to_bits(),
        ];
        let parts = [
            bytemuck::cast_slice(&head),
            bytemuck::cast_slice(&self.basis),
            bytemuck::cast_slice(&self.corners),
        ];
        visibility::keep(&visibility::file(cache, key), &parts)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3, Vec4};

    use super::*;

    fn field(height: f32) -> HeightField {
        HeightField {
            columns: 2,
            rows: 2,
            heights: vec![0.0, 0.0, height, 0.0],
            aspect: 1.0,
        }
    }

    fn shading(reflectance: f32) -> Shading {
        Shading {
            normals: vec![DVec3::Z; 8],
            reflectance: vec![Vec3::splat(reflectance); 8],
        }
    }

    /// `find` is called once for each different relief; reliefs that are not asked for are dropped.
    #[test]
    fn what_is_known_is_not_found_again() {
        let known = KnownFactors::default();
        let directions = |k| Directions::new(k).expect("a number of slots");
        let found = |k: u32, reliefs: &[(f32, f32)]| {
            let made: Vec<_> = (reliefs.iter())
                .map(|&(height, reflectance)| (field(height), shading(reflectance)))
                .collect();
            let mut count = 0;
            let factors = known.of(
                &directions(k),
                made.iter().map(|(field, shading)| (field, shading)),
                None,
                |_, _| {
                    count += 1;
                    Ok(Factors {
                        rank: count,
                        basis: Vec::new(),
                        corners: Vec::new(),
                        error: 0.0,
                    })
                },
            );
            assert_eq!(factors.expect("found").len(), reliefs.len());
            count
        };
        assert_eq!(found(16, &[(0.5, 0.8), (0.25, 0.8), (0.5, 0.8)]), 2);
        assert_eq!(found(16, &[(0.5, 0.8), (0.25, 0.8)]), 0);
        assert_eq!(found(16, &[(0.5, 0.7)]), 1);
        assert_eq!(found(16, &[(0.5, 0.8)]), 1);
        assert_eq!(found(32, &[(0.5, 0.8)]), 1);
    }

    /// What one run has found the next does not find again, unless its file is damaged, or what it
    /// holds does not fit.
    #[test]
    fn what_is_kept_is_not_found_again() {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let directions = Directions::new(16).expect("a number of slots");
        let (field, shading) = (field(0.5), shading(0.8));
        let factors = |rank: usize| Factors {
            rank,
            basis: (0..16 * rank).map(|i| Vec3::splat(i as f32)).collect(),
            corners: (0..16 * rank).map(|i| Vec4::splat(-(i as f32))).collect(),
            error: 0.25,
        };
        let run = |finds: usize| {
            let mut was_found = false;
            let reliefs = std::iter::once((&field, &shading));
            let found =
                KnownFactors::default().of(&directions, reliefs, Some(folder.path()), |_, _| {
                    was_found = true;
                    Ok(factors(finds))
                });
            let found = &found.expect("found")[0];
            assert_eq!(found.error, 0.25);
            assert_eq!(found.basis, factors(found.rank).basis);
            assert_eq!(found.corners, factors(found.rank).corners);
            (was_found, found.rank)
        };
        assert_eq!(run(4), (true, 4));
        assert_eq!(run(8), (false, 4));
        let path = visibility::file(folder.path(), &key(&directions, &field, &shading));
        let mut bytes = std::fs::read(&path).expect("kept");
        bytes[HEAD] ^= 1;
        std::fs::write(&path, bytes).expect("written");
        assert_eq!(run(8), (true, 8));
        assert_eq!(run(4), (false, 8));
        // The checksum is right, the rank is not.
        let wrong = Factors {
            rank: 4,
            ..factors(8)
        };
        wrong
            .save(folder.path(), &key(&directions, &field, &shading))
            .expect("written");
        assert_eq!(run(12), (true, 12));
    }
}
