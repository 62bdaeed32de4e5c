//! Twin of the pixel estimator: the paper's equations (1) and (2).

use crate::constants::{KIND_POINT, NONE};
use crate::math::hemicube::{Pixel, delta_form_factor, solid_angle_share};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;

/// Form factor from a source to each element, equation (1): the sum of the delta form factors of
/// its pixels. For a point light, the element's share of half the sphere. A back blocks light and
/// receives none.
pub fn form_factors(elements: &Elements, source: &Source, items: &[u32], n: u32) -> Vec<f64> {
    let mut sums = vec![0.0; elements.len()];
    for (i, &item) in items.iter().enumerate() {
        if item == NONE {
            continue;
        }
        let e = item as usize;
        if (source.eye - elements.centroid[e]).dot(elements.normal[e]) <= 0.0 {
            continue;
        }
        let pixel = Pixel {
            column: i as u32 % n,
            row: i as u32 / n,
        };
        sums[item as usize] += match source.kind {
            KIND_POINT => solid_angle_share(pixel, n),
            _ => delta_form_factor(pixel, n),
        };
    }
    sums
}

/// Irradiance of an element of area `area` from a unit of radiosity (for a point light, of
/// intensity) of the source, equation (2).
pub fn irradiance(source: &Source, form_factor: f64, area: f64) -> f64 {
    match source.kind {
        KIND_POINT => std::f64::consts::TAU * form_factor / area,
        _ => form_factor * source.area / area,
    }
}
