//! Lights that are no surfaces: points and beams, the sun, the sky.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::DVec3;

use super::sky::Sky;

/// The lights of a scene besides its emitting surfaces.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Lights {
    pub points: Vec<PointLight>,
    pub suns: Vec<Sun>,
    pub sky: Option<Sky>,
}

/// A point light: irradiance at distance d is `intensity · share · cos θ / d²`.
#[derive(Debug, Clone, PartialEq)]
pub struct PointLight {
    pub name: String,
    /// Scene units.
    pub position: DVec3,
    /// Radiant intensity, W·sr⁻¹, RGB.
    pub intensity: [f32; 3],
    /// How the intensity depends on the direction; without it, it does not.
    pub beam: Option<Beam>,
}

/// A distribution of intensity about an axis: a spot, or a luminaire that was measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Beam {
    /// Unit: where θ is 0.
    pub axis: DVec3,
    /// Unit, at right angles to the axis: where φ is 0. φ grows towards `axis × zero`.
    pub zero: DVec3,
    pub web: Arc<Web>,
}

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

/// Parallel light from a disc at an infinite distance.
#[derive(Debug, Clone, PartialEq)]
pub struct Sun {
    pub name: String,
    /// Unit: where the middle of the disc is.
    pub towards: DVec3,
    /// Irradiance of a surface that faces it, W·m⁻², RGB.
    pub irradiance: [f32; 3],
    /// Diameter, degrees; 0 makes sharp shadows.
    pub angle: f64,
}

impl Lights {
    pub const NONE: Self = Self {
        points: Vec::new(),
        suns: Vec::new(),
        sky: None,
    };

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty() && self.suns.is_empty() && self.sky.is_none()
    }
}

impl From<PointLight> for Lights {
    fn from(light: PointLight) -> Self {
        Self {
            points: vec![light],
            ..Self::default()
        }
    }
}

impl PointLight {
    /// Share of the intensity in a direction, which need not be of unit length.
    pub fn share(&self, direction: DVec3) -> f64 {
        self.beam.as_ref().map_or(1.0, |beam| beam.share(direction))
    }
}

impl Beam {
    /// Share of the intensity in a direction, which need not be of unit length.
    pub fn share(&self, direction: DVec3) -> f64 {
        let along = direction.dot(self.axis);
        let x = direction.dot(self.zero);
        let y = direction.dot(self.axis.cross(self.zero));
        let theta = f64::atan2(x.hypot(y), along);
        let phi = f64::atan2(y, x);
        self.web
            .share(theta, if phi < 0.0 { phi + TAU } else { phi })
    }
}

impl Web {
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
}

/// The node before a place in 0..=1 among `count` of even distance, and how far it is to the next.
fn place(at: f64, count: u32) -> (u32, f64) {
    if count == 1 {
        return (0, 0.0);
    }
    let at = at.clamp(0.0, 1.0) * f64::from(count - 1);
    let before = at.floor().min(f64::from(count - 2));
    (before as u32, at - before)
}
