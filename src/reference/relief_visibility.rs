//! Twin of the relief's visibility: horizons and exchange of one tile's facets, in f64.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use crate::constants::{AZIMUTHS, NONE, RAY_STRATA};
use crate::meso::HeightField;

/// Horizons below this slope are not searched for, as in the shader.
const LEAST_SLOPE: f64 = 0.01;
const MOST_CROSSINGS: usize = 4096;

/// Tangent of the elevation of a facet's horizon in an azimuth.
pub fn horizon(field: &HeightField, facet: usize, azimuth: u32) -> f64 {
    let facet = field.facet(facet);
    let (sin, cos) = (TAU * f64::from(azimuth) / f64::from(AZIMUTHS)).sin_cos();
    let step = DVec2::new(cos, sin / field.aspect);
    let highest = field.highest();
    let mut slope = f64::NEG_INFINITY;
    for distance in crossings(facet.centre.truncate(), step).take(MOST_CROSSINGS) {
        let rise = field.height(facet.centre.truncate() + distance * step) - facet.centre.z;
        slope = slope.max(rise / distance);
        if highest - facet.centre.z <= distance * slope.max(LEAST_SLOPE) {
            break;
        }
    }
    slope
}

/// The facet that a facet's ray hits, NONE for the sky.
pub fn exchange(field: &HeightField, index: usize, ray: u32) -> u32 {
    let facet = field.facet(index);
    let direction = ray_direction(facet.normal, index as u32, ray);
    let step = DVec2::new(direction.x, direction.y / field.aspect);
    let from = facet.centre.truncate();
    let highest = field.highest();
    let mut before = 0.0;
    for distance in crossings(from, step).take(MOST_CROSSINGS) {
        let z = facet.centre.z + distance * direction.z;
        if z < field.height(from + distance * step) {
            let found = facet_at(field, from + 0.5 * (before + distance) * step);
            if found as usize != index {
                return found;
            }
        }
        if direction.z > 0.0 && z > highest {
            break;
        }
        before = distance;
    }
    NONE
}

/// The direction of a ray: cosine-weighted about the normal, one in each cell of a grid with an
/// offset of the facet's own.
pub fn ray_direction(n: DVec3, facet: u32, ray: u32) -> DVec3 {
    let strata = f64::from(RAY_STRATA);
    let u = (f64::from(ray % RAY_STRATA) + random(facet, 0)) / strata;
    let v = (f64::from(ray / RAY_STRATA) + random(facet, 1)) / strata;
    let (sin, cos) = (TAU * v).sin_cos();
    let tangent = DVec3::new(n.z, 0.0, -n.x).normalize();
    u.sqrt() * (cos * tangent + sin * n.cross(tangent)) + (1.0 - u).sqrt() * n
}

fn random(facet: u32, dimension: u32) -> f64 {
    let state = (2 * facet + dimension)
        .wrapping_mul(747_796_405)
        .wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    f64::from(((word >> 22) ^ word) >> 8) / 16_777_216.0
}

fn facet_at(field: &HeightField, at: DVec2) -> u32 {
    let low = at.floor();
    let f = at - low;
    let column = (low.x as i64).rem_euclid(i64::from(field.columns)) as u32;
    let row = (low.y as i64).rem_euclid(i64::from(field.rows)) as u32;
    2 * (row * field.columns + column) + u32::from(f.x + f.y > 1.0)
}

/// Distances at which a line crosses the edges of facets, in order.
fn crossings(from: DVec2, step: DVec2) -> impl Iterator<Item = f64> {
    let at = [from.x, from.y, from.x + from.y];
    let along = [step.x, step.y, step.x + step.y];
    let mut next = [0, 1, 2].map(|i| {
        let line = if along[i] > 0.0 {
            at[i].floor() + 1.0
        } else {
            at[i].floor()
        };
        if along[i].abs() < 1e-12 {
            f64::INFINITY
        } else {
            (line - at[i]) / along[i]
        }
    });
    let each = along.map(|a| 1.0 / a.abs());
    std::iter::from_fn(move || {
        let nearest = next[0].min(next[1]).min(next[2]);
        for i in 0..3 {
            if next[i] <= nearest {
                next[i] += each[i];
            }
        }
        nearest.is_finite().then_some(nearest)
    })
}
