//! Parts of the sphere of directions.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::Sky;

/// Directions from `low` to `high`: sine of the height above the horizon, and turns of the azimuth,
/// in which areas are even.
#[derive(Debug, Clone, Copy)]
pub struct SkyPart {
    pub low: DVec2,
    pub high: DVec2,
}

impl SkyPart {
    /// Steradians.
    pub fn solid_angle(&self) -> f64 {
        let size = self.high - self.low;
        TAU * size.x * size.y
    }

    /// The place at shares of the way from low to high.
    pub fn at(&self, shares: DVec2) -> DVec2 {
        self.low + shares * (self.high - self.low)
    }

    pub fn corners(&self) -> [DVec2; 4] {
        let Self { low, high } = *self;
        [
            low,
            DVec2::new(low.x, high.y),
            DVec2::new(high.x, low.y),
            high,
        ]
    }

    pub fn quarters(&self) -> [Self; 4] {
        let half = 0.5 * (self.high - self.low);
        [DVec2::ZERO, DVec2::X, DVec2::Y, DVec2::ONE].map(|step| {
            let low = self.low + step * half;
            Self {
                low,
                high: low + half,
            }
        })
    }
}

impl Sky {
    /// The unit vector towards a place of a [`SkyPart`].
    pub fn towards(&self, DVec2 { x: sine, y: turns }: DVec2) -> DVec3 {
        let east = self.north.cross(self.up);
        let flat = (1.0 - sine * sine).max(0.0).sqrt();
        let (sin, cos) = (TAU * turns).sin_cos();
        sine * self.up + flat * (cos * self.north + sin * east)
    }
}
