//! Twin of the pass that brings relief the light of near sources' parts.

use glam::{DVec3, Vec3};

use super::disc::points;
use crate::meso::{RANK, Relief};
use crate::structs::NearPart;

/// What one element with a relief receives, W·m⁻², RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Received {
    pub irradiance: DVec3,
    /// Moments in the element's frame, `[direction][colour]`.
    pub moments: Vec<[DVec3; 3]>,
    /// Σ E u_r(ω), `[rank]`, RGB.
    pub coefficients: [DVec3; RANK],
    /// Radiosity.
    pub reflected: DVec3,
}

/// Of the parts that `element` sees, where each sends so much, `[part of all near sources]`.
pub fn receive(relief: &Relief, element: usize, parts: &[NearPart], beyond: &[Vec3]) -> Received {
    let response = relief.response(element);
    let mut received = Received {
        irradiance: DVec3::ZERO,
        moments: vec![[DVec3::ZERO; 3]; relief.kept().count()],
        coefficients: [DVec3::ZERO; RANK],
        reflected: DVec3::ZERO,
    };
    for part in parts {
        let light = beyond[part.part as usize].as_dvec3();
        let factor = part.factor.as_dvec3();
        received.irradiance += factor.z * light;
        for point in points(factor) {
            let slot = relief.kept().slot_of(point.normalize());
            for c in 0..3 {
                received.moments[slot][c] += light[c] * point;
            }
            let functions = response.basis.at(point.normalize());
            for (sum, u) in received.coefficients.iter_mut().zip(functions) {
                *sum += u * point.z * light;
            }
        }
    }
    for (coefficient, albedo) in received.coefficients.iter().zip(&response.albedo) {
        received.reflected += *coefficient * albedo.as_dvec3();
    }
    received.reflected *= relief.scale[element].as_dvec3();
    received
}
