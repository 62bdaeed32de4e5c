//! A sitting rabbit, sculpted from round cones. The head looks towards −z, y is up; about 1.2 high.

use glam::DVec3;

use super::shapes::{RoundCone, cone, smooth_union};

/// On the plane x = 0.
const TRUNK: [RoundCone; 5] = [
    // Rump and back.
    cone([0.0, 0.34, 0.17], 0.30, [0.0, 0.37, -0.12], 0.235),
    // Chest and neck.
    cone([0.0, 0.42, -0.16], 0.20, [0.0, 0.64, -0.27], 0.145),
    // Skull and muzzle.
    cone([0.0, 0.75, -0.31], 0.170, [0.0, 0.71, -0.43], 0.120),
    cone([0.0, 0.71, -0.43], 0.115, [0.0, 0.68, -0.50], 0.070),
    // Tail.
    cone([0.0, 0.27, 0.50], 0.100, [0.0, 0.32, 0.53], 0.080),
];

/// On the side of positive x; the other side mirrors them.
const LIMBS: [RoundCone; 7] = [
    // Ear.
    cone([0.070, 0.86, -0.26], 0.052, [0.115, 1.06, -0.20], 0.068),
    cone([0.115, 1.06, -0.20], 0.068, [0.140, 1.24, -0.13], 0.032),
    // Cheek.
    cone([0.065, 0.69, -0.40], 0.085, [0.05, 0.67, -0.45], 0.065),
    // Haunch and hind foot.
    cone([0.17, 0.27, 0.17], 0.220, [0.22, 0.20, 0.02], 0.165),
    cone([0.22, 0.068, 0.08], 0.068, [0.24, 0.060, -0.22], 0.060),
    // Foreleg and paw.
    cone([0.105, 0.36, -0.24], 0.090, [0.105, 0.08, -0.33], 0.058),
    cone([0.105, 0.062, -0.33], 0.060, [0.105, 0.055, -0.41], 0.055),
];

/// Width of the fillets between parts.
const BLEND: f64 = 0.05;
/// A box around all of it.
pub(super) const LOW: DVec3 = DVec3::new(-0.45, -0.03, -0.62);
pub(super) const HIGH: DVec3 = DVec3::new(0.45, 1.32, 0.68);

/// Negative inside, nearly the distance.
pub(super) fn distance(p: DVec3) -> f64 {
    let aside = DVec3::new(p.x.abs(), p.y, p.z);
    let trunk = TRUNK.iter().map(|part| part.distance(p));
    let limbs = LIMBS.iter().map(|part| part.distance(aside));
    trunk
        .chain(limbs)
        .fold(f64::INFINITY, |a, b| smooth_union(a, b, BLEND))
}
