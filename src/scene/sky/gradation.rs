//! Skies by a formula: the 15 of CIE S 011/E:2003 (ISO 15469:2004), and those of Perez.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::super::lights::is_unit;

/// Luminance φ(Z) f(χ) at the angles Z from the zenith and χ from the sun, over that of the zenith.
///
/// φ = 1 + a exp(b / cos Z), and f is that of the [`Form`]. Negative values of either count as 0.
#[derive(Debug, Clone, PartialEq)]
pub struct Gradation {
    form: Form,
    coefficients: [f64; 5],
    /// Unit.
    sun: DVec3,
    /// φ f of the zenith, or 1 where that is 0.
    zenith: f64,
}

/// The indicatrix f.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// 1 + c (exp(d χ) − exp(d π/2)) + e cos² χ.
    Cie,
    /// 1 + c exp(d χ) + e cos² χ.
    Perez,
}

/// a, b, c, d and e of CIE S 011/E:2003, Table 1, by number from 1.
const TYPES: [[f64; 5]; 15] = [
    [4.0, -0.70, 0.0, -1.0, 0.0],
    [4.0, -0.70, 2.0, -1.5, 0.15],
    [1.1, -0.80, 0.0, -1.0, 0.0],
    [1.1, -0.80, 2.0, -1.5, 0.15],
    [0.0, -1.0, 0.0, -1.0, 0.0],
    [0.0, -1.0, 2.0, -1.5, 0.15],
    [0.0, -1.0, 5.0, -2.5, 0.30],
    [0.0, -1.0, 10.0, -3.0, 0.45],
    [-1.0, -0.55, 2.0, -1.5, 0.15],
    [-1.0, -0.55, 5.0, -2.5, 0.30],
    [-1.0, -0.55, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 10.0, -3.0, 0.45],
    [-1.0, -0.32, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 16.0, -3.0, 0.30],
    [-1.0, -0.15, 24.0, -2.8, 0.15],
];

/// Numbers of skies that do not depend on the sun.
const WITHOUT_SUN: [u32; 3] = [1, 3, 5];

impl Gradation {
    /// Of a form and its coefficients a to e, with the zenith and the directions towards it and the
    /// sun, unit vectors. Where the zenith would be black the luminance is that of the formula.
    /// None where it is beyond every number.
    pub fn new(form: Form, coefficients: [f64; 5], up: DVec3, sun: DVec3) -> Option<Self> {
        let mut gradation = Self {
            form,
            coefficients,
            sun,
            zenith: 1.0,
        };
        let zenith = gradation.relative(1.0, up);
        // f is steepest at the sun and against it.
        let is_finite = |towards: DVec3| gradation.relative(1.0, towards).is_finite();
        if !(zenith.is_finite() && is_finite(sun) && is_finite(-sun)) {
            return None;
        }
        if zenith > 1e-9 {
            gradation.zenith = zenith;
        }
        Some(gradation)
    }

    /// A sky of CIE S 011 by its number, 1 to 15.
    pub fn cie(number: u32, up: DVec3, sun: DVec3) -> Option<Self> {
        let index = number.checked_sub(1)?;
        Self::new(Form::Cie, *TYPES.get(index as usize)?, up, sun)
    }

    /// Whether the sky of CIE S 011 of this number depends on the sun's place.
    pub fn cie_needs_sun(number: u32) -> bool {
        !WITHOUT_SUN.contains(&number)
    }

    pub fn form(&self) -> Form {
        self.form
    }

    /// a, b, c, d, e.
    pub fn coefficients(&self) -> [f64; 5] {
        self.coefficients
    }

    /// Unit, towards the sun.
    pub fn sun(&self) -> DVec3 {
        self.sun
    }

    /// The luminance over the zenith's, from a direction of unit length whose cosine with the
    /// zenith is 0 or more.
    pub fn relative(&self, cos_zenith: f64, towards: DVec3) -> f64 {
        let [a, b, c, d, e] = self.coefficients;
        // At the horizon exp(b / 0) is 0 for every b below 0.
        let phi = match a == 0.0 {
            true => 1.0,
            false => 1.0 + a * (b / cos_zenith.max(1e-9)).exp(),
        };
        // The angle by its tangent: the arc cosine is rough beside the sun, where c is steepest.
        let cos_chi = towards.dot(self.sun);
        let chi = f64::atan2(towards.cross(self.sun).length(), cos_chi);
        let level = match self.form {
            Form::Cie => 1.0 - c * (d * FRAC_PI_2).exp(),
            Form::Perez => 1.0,
        };
        let f = level + c * (d * chi).exp() + e * cos_chi * cos_chi;
        phi.max(0.0) * f.max(0.0) / self.zenith
    }

    /// The error is one clause.
    pub(super) fn check(&self) -> Result<(), String> {
        let [_, b, ..] = self.coefficients;
        if !self.coefficients.iter().all(|c| c.is_finite()) || b > 0.0 {
            return Err("its coefficients must be finite, and b not above 0".into());
        }
        match is_unit(self.sun) {
            true => Ok(()),
            false => Err("its sun must be a unit vector".into()),
        }
    }
}
