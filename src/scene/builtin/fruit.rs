//! Fruit as implicit shapes, about one unit in radius, y up.

use glam::DVec3;

use super::shapes::{RoundCone, cone, smooth_union};

/// A box around each of them.
pub(super) const LOW: DVec3 = DVec3::splat(-1.2);
pub(super) const HIGH: DVec3 = DVec3::splat(1.2);

/// A ball with a dimple where the stalk was.
pub(super) fn orange(p: DVec3) -> f64 {
    let aside = (p.x * p.x + p.z * p.z) / (0.22 * 0.22);
    let dimple = match p.y > 0.0 {
        true => (1.0 - aside).max(0.0).powi(2),
        false => 0.0,
    };
    p.length() - 1.0 + 0.05 * dimple
}

/// A ring without a hole, narrower below.
pub(super) fn apple(p: DVec3) -> f64 {
    let narrow = 1.0 + 0.16 * (0.5 - p.y).clamp(0.0, 1.3);
    let aside = p.x.hypot(p.z) * narrow - 0.38;
    aside.hypot(p.y * 0.72) - 0.60
}

/// Where the stalk of an apple starts.
pub(super) const APPLE_STALK: f64 = 0.62;

const PEAR: [RoundCone; 2] = [
    cone([0.0, -0.45, 0.0], 0.52, [0.0, 0.05, 0.0], 0.36),
    cone([0.0, 0.05, 0.0], 0.36, [0.0, 0.62, 0.0], 0.22),
];

pub(super) fn pear(p: DVec3) -> f64 {
    PEAR.iter()
        .map(|part| part.distance(p))
        .fold(f64::INFINITY, |a, b| smooth_union(a, b, 0.25))
}

/// Where the stalk of a pear starts.
pub(super) const PEAR_STALK: f64 = 0.82;

/// Lies on its side, bent about the y axis; its middle is towards −z.
pub(super) fn banana(p: DVec3) -> f64 {
    const BEND: f64 = 0.95;
    const HALF_TURN: f64 = 0.95;
    let p = p - DVec3::new(0.0, 0.0, 0.6);
    let angle = p.x.atan2(-p.z).clamp(-HALF_TURN, HALF_TURN);
    let on_arc = DVec3::new(BEND * angle.sin(), 0.0, -BEND * angle.cos());
    let along = angle / HALF_TURN;
    // Full in the middle, with a blunt tip at one end and a stalk at the other.
    let full = 1.0 - along.powi(4);
    p.distance(on_arc) - (0.065 + 0.125 * full)
}

/// Grapes of a bunch in three layers, each on the gaps of the one below: rows along x, how many across.
const LAYERS: [&[usize]; 3] = [&[1, 2, 3, 4, 3], &[1, 2, 3], &[1, 2]];
const GRAPE: f64 = 0.21;
/// Neighbours are pressed together a little, so that a bunch is one surface.
const APART: f64 = 1.9 * GRAPE;

pub(super) fn grapes(p: DVec3) -> f64 {
    let (row_apart, layer_apart) = (0.75_f64.sqrt() * APART, (2.0_f64 / 3.0).sqrt() * APART);
    let mut nearest = f64::INFINITY;
    for (layer, rows) in LAYERS.iter().enumerate() {
        for (row, &across) in rows.iter().enumerate() {
            for k in 0..across {
                let centre = DVec3::new(
                    (row as f64 + layer as f64 * 2.0 / 3.0) * row_apart - 0.75,
                    layer as f64 * layer_apart - 0.3,
                    (k as f64 - (across - 1) as f64 / 2.0) * APART,
                );
                nearest = smooth_union(nearest, p.distance(centre) - GRAPE, 0.03);
            }
        }
    }
    nearest
}
