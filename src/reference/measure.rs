//! Twin of the measuring pass: the radiosity that every source reflects.

use glam::{DVec3, Vec3};

use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// Mean, by the weights of [`crate::mesh::near::NearPairs`], over a source's members of reflectance
/// times irradiance, RGB, `[source]`.
pub fn measure(
    elements: &Elements,
    weights: &[f64],
    sources: &[Source],
    irradiance: &[Vec3],
) -> Vec<DVec3> {
    let of_source = |source: &Source| {
        if !source.is_surface() {
            return DVec3::ZERO;
        }
        let range = source.members();
        let area: f64 = range.clone().map(|e| weights[e]).sum();
        let reflected = |e: usize| elements.reflectance[e] * irradiance[e];
        let sum: DVec3 = range.map(|e| reflected(e).as_dvec3() * weights[e]).sum();
        sum / area
    };
    sources.iter().map(of_source).collect()
}
