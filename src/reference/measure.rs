//! Twin of the measuring pass: unshot power of every source.

use glam::{DVec3, Vec3};

use crate::constants::KIND_POINT;
use crate::elements::Elements;
use crate::sources::Source;

/// What a source has shot: reflected radiosity, and whether its emission went out.
#[derive(Debug, Clone, Copy, Default)]
pub struct Shot {
    pub reflected: DVec3,
    pub emission: bool,
}

/// Unshot reflected radiosity and unshot power (internal units, summed over the colours) of each source.
pub fn measure(
    elements: &Elements,
    sources: &[Source],
    irradiance: &[Vec3],
    shot: &[Shot],
) -> Vec<(DVec3, f64)> {
    sources
        .iter()
        .zip(shot)
        .map(|(source, shot)| {
            let emitted = if shot.emission {
                0.0
            } else {
                source.emitted_power()
            };
            if source.kind == KIND_POINT {
                return (DVec3::ZERO, emitted);
            }
            let range = source.first_element as usize
                ..(source.first_element + source.element_count) as usize;
            let area: f64 = range.clone().map(|e| elements.area[e]).sum();
            let reflected = range
                .map(|e| (elements.reflectance[e] * irradiance[e]).as_dvec3() * elements.area[e])
                .sum::<DVec3>()
                / area;
            let unshot = reflected - shot.reflected;
            (unshot, emitted + source.area * unshot.abs().element_sum())
        })
        .collect()
}
