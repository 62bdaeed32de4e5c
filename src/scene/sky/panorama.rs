//! Pictures of all directions.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

/// A picture of all directions, W·m⁻²·sr⁻¹, linear RGB: columns by azimuth, of which the first
/// begins at 0; rows from the zenith to the nadir.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    pub width: u32,
    pub height: u32,
    /// `[row][column]`
    pub texels: Vec<[f32; 3]>,
}

impl Panorama {
    /// Bilinear between the centres of the texels: at an azimuth, and at an angle from the zenith
    /// in 0..=π, radians.
    pub fn bilinear(&self, azimuth: f64, zenith: f64) -> DVec3 {
        let x = (azimuth / TAU).rem_euclid(1.0) * f64::from(self.width) - 0.5;
        let y = (zenith / PI * f64::from(self.height) - 0.5).max(0.0);
        let (left, top) = (x.floor(), y.floor().min(f64::from(self.height - 1)));
        let (right, below) = (x - left, y - top);
        let texel = |row: f64, column: f64| {
            let row = row.min(f64::from(self.height - 1)) as usize;
            let column = (column as i64).rem_euclid(i64::from(self.width)) as usize;
            DVec3::from(self.texels[row * self.width as usize + column].map(f64::from))
        };
        let of_row = |row: f64| texel(row, left).lerp(texel(row, left + 1.0), right);
        of_row(top).lerp(of_row(top + 1.0), below)
    }

    /// Irradiance of the open ground, exact for the interpolation.
    pub(super) fn horizontal(&self) -> DVec3 {
        let height = self.height as usize;
        let centre = |row: usize| (row as f64 + 0.5) * PI / height as f64;
        // The integrals of cos θ sin θ and of θ cos θ sin θ from 0.
        let even = |t: f64| (1.0 - (2.0 * t).cos()) / 4.0;
        let rising = |t: f64| ((2.0 * t).sin() - 2.0 * t * (2.0 * t).cos()) / 8.0;
        let mut weights = vec![0.0; height];
        // Above the first row the picture is that row.
        weights[0] += even(centre(0).min(FRAC_PI_2));
        for row in 0..height - 1 {
            let (from, to) = (centre(row), centre(row + 1));
            let end = to.min(FRAC_PI_2);
            if end > from {
                let all = even(end) - even(from);
                let second = (rising(end) - rising(from) - from * all) / (to - from);
                weights[row] += all - second;
                weights[row + 1] += second;
            }
        }
        // Likewise below the last.
        weights[height - 1] += even(FRAC_PI_2) - even(centre(height - 1).min(FRAC_PI_2));
        let rows = self.texels.chunks(self.width as usize).zip(weights);
        let of_row = |(row, weight): (&[[f32; 3]], f64)| {
            let texels = row.iter().map(|texel| DVec3::from(texel.map(f64::from)));
            weight * texels.sum::<DVec3>()
        };
        rows.map(of_row).sum::<DVec3>() * TAU / f64::from(self.width)
    }

    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        let count = self.width as usize * self.height as usize;
        if count == 0 || self.texels.len() != count {
            return Err("its picture must have width times height texels".into());
        }
        match self
            .texels
            .as_flattened()
            .iter()
            .all(|&c| c.is_finite() && c >= 0.0)
        {
            true => Ok(()),
            false => Err("the texels of its picture must be finite and not negative".into()),
        }
    }
}
