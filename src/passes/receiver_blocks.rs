//! Bounds of neighbouring elements, by which `sort_receivers.comp` passes over those that see
//! nothing of a source as a whole.

use std::ops::Range;

use glam::DVec3;

use super::types::ReceiverBlock;
use crate::constants::GROUP;
use crate::mesh::elements::Elements;

/// Room for the rounding to f32 and of the shader.
const MARGIN: f64 = 1e-7;

/// Blocks of elements without relief, then of those with it, which come last.
pub fn receiver_blocks(elements: &Elements) -> Vec<ReceiverBlock> {
    let plain = (0..elements.len())
        .find(|&e| elements.is_meso(e))
        .unwrap_or(elements.len());
    let blocks = |range: Range<usize>| {
        let end = range.end;
        let starts = range.step_by(GROUP as usize);
        starts.map(move |first| bound(elements, first..end.min(first + GROUP as usize)))
    };
    blocks(0..plain)
        .chain(blocks(plain..elements.len()))
        .collect()
}

fn bound(elements: &Elements, range: Range<usize>) -> ReceiverBlock {
    let centroids = &elements.centroid[range.clone()];
    let normals = &elements.normal[range.clone()];
    let (low, high) = centroids
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), &c| {
            (low.min(c), high.max(c))
        });
    let centre = low.midpoint(high);
    let axis = normals.iter().sum::<DVec3>().normalize_or(normals[0]);
    let most = |of: &dyn Fn(DVec3) -> f64| centroids.iter().map(|&c| of(c)).fold(0.0, f64::max);
    let radius = most(&|c| c.distance(centre)) * (1.0 + 1e-6) + MARGIN;
    let half_height = most(&|c| (c - centre).dot(axis).abs()) + MARGIN;
    // By the sine: the cosine of a small angle says little.
    let sine = (normals.iter().map(|n| n.cross(axis).length())).fold(0.0, f64::max);
    let widest = normals.iter().map(|n| n.dot(axis)).fold(1.0, f64::min);
    let angle = if widest > 0.0 {
        sine.asin()
    } else {
        f64::INFINITY
    };
    let angle = (angle + MARGIN).min(std::f64::consts::FRAC_PI_2);
    let largest = range.map(|e| elements.radius(e)).fold(0.0, f64::max);
    ReceiverBlock {
        centre: centre.as_vec3(),
        radius: radius as f32,
        axis: axis.as_vec3(),
        half_height: half_height as f32,
        cone_sin: angle.sin() as f32,
        cone_cos: angle.cos() as f32,
        largest: (largest * (1.0 + 1e-6)) as f32,
    }
}
