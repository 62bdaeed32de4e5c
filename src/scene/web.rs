//! Shares of an intensity by direction.

use std::f64::consts::{PI, TAU};

/// Shares of an intensity by direction, interpolated linearly in both angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Web {
    /// Rows, evenly from θ = 0 to θ = π; at least 2.
    pub rows: u32,
    /// Columns, evenly from φ = 0 to φ = 2π, of which the last is the first again; 1 where the
    /// shares do not depend on φ.
    pub columns: u32,
    /// `[row][column]`, not negative.
    pub shares: Vec<f32>,
}

/// Rows of a spot's web across the edge of its cone, and the most rows of all: 0.05° each.
const ROWS_OF_EDGE: f64 = 64.0;
const MOST_ROWS: u32 = 20 * 180 + 1;

impl Web {
    /// A spot as glTF's `KHR_lights_punctual` recommends: 1 within the inner half angle, 0 beyond
    /// the outer, and ((cos θ − cos outer) / (cos inner − cos outer))² between; radians, 0 ≤ inner
    /// ≤ outer ≤ π.
    ///
    /// The linear interpolation is off by 10⁻⁴ at most where both angles are whole degrees more
    /// than 1° apart, and by 3·10⁻³ at an inner edge between two rows; edges are never sharper than
    /// a row of 0.05°.
    pub fn spot(inner: f64, outer: f64) -> Self {
        let (cos_inner, cos_outer) = (inner.cos(), outer.cos());
        let range = (cos_inner - cos_outer).max(LEAST_EDGE);
        let wanted = ROWS_OF_EDGE * PI / (outer - inner).max(1e-3);
        // A whole number of rows a degree, so that an edge at whole degrees lies on a row.
        let of_degree = (wanted / 180.0).ceil().max(1.0);
        let rows = ((180.0 * of_degree) as u32 + 1).min(MOST_ROWS);
        let share = |row: u32| {
            let theta = PI * f64::from(row) / f64::from(rows - 1);
            let within = ((theta.cos() - cos_outer) / range).clamp(0.0, 1.0);
            (within * within) as f32
        };
        Self {
            rows,
            columns: 1,
            shares: (0..rows).map(share).collect(),
        }
    }

    /// The share at θ in 0..=π and φ in 0..=2π.
    pub fn share(&self, theta: f64, phi: f64) -> f64 {
        let (row, below) = place(theta / PI, self.rows);
        let (column, left) = place(phi / TAU, self.columns);
        let at = |row: u32, column: u32| {
            let row = row.min(self.rows - 1) as usize;
            let column = column.min(self.columns - 1) as usize;
            f64::from(self.shares[row * self.columns as usize + column])
        };
        let of_row = |row: u32| at(row, column) + left * (at(row, column + 1) - at(row, column));
        of_row(row) + below * (of_row(row + 1) - of_row(row))
    }

    /// The integral of the shares over all directions, sr; exact for the interpolation.
    pub fn solid_angle(&self) -> f64 {
        let h = PI / f64::from(self.rows - 1);
        let columns = self.columns as usize;
        let of_row = |(r, row): (usize, &[f32])| {
            // The last column is the first again.
            let row = &row[..(columns - 1).max(1)];
            let mean = row.iter().map(|&s| f64::from(s)).sum::<f64>() / row.len() as f64;
            // The integral of the row's hat function times sin θ.
            let weight = match r == 0 || r + 1 == self.rows as usize {
                true => (h - h.sin()) / h,
                false => 2.0 * (h * r as f64).sin() * (1.0 - h.cos()) / h,
            };
            TAU * mean * weight
        };
        self.shares.chunks(columns).enumerate().map(of_row).sum()
    }

    /// The greatest share.
    pub fn highest(&self) -> f32 {
        self.shares.iter().fold(0.0, |most, &s| most.max(s))
    }

    /// φ runs the other way round.
    #[cfg(feature = "formats")]
    pub(super) fn mirrored(&self) -> Self {
        let rows = self.shares.chunks(self.columns as usize);
        Self {
            shares: rows.flat_map(|row| row.iter().rev().copied()).collect(),
            ..*self
        }
    }

    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        let count = self.rows as usize * self.columns as usize;
        if self.rows < 2 || self.columns < 1 || self.shares.len() != count {
            return Err("its web must have two rows and a column, and a share for each".into());
        }
        match self.shares.iter().all(|&s| s.is_finite() && s >= 0.0) {
            true => Ok(()),
            false => Err("the shares of its web must be finite and not negative".into()),
        }
    }
}

/// Of the cosines, as glTF has it: no edge is sharper.
const LEAST_EDGE: f64 = 0.001;

/// The node before a place in 0..=1 among `count` of even distance, and how far it is to the next.
fn place(at: f64, count: u32) -> (u32, f64) {
    if count == 1 {
        return (0, 0.0);
    }
    let at = at.clamp(0.0, 1.0) * f64::from(count - 1);
    let before = at.floor().min(f64::from(count - 2));
    (before as u32, at - before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solid_angles_have_closed_forms() {
        let even = Web {
            rows: 7,
            columns: 5,
            shares: vec![1.0; 35],
        };
        assert!((even.solid_angle() - 4.0 * PI).abs() < 1e-12);
        // The attenuation's integral is 2π (1 − cos inner) + 2π (cos inner − cos outer) / 3.
        // 5.1e-5: `cargo test --lib web -- --nocapture`.
        const MOST: f64 = 1.2e-4;
        let mut worst: f64 = 0.0;
        for (inner, outer) in [
            (20.0_f64, 30.0_f64),
            (0.0, 90.0),
            (44.0, 45.0),
            (0.0, 180.0),
        ] {
            let (a, b) = (inner.to_radians(), outer.to_radians());
            let exact = TAU * (1.0 - a.cos()) + TAU / 3.0 * (a.cos() - b.cos());
            let found = Web::spot(a, b).solid_angle();
            worst = worst.max((found / exact - 1.0).abs());
        }
        println!("solid angle of a spot: {worst:.1e}");
        assert!(worst < MOST, "{worst}");
    }

    #[test]
    fn a_spot_is_what_gltf_recommends() {
        // 2.5e-3, at the inner edge: `cargo test --lib web -- --nocapture`.
        const MOST: f64 = 5e-3;
        let (inner, outer) = (0.3_f64, 0.5_f64);
        let web = Web::spot(inner, outer);
        let worst = (0..100_000).map(|i| {
            let theta = PI * f64::from(i) / 100_000.0;
            let scale = 1.0 / f64::max(0.001, inner.cos() - outer.cos());
            let linear = (theta.cos() * scale - outer.cos() * scale).clamp(0.0, 1.0);
            (web.share(theta, 1.0) - linear * linear).abs()
        });
        let worst = worst.fold(0.0, f64::max);
        println!("share of a spot: {worst:.1e}");
        assert!(worst < MOST, "{worst}");
    }
}
