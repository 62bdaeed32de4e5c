//! Twin of the pass that brings relief the light of near sources' parts.

use glam::{DVec3, Vec3};

use super::disc::points;
use crate::meso::Relief;
use crate::structs::NearPart;

/// What one element with a relief receives, W·m⁻², RGB.
#[derive(Debug, Clone, PartialEq)]
pub struct Received {
    pub irradiance: DVec3,
    /// Moments in the element's frame, `[direction][colour]`.
    pub moments: Vec<[DVec3; 3]>,
    /// Radiosity.
    pub reflected: DVec3,
}

/// Of the parts that `element` sees, where each sends so much, `[part of all near sources]`.
pub fn receive(relief: &Relief, element: usize, parts: &[NearPart], beyond: &[Vec3]) -> Received {
    let response = relief.response(element);
    let mut received = Received {
        irradiance: DVec3::ZERO,
        moments: vec![[DVec3::ZERO; 3]; relief.directions.count()],
        reflected: DVec3::ZERO,
    };
    for part in parts {
        let light = beyond[part.part as usize].as_dvec3();
        let factor = part.factor.as_dvec3();
        received.irradiance += factor.z * light;
        for point in points(factor) {
            let slot = relief.directions.slot_of(point.normalize());
            for c in 0..3 {
                received.moments[slot][c] += light[c] * point;
                let albedo = response.albedo[slot][c].as_dvec3();
                received.reflected[c] += albedo.dot(point) * light[c];
            }
        }
    }
    received.reflected *= relief.scale[element].as_dvec3();
    received
}
