//! Light from the sky.

mod gradation;
mod panorama;
mod part;
mod perez;
mod sun_position;

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::lights::is_unit;
pub use gradation::{Form, Gradation};
pub use panorama::Panorama;
pub use part::SkyPart;
pub use perez::Perez;
pub use sun_position::{Instant, SunAngles, sun_angles};

/// A sky about the scene, infinitely far.
#[derive(Debug, Clone, PartialEq)]
pub struct Sky {
    /// Unit: the zenith.
    pub up: DVec3,
    /// Unit, at right angles to `up`: azimuth 0. Azimuths grow towards the east, `north × up`.
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
    /// (1 + 2 sin γ) / 3 at the height γ above the horizon: the overcast sky of Moon and Spencer,
    /// number 16 of ISO 15469.
    TraditionalOvercast,
    /// Relative to the zenith, above the horizon.
    Gradation(Gradation),
    /// A picture of all directions.
    Picture(Arc<Panorama>),
}

/// Nodes of the quadrature over a dome, by sin² of the angle from the zenith and by azimuth.
const HEIGHTS: u32 = 512;
const AZIMUTHS: u32 = 1024;

impl Sky {
    /// Radiance from a direction of unit length, that is, where it comes from; W·m⁻²·sr⁻¹, RGB.
    pub fn radiance(&self, towards: DVec3) -> DVec3 {
        let scale = DVec3::from(self.scale.map(f64::from));
        let height = towards.dot(self.up);
        match &self.dome {
            Dome::Picture(picture) => {
                let east = self.north.cross(self.up);
                let azimuth = f64::atan2(towards.dot(east), towards.dot(self.north));
                scale * picture.bilinear(azimuth, height.clamp(-1.0, 1.0).acos())
            }
            _ if height < 0.0 => DVec3::ZERO,
            Dome::Uniform => scale,
            Dome::TraditionalOvercast => scale * ((1.0 + 2.0 * height) / 3.0),
            Dome::Gradation(gradation) => scale * gradation.relative(height, towards),
        }
    }

    /// Irradiance of the open ground, W·m⁻², RGB: the integral of the radiance times the cosine.
    pub fn horizontal(&self) -> [f64; 3] {
        use std::f64::consts::PI;
        let of_dome = match &self.dome {
            Dome::Uniform => DVec3::splat(PI),
            Dome::TraditionalOvercast => DVec3::splat(7.0 * PI / 9.0),
            Dome::Picture(picture) => picture.horizontal(),
            Dome::Gradation(gradation) => {
                let sum = (0..HEIGHTS).map(|i| {
                    // With u = sin² Z the cosine and the solid angle make ½ du dφ.
                    let u = (f64::from(i) + 0.5) / f64::from(HEIGHTS);
                    let cos = (1.0 - u).sqrt();
                    let of_azimuth = |j: u32| {
                        let turns = (f64::from(j) + 0.5) / f64::from(AZIMUTHS);
                        gradation.relative(cos, self.towards(DVec2::new(cos, turns)))
                    };
                    (0..AZIMUTHS).map(of_azimuth).sum::<f64>()
                });
                let nodes = f64::from(HEIGHTS) * f64::from(AZIMUTHS);
                DVec3::splat(PI * sum.sum::<f64>() / nodes)
            }
        };
        let scale = DVec3::from(self.scale.map(f64::from));
        (of_dome * scale).to_array()
    }

    /// Whether no light comes from it.
    pub fn is_black(&self) -> bool {
        let is_dark = match &self.dome {
            Dome::Picture(picture) => picture.texels.iter().all(|texel| *texel == [0.0; 3]),
            _ => false,
        };
        is_dark || self.scale == [0.0; 3]
    }

    /// The direction at a height and an azimuth, degrees.
    pub fn direction(&self, angles: SunAngles) -> DVec3 {
        angles.direction(self.up, self.north)
    }

    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        if !is_unit(self.up) || !is_unit(self.north) || self.up.dot(self.north).abs() > 1e-9 {
            return Err("up and north must be unit vectors at right angles".into());
        }
        if !self.scale.iter().all(|&c| c.is_finite() && c >= 0.0) {
            return Err("the radiance must be finite and not negative".into());
        }
        match &self.dome {
            Dome::Picture(picture) => picture.check(),
            Dome::Gradation(gradation) => gradation.check(),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests;
