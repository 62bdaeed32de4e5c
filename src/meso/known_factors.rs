//! Factors of reliefs, kept while only the light changes.

use std::sync::{Arc, Mutex};

use sha2::{Digest, Sha256};

use super::{Factors, HeightField, Shading, Visibility};
use crate::error::Result;
use crate::math::directions::Directions;

/// A hash of everything the factors depend on.
type Key = [u8; 32];

/// Factors of the reliefs of a scene, in memory.
#[derive(Default)]
pub struct KnownFactors(Mutex<Vec<(Key, Arc<Factors>)>>);

/// The key of a relief with its shading and directions.
fn key(directions: &Directions, field: &HeightField, shading: &Shading) -> Key {
    let mut hash = Sha256::new();
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
    /// The factors of each relief, `[relief]`, computed by `find` where they are not known. Those of
    /// other reliefs are dropped.
    ///
    /// # Errors
    /// Those of `find`.
    pub fn of<'a>(
        &self,
        directions: &Directions,
        reliefs: impl Iterator<Item = (&'a HeightField, &'a Shading)>,
        mut find: impl FnMut(&HeightField, &Shading) -> Result<Factors>,
    ) -> Result<Vec<Arc<Factors>>> {
        let mut known = self.0.lock().unwrap_or_else(|e| e.into_inner());
        let before = std::mem::take(&mut *known);
        let mut factors = Vec::new();
        for (field, shading) in reliefs {
            let key = key(directions, field, shading);
            let same = |(of, _): &&(Key, Arc<Factors>)| *of == key;
            let found = match known.iter().chain(&before).find(same) {
                Some((_, found)) => Arc::clone(found),
                None => Arc::new(find(field, shading)?),
            };
            known.push((key, Arc::clone(&found)));
            factors.push(found);
        }
        Ok(factors)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

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
}
