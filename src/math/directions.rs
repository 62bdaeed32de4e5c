//! Directions ↔ slots: the hemisphere about z in K cells of equal solid angle. Pure mathematics in
//! f64; `shaders/shared/directions.glsl` is the same in f32.
//!
//! The square −1..1 × −1..1 is laid over the hemisphere by the concentric map (Shirley and Chiu
//! 1997), which preserves areas: its cells are the slots. The K of the paper are 4 × 4, 4 × 8 and 8
//! × 8; 8 × 16 and 16 × 16 are finer. Slot index: `row · columns + column`.

use std::f64::consts::FRAC_PI_4;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

use crate::constants::FINE_DIRECTIONS;
use crate::error::{Error, Result};

/// The division of the hemisphere into slots.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Directions {
    pub columns: u32,
    pub rows: u32,
}

/// The direction that is nearest to another; the first of several.
pub fn nearest_of(directions: &[DVec3], to: DVec3) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (k, direction) in directions.iter().enumerate() {
        let cosine = direction.dot(to);
        if cosine > best.1 {
            best = (k, cosine);
        }
    }
    best.0
}

/// Cells along a side of the square for integrals over slots: the cells of every K are unions of
/// whole ones.
pub const FINE: u32 = FINE_DIRECTIONS;

impl Directions {
    /// # Errors
    /// A number of slots other than 16, 32, 64, 128 and 256.
    pub fn new(slots: u32) -> Result<Self> {
        match slots {
            16 => Ok(Self {
                columns: 4,
                rows: 4,
            }),
            32 => Ok(Self {
                columns: 4,
                rows: 8,
            }),
            64 => Ok(Self {
                columns: 8,
                rows: 8,
            }),
            128 => Ok(Self {
                columns: 8,
                rows: 16,
            }),
            256 => Ok(Self {
                columns: 16,
                rows: 16,
            }),
            other => Err(Error::Usage(format!(
                "--directions {other}: must be 16, 32, 64, 128 or 256"
            ))),
        }
    }

    pub fn count(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// The slot of a direction (unit, z up); a direction below the horizon counts as on it.
    pub fn slot_of(&self, direction: DVec3) -> usize {
        let [column, row] = self.cell_coordinates(direction).to_array();
        let cell = |at: f64, size: u32| (at.max(0.0) as u32).min(size - 1);
        (cell(row, self.rows) * self.columns + cell(column, self.columns)) as usize
    }

    /// The slot whose middle is nearest to a direction (unit, z up); the first of several.
    pub fn nearest(&self, direction: DVec3) -> usize {
        nearest_of(&self.centres(), direction)
    }

    /// [`Self::centre`] of each slot.
    pub fn centres(&self) -> Vec<DVec3> {
        (0..self.count()).map(|slot| self.centre(slot)).collect()
    }

    /// The direction at the centre of a slot's cell.
    pub fn centre(&self, slot: usize) -> DVec3 {
        let (column, row) = (slot as u32 % self.columns, slot as u32 / self.columns);
        from_square(DVec2::new(
            (2.0 * f64::from(column) + 1.0) / f64::from(self.columns) - 1.0,
            (2.0 * f64::from(row) + 1.0) / f64::from(self.rows) - 1.0,
        ))
    }

    /// The four slots about a direction with their weights, bilinear between the cells' centres and
    /// clamped at the border of the square; the weights sum to 1, and one slot may occur twice.
    pub fn bilinear(&self, direction: DVec3) -> [(usize, f64); 4] {
        let at = self.cell_coordinates(direction) - 0.5;
        let split = |at: f64, size: u32| {
            let held = at.clamp(0.0, f64::from(size - 1));
            let low = (held as u32).min(size.saturating_sub(2));
            (low, held - f64::from(low))
        };
        let ((column, x), (row, y)) = (split(at.x, self.columns), split(at.y, self.rows));
        let slot = |c: u32, r: u32| ((row + r) * self.columns + column + c) as usize;
        [
            (slot(0, 0), (1.0 - x) * (1.0 - y)),
            (slot(1, 0), x * (1.0 - y)),
            (slot(0, 1), (1.0 - x) * y),
            (slot(1, 1), x * y),
        ]
    }

    /// The fine cells with their slots.
    pub fn fine(&self) -> impl Iterator<Item = (FineCell, usize)> {
        let each = *self;
        FineCell::all().map(move |cell| {
            let column = cell.column * each.columns / FINE;
            let row = cell.row * each.rows / FINE;
            (cell, (row * each.columns + column) as usize)
        })
    }

    /// Irradiance of a facet with unit normal `n` from the vector moments of the slots, `[slot]`: n
    /// · m_k of a slot above the facet's horizon. Of one that the horizon crosses, the share above
    /// it of light spread evenly over the slot, since the positive part of n · m_k alone loses up
    /// to 2.3 % of a uniform sky at K = 32 and 45°.
    pub fn irradiance(&self, moments: &[DVec3], n: DVec3) -> f64 {
        let mut above = vec![(DVec3::ZERO, 0.0, f64::INFINITY); self.count()];
        for (cell, slot) in self.fine() {
            let (sum, positive, least) = &mut above[slot];
            let cosine = n.dot(cell.direction);
            *sum += cell.direction;
            *positive += cosine.max(0.0);
            *least = least.min(cosine);
        }
        above
            .iter()
            .zip(moments)
            .map(|(&(sum, positive, least), m)| {
                if least >= 0.0 {
                    m.dot(n).max(0.0)
                } else {
                    positive * m.dot(sum).max(0.0) / sum.length_squared()
                }
            })
            .sum()
    }

    /// Place in the grid of cells, 0..columns × 0..rows.
    fn cell_coordinates(&self, direction: DVec3) -> DVec2 {
        let size = DVec2::new(f64::from(self.columns), f64::from(self.rows));
        (to_square(direction) * 0.5 + 0.5) * size
    }
}

/// One of the FINE² cells of equal solid angle that integrals over slots are summed over.
#[derive(Debug, Clone, Copy)]
pub struct FineCell {
    pub column: u32,
    pub row: u32,
    /// Through the centre of its square.
    pub direction: DVec3,
    /// z from the cell's outer to its inner rim.
    pub z_range: [f64; 2],
}

impl FineCell {
    /// Row-major.
    pub fn all() -> impl Iterator<Item = Self> {
        (0..FINE * FINE).map(|i| {
            let (column, row) = (i % FINE, i / FINE);
            let centre = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(FINE) - 1.0;
            let square = DVec2::new(centre(column), centre(row));
            let r = square.abs().max_element();
            let half = 1.0 / f64::from(FINE);
            let z = |r: f64| 1.0 - r * r;
            Self {
                column,
                row,
                direction: from_square(square),
                z_range: [z(r + half), z(r - half)],
            }
        })
    }
}

/// From the square −1..1 to the hemisphere z ≥ 0.
pub fn from_square(square: DVec2) -> DVec3 {
    let (a, b) = (square.x, square.y);
    if a == 0.0 && b == 0.0 {
        return DVec3::Z;
    }
    let (r, angle) = if a.abs() > b.abs() {
        (a, FRAC_PI_4 * (b / a))
    } else {
        (b, 2.0 * FRAC_PI_4 - FRAC_PI_4 * (a / b))
    };
    let flat = r * (2.0 - r * r).max(0.0).sqrt();
    DVec3::new(flat * angle.cos(), flat * angle.sin(), 1.0 - r * r)
}

/// From the hemisphere to the square; a direction below the horizon is moved to the nearest on it.
pub fn to_square(direction: DVec3) -> DVec2 {
    let r = (1.0 - direction.z.clamp(0.0, 1.0)).sqrt();
    let DVec3 { x, y, .. } = direction;
    // Quarters of the circle about ±x and ±y.
    if x == 0.0 && y == 0.0 {
        DVec2::ZERO
    } else if x.abs() > y.abs() {
        let a = r.copysign(x);
        DVec2::new(a, a * (y / x).atan() / FRAC_PI_4)
    } else {
        let b = r.copysign(y);
        DVec2::new(b * (x / y).atan() / FRAC_PI_4, b)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    const ALL: [u32; 5] = [16, 32, 64, 128, 256];

    #[test]
    fn round_trips() {
        for k in ALL {
            let d = Directions::new(k).expect("a number of the paper");
            for slot in 0..d.count() {
                assert_eq!(d.slot_of(d.centre(slot)), slot);
            }
            for (cell, slot) in d.fine() {
                assert_eq!(d.slot_of(cell.direction), slot);
                let back = from_square(to_square(cell.direction));
                assert!(back.distance(cell.direction) < 1e-12, "{cell:?}");
                let weights: f64 = d.bilinear(cell.direction).iter().map(|w| w.1).sum();
                assert!((weights - 1.0).abs() < 1e-12);
            }
        }
        assert!(Directions::new(17).is_err());
    }

    /// The nearest middle is that of a direction's own cell or of one of the eight about it: those
    /// that `bin_shots.comp` looks at.
    #[test]
    fn the_nearest_middle_is_close_by() {
        let mut others = 0;
        for k in ALL {
            let d = Directions::new(k).expect("a number of the paper");
            for cell in FineCell::all() {
                let cell_of = |slot: usize| [slot as u32 % d.columns, slot as u32 / d.columns];
                let (own, nearest) = (d.slot_of(cell.direction), d.nearest(cell.direction));
                let [a, b] = [own, nearest].map(cell_of);
                assert!(
                    a[0].abs_diff(b[0]) <= 1 && a[1].abs_diff(b[1]) <= 1,
                    "{cell:?}"
                );
                others += u32::from(own != nearest);
            }
        }
        assert!(others > 0);
    }

    /// Cells of one solid angle: the share of random directions in each is 1/K.
    #[test]
    fn equal_solid_angles() {
        for k in ALL {
            let d = Directions::new(k).expect("a number of the paper");
            let mut hits = vec![0_u32; d.count()];
            let (n, m) = (400, 1600);
            for i in 0..n {
                for j in 0..m {
                    // Uniform in z and azimuth.
                    let z = (f64::from(i) + 0.5) / f64::from(n);
                    let (sin, cos) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(m)).sin_cos();
                    let flat = (1.0 - z * z).sqrt();
                    hits[d.slot_of(DVec3::new(flat * cos, flat * sin, z))] += 1;
                }
            }
            // A cell's border is some 4 · √(n m / K) samples long, half of which may fall aside.
            let expected = f64::from(n * m) / d.count() as f64;
            for h in hits {
                assert!(
                    (f64::from(h) - expected).abs() < 3.0 * expected.sqrt(),
                    "{h} of {expected}"
                );
            }
        }
    }

    /// A facet tilted 45° under a uniform sky of radiance 1: E = π (1 + cos τ)/2, in every azimuth.
    #[test]
    fn tilted_facet_under_a_uniform_sky() {
        // Measured: 0.03, 0.03, 0.04 %.
        const MOST: f64 = 8e-4;
        for k in [16, 32, 64] {
            let d = Directions::new(k).expect("a number of the paper");
            // A sum over 512² cells, independent of the one inside.
            let (mut moments, size) = (vec![DVec3::ZERO; d.count()], 512);
            let centre = |i: u32| (2.0 * f64::from(i) + 1.0) / f64::from(size) - 1.0;
            for i in 0..size * size {
                let direction = from_square(DVec2::new(centre(i % size), centre(i / size)));
                moments[d.slot_of(direction)] += 2.0 * PI / f64::from(size * size) * direction;
            }
            let exact = PI * (1.0 + FRAC_PI_4.cos()) / 2.0;
            let largest = (0..360)
                .map(|degrees| {
                    let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
                    let n = DVec3::new(cos, sin, 1.0) * FRAC_PI_4.cos();
                    (d.irradiance(&moments, n) / exact - 1.0).abs()
                })
                .fold(0.0, f64::max);
            println!(
                "K = {k}: tilted facet, largest error {:.2} %",
                100.0 * largest
            );
            assert!(largest <= MOST, "K = {k}: {largest}");
        }
    }
}
