//! Values of the texels of a surface, found on a coarse lattice of each chart, and on finer ones
//! where they were not what the coarser ones let expect.

use glam::Vec3;

use super::surface::Surface;
use super::texels::TexelMap;
use crate::error::{Error, Result};

/// Spacing of the coarsest lattice, texels.
const COARSEST: i64 = 8;

/// Lattices of this spacing and more are looked at as a whole.
pub(super) const WHOLE: i64 = 4;

/// What a lattice interpolates.
pub(super) trait Value: Clone {
    /// The mean of some.
    fn mean(of: &[&Self]) -> Self;
    /// How far two are apart.
    fn apart(&self, other: &Self) -> f32;
    /// What that compares to.
    fn size(&self) -> f32;
}

impl Value for Vec3 {
    fn mean(of: &[&Self]) -> Self {
        of.iter().copied().sum::<Self>() / of.len() as f32
    }

    fn apart(&self, other: &Self) -> f32 {
        (*self - *other).abs().max_element()
    }

    fn size(&self) -> f32 {
        self.max_element()
    }
}

/// The texels of a surface.
pub(super) struct Lattice<'a> {
    pub surface: &'a Surface,
    pub map: &'a TexelMap,
    /// Texels that have no value, `[texel]`.
    pub covered: &'a [bool],
    /// A difference from what was expected counts from this share of the value at a texel, and this
    /// share of the mean value, on.
    pub unexpected: [f32; 2],
}

/// Nearest texels, columns and rows apart.
pub(super) const BESIDE: [[i64; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

pub(super) fn too_early() -> Error {
    Error::Usage("stopped before there was a light map; nothing is written".into())
}

/// The texel of the same chart a step away.
pub(super) fn neighbour(
    surface: &Surface,
    map: &TexelMap,
    of: usize,
    step: [i64; 2],
) -> Option<usize> {
    let texel = &map.texels[of];
    let [x, y] = [0, 1].map(|k| i64::from(texel.at[k]) + step[k]);
    let chart = |t: usize| surface.chart[map.texels[t].triangle as usize];
    let found = map.find(texel.page, x, y);
    found.filter(|&t| chart(t) == chart(of))
}

impl Lattice<'_> {
    /// Values, `[texel]`; none of covered ones. `look` finds those of some texels, or of the first
    /// of them where it was stopped: others are then interpolated.
    ///
    /// # Errors
    /// Those of `look`; stopped before the lattices that are looked at as a whole.
    pub fn values<V: Value>(
        &self,
        mut look: impl FnMut(&[usize]) -> Result<Vec<V>>,
    ) -> Result<Vec<Option<V>>> {
        let count = self.map.texels.len();
        let mut values: Vec<Option<V>> = vec![None; count];
        // What was not expected of each, and of those that are interpolated what may be left.
        let mut surplus = vec![0.0_f32; count];
        let is_on = |t: usize, spacing: i64| {
            let on = |at: u32| i64::from(at) % spacing == 0;
            self.map.texels[t].at.iter().all(|&at| on(at))
        };
        let mut mean = 0.0;
        let mut spacing = COARSEST;
        while spacing >= 1 {
            let is_coarsest = spacing == COARSEST;
            let here = |t: &usize| {
                !self.covered[*t] && is_on(*t, spacing) && (is_coarsest || !is_on(*t, 2 * spacing))
            };
            let (mut wanted, mut expected) = (Vec::new(), Vec::new());
            for t in (0..count).filter(here) {
                let between = self.expect(t, spacing, &values, &surplus);
                match between.filter(|_| !is_coarsest) {
                    Some((value, left)) => {
                        let least = self.unexpected[0] * value.size() + self.unexpected[1] * mean;
                        match spacing < WHOLE && left <= least {
                            true => {
                                values[t] = Some(value);
                                surplus[t] = 0.25 * left;
                            }
                            false => {
                                wanted.push(t);
                                expected.push(Some(value));
                            }
                        }
                    }
                    None => {
                        wanted.push(t);
                        expected.push(None);
                    }
                }
            }
            let found = look(&wanted)?;
            for ((&t, expected), found) in wanted.iter().zip(&expected).zip(&found) {
                surplus[t] = match expected {
                    Some(value) => found.apart(value),
                    // Of the coarsest lattice no one asks; others stand at a border.
                    None if is_coarsest => 0.0,
                    None => f32::INFINITY,
                };
                values[t] = Some(found.clone());
            }
            if found.len() < wanted.len() && spacing >= WHOLE {
                return Err(too_early());
            }
            // Where it was stopped, what was expected; at borders, the value of what lies beside.
            let missing = wanted.iter().zip(expected).skip(found.len());
            for (&t, expected) in missing {
                let beside = BESIDE.into_iter().flat_map(|[i, j]| {
                    (1..=WHOLE).filter_map(move |far| {
                        neighbour(self.surface, self.map, t, [far * i, far * j])
                    })
                });
                values[t] = expected.or_else(|| beside.into_iter().find_map(|t| values[t].clone()));
            }
            if is_coarsest {
                let sum: f32 = found.iter().map(Value::size).sum();
                mean = sum / found.len().max(1) as f32;
            }
            spacing /= 2;
        }
        Ok(values)
    }

    /// What the lattice of twice this spacing lets expect at a texel between its own, and what was
    /// not expected of these; None at a border.
    fn expect<V: Value>(
        &self,
        t: usize,
        spacing: i64,
        values: &[Option<V>],
        surplus: &[f32],
    ) -> Option<(V, f32)> {
        let is_odd = |k: usize| i64::from(self.map.texels[t].at[k]) / spacing % 2 != 0;
        let s = spacing;
        let steps: &[[i64; 2]] = match (is_odd(0), is_odd(1)) {
            (true, true) => &[[s, s], [-s, s], [s, -s], [-s, -s]],
            (true, false) => &[[s, 0], [-s, 0]],
            _ => &[[0, s], [0, -s]],
        };
        let parents = steps.iter();
        let parents: Vec<usize> = parents
            .map(|&step| neighbour(self.surface, self.map, t, step))
            .collect::<Option<_>>()?;
        let of: Vec<&V> = (parents.iter())
            .map(|&parent| values[parent].as_ref())
            .collect::<Option<_>>()?;
        let most = parents.iter().map(|&p| surplus[p]).fold(0.0, f32::max);
        Some((V::mean(&of), most))
    }
}
