//! A sitting bunny, sculpted from round cones.

use glam::DVec3;

use super::round_cone::{RoundCone, cone, figure};
use super::surface_nets::Implicit;

/// Parts on the plane x = 0. The bunny has units of its own; the head looks towards −z, y is up.
const TRUNK: [RoundCone; 5] = [
    // Rump to chest.
    cone([0.0, 0.34, 0.16], 0.30, [0.0, 0.52, -0.08], 0.235),
    cone([0.0, 0.50, -0.08], 0.23, [0.0, 0.72, -0.16], 0.15),
    // Skull and muzzle.
    cone([0.0, 0.88, -0.16], 0.185, [0.0, 0.86, -0.24], 0.17),
    cone([0.0, 0.83, -0.30], 0.125, [0.0, 0.81, -0.38], 0.085),
    // Tail.
    cone([0.0, 0.22, 0.50], 0.09, [0.0, 0.26, 0.53], 0.085),
];

/// Parts at positive x, mirrored to the other side.
const LIMBS: [RoundCone; 7] = [
    // Ear.
    cone([0.075, 1.00, -0.12], 0.050, [0.115, 1.30, -0.07], 0.074),
    cone([0.115, 1.30, -0.07], 0.074, [0.145, 1.53, -0.04], 0.038),
    // Cheek.
    cone([0.075, 0.80, -0.27], 0.085, [0.080, 0.80, -0.25], 0.085),
    // Haunch and hind foot.
    cone([0.20, 0.27, 0.16], 0.205, [0.215, 0.20, 0.08], 0.17),
    cone([0.215, 0.075, 0.10], 0.075, [0.225, 0.065, -0.26], 0.065),
    // Foreleg and paw.
    cone([0.105, 0.50, -0.20], 0.095, [0.095, 0.12, -0.27], 0.062),
    cone([0.095, 0.06, -0.27], 0.060, [0.095, 0.055, -0.34], 0.055),
];

const BLEND: f64 = 0.06;

/// See [`figure`].
pub(super) const BUNNY: Implicit<fn(DVec3) -> f64> = Implicit {
    distance: |p| figure(&TRUNK, &LIMBS, BLEND, p),
    low: DVec3::new(-0.48, -0.05, -0.52),
    high: DVec3::new(0.48, 1.62, 0.68),
};
