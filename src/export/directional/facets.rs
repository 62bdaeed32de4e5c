//! Facets by whose irradiance light by direction is fitted: the surface itself, and such tilted by
//! up to 60°.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::solver::Arriving;

/// Degrees, each in so many azimuths.
const TILTS: [f64; 4] = [15.0, 30.0, 45.0, 60.0];
const AZIMUTHS: usize = 16;

pub(super) const FACETS: usize = 1 + TILTS.len() * AZIMUTHS;

/// Normals about z, the surface's first, and their weights: the solid angles for which they stand.
pub(super) fn facets() -> [(DVec3, f64); FACETS] {
    std::array::from_fn(|i| match i.checked_sub(1) {
        None => (DVec3::Z, 0.0),
        Some(i) => {
            let (sin, cos) = TILTS[i / AZIMUTHS].to_radians().sin_cos();
            let (y, x) = (TAU * (i % AZIMUTHS) as f64 / AZIMUTHS as f64).sin_cos();
            (DVec3::new(sin * x, sin * y, cos), sin)
        }
    })
}

/// Their normals in the axes of the scene, about the third of these.
pub(super) fn turned(axes: [DVec3; 3]) -> [DVec3; FACETS] {
    facets().map(|(n, _)| n.x * axes[0] + n.y * axes[1] + n.z * axes[2])
}

/// Adds light to the irradiance of each facet, whose normals are [`turned`].
pub(super) fn add(sums: &mut [DVec3; FACETS], turned: &[DVec3; FACETS], from: Arriving) {
    for (sum, facet) in sums.iter_mut().zip(turned) {
        *sum += from.light * from.way.dot(*facet).max(0.0);
    }
}
