//! Lights that are no surfaces: points and beams, the sun, the sky.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use glam::DVec3;

use super::sky::Sky;
use super::web::Web;

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

    /// Whether a point light shines in a beam.
    pub fn have_beams(&self) -> bool {
        self.points.iter().any(|light| light.beam.is_some())
    }

    /// What there is besides points that shine evenly, in the plural: the pixel estimator and most
    /// peers of `bench pareto` do not know it.
    pub fn beyond_points(&self) -> Option<&'static str> {
        let kinds = [
            (!self.suns.is_empty(), "suns"),
            (self.sky.is_some(), "skies"),
            (self.have_beams(), "beams"),
        ];
        kinds.into_iter().find(|kind| kind.0).map(|kind| kind.1)
    }

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

    /// Power over intensity, sr: 4π without a beam.
    pub fn solid_angle(&self) -> f64 {
        (self.beam.as_ref()).map_or(4.0 * PI, |beam| beam.web.solid_angle())
    }

    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        if !self.position.is_finite() {
            return Err("position must be finite".into());
        }
        if !self.intensity.iter().all(|&c| c.is_finite() && c >= 0.0) {
            return Err("intensity must be finite and not negative".into());
        }
        self.beam.as_ref().map_or(Ok(()), Beam::check)
    }
}

impl Sun {
    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        if !is_unit(self.towards) {
            return Err("the direction towards it must be finite and not zero".into());
        }
        if !self.irradiance.iter().all(|&c| c.is_finite() && c >= 0.0) {
            return Err("irradiance must be finite and not negative".into());
        }
        if !(0.0..=90.0).contains(&self.angle) {
            return Err(format!("angle {} must be in 0..=90 degrees", self.angle));
        }
        Ok(())
    }
}

/// Whether a vector has the length 1, but for rounding.
pub(super) fn is_unit(v: DVec3) -> bool {
    (v.length_squared() - 1.0).abs() < 1e-9
}

/// A vector of length 1; one that has it but for rounding stays as it is, so that a scene that was
/// written reads back with the same bits. None of zero, or of what is not finite.
#[cfg(feature = "formats")]
pub(super) fn unit(v: DVec3) -> Option<DVec3> {
    match (v.length_squared() - 1.0).abs() < 1e-12 {
        true => Some(v),
        // Scaled first, so that no square overflows.
        false => (v / v.abs().max_element()).try_normalize(),
    }
}

/// A unit vector at right angles to `axis`, which is one: the part of `wanted` that is, or of the
/// first of x and z.
#[cfg(feature = "formats")]
pub(super) fn across(axis: DVec3, wanted: Option<DVec3>) -> DVec3 {
    let candidates = [wanted.unwrap_or(DVec3::X), DVec3::X, DVec3::Z];
    let flat = |v: DVec3| match v.dot(axis).abs() < 1e-12 {
        true => unit(v),
        false => {
            let v = unit(v)?;
            let part = v - v.dot(axis) * axis;
            (part.length() > 1e-6).then(|| part.normalize())
        }
    };
    (candidates.into_iter().find_map(flat)).unwrap_or_else(|| axis.any_orthonormal_vector())
}

impl Beam {
    fn check(&self) -> Result<(), String> {
        if !is_unit(self.axis) || !is_unit(self.zero) || self.axis.dot(self.zero).abs() > 1e-9 {
            return Err("the axes of its beam must be unit vectors at right angles".into());
        }
        self.web.check()
    }

    /// As it stands after a linear map of the scene; a map that mirrors mirrors the web too. None
    /// where the map takes the axis to zero.
    #[cfg(feature = "formats")]
    pub(super) fn turned(&self, by: glam::DMat3) -> Option<Self> {
        let axis = unit(by * self.axis)?;
        let mirrors = by.determinant() < 0.0;
        Some(Self {
            axis,
            zero: across(axis, Some(by * self.zero)),
            web: match mirrors && self.web.columns > 1 {
                true => Arc::new(self.web.mirrored()),
                false => self.web.clone(),
            },
        })
    }

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

#[cfg(all(test, feature = "formats"))]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn a_beam_turns_with_its_mesh_and_is_mirrored_by_mirrors() {
        // Another share in each direction.
        let (rows, columns) = (19, 13);
        let share = |i: u32| match i % columns {
            column if column == columns - 1 => i - column,
            _ => i,
        };
        let shares = (0..rows * columns).map(|i| share(i) as f32).collect();
        let beam = Beam {
            axis: DVec3::new(0.6, 0.8, 0.0),
            zero: DVec3::Z,
            web: Arc::new(Web {
                rows,
                columns,
                shares,
            }),
        };
        let turn = DMat3::from_rotation_y(0.7) * DMat3::from_rotation_x(0.3);
        for by in [
            turn,
            turn * 3.0,
            DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)) * turn,
            -turn,
        ] {
            let turned = beam.turned(by).unwrap();
            for d in [
                DVec3::new(0.3, 0.5, 0.9),
                DVec3::new(-0.3, 0.1, -0.9),
                DVec3::new(0.7, -0.5, 0.2),
            ] {
                let (before, after) = (beam.share(d), turned.share(by * d));
                // Rounding of f64.
                assert!((before - after).abs() < 1e-9 * before, "{before} {after}");
            }
        }
    }
}
