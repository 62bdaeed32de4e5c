//! Light from the sky.

use std::sync::Arc;

use glam::DVec3;

/// A sky about the scene, infinitely far.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Unit: the zenith.
    pub up: DVec3,
    /// Unit, at right angles to `up`: azimuth 0.
    pub north: DVec3,
    /// That the dome's radiance is multiplied by, RGB.
    pub scale: [f32; 3],
    pub dome: Dome,
}

/// Radiance by direction.
#[derive(Debug, Clone, PartialEq)]
pub enum Dome {
    /// 1 above the horizon.
    Uniform,
    /// A picture of all directions.
    Picture(Arc<Panorama>),
}

/// A picture of all directions, W·m⁻²·sr⁻¹, linear RGB: columns by azimuth, rows from the zenith.
#[derive(Debug, Clone, PartialEq)]
pub struct Panorama {
    pub width: u32,
    pub height: u32,
    /// `[row][column]`
    pub texels: Vec<[f32; 3]>,
}

impl Sky {
    /// Radiance from a direction of unit length, that is, where it comes from; W·m⁻²·sr⁻¹, RGB.
    pub fn radiance(&self, towards: DVec3) -> DVec3 {
        let scale = DVec3::from(self.scale.map(f64::from));
        match &self.dome {
            Dome::Uniform if towards.dot(self.up) >= 0.0 => scale,
            Dome::Uniform => DVec3::ZERO,
            Dome::Picture(_) => scale,
        }
    }
}
