//! A standing horse, sculpted from round cones: the statue where no mesh is given.

use glam::DVec3;

use super::round_cone::{RoundCone, cone, figure};
use super::surface_nets::{Implicit, Net, Surface};
use crate::scene::assemble::Mesh;

/// Parts on the plane x = 0.
const TRUNK: [RoundCone; 10] = [
    // Chest, barrel, croup.
    cone([0.0, 1.13, -0.50], 0.27, [0.0, 1.10, 0.00], 0.275),
    cone([0.0, 1.10, 0.00], 0.275, [0.0, 1.17, 0.48], 0.27),
    // Neck and crest.
    cone([0.0, 1.24, -0.58], 0.22, [0.0, 1.72, -0.95], 0.115),
    cone([0.0, 1.45, -0.52], 0.07, [0.0, 1.86, -0.86], 0.06),
    // Skull, jaw, muzzle.
    cone([0.0, 1.76, -0.98], 0.115, [0.0, 1.50, -1.30], 0.075),
    cone([0.0, 1.66, -1.00], 0.105, [0.0, 1.55, -1.16], 0.08),
    cone([0.0, 1.49, -1.29], 0.080, [0.0, 1.45, -1.34], 0.07),
    // Tail.
    cone([0.0, 1.34, 0.70], 0.06, [0.0, 1.22, 0.88], 0.07),
    cone([0.0, 1.22, 0.88], 0.07, [0.0, 0.85, 0.97], 0.08),
    cone([0.0, 0.85, 0.97], 0.08, [0.0, 0.50, 0.93], 0.045),
];

/// Parts at positive x, mirrored to the other side.
const LIMBS: [RoundCone; 9] = [
    // Ear.
    cone([0.055, 1.86, -0.95], 0.045, [0.075, 1.97, -0.96], 0.030),
    // Foreleg: shoulder, knee, fetlock, hoof.
    cone([0.14, 1.02, -0.50], 0.150, [0.15, 0.55, -0.50], 0.080),
    cone([0.15, 0.55, -0.50], 0.080, [0.15, 0.17, -0.48], 0.058),
    cone([0.15, 0.17, -0.48], 0.058, [0.15, 0.075, -0.52], 0.075),
    // Hind leg: thigh, gaskin, cannon, hoof.
    cone([0.12, 1.13, 0.50], 0.215, [0.15, 0.86, 0.48], 0.150),
    cone([0.15, 0.86, 0.48], 0.150, [0.16, 0.52, 0.61], 0.082),
    cone([0.16, 0.52, 0.61], 0.082, [0.16, 0.18, 0.56], 0.060),
    cone([0.16, 0.18, 0.56], 0.060, [0.16, 0.075, 0.52], 0.075),
    // Chest muscle.
    cone([0.10, 1.12, -0.62], 0.150, [0.12, 0.95, -0.56], 0.130),
];

/// Width of the fillets between parts.
const BLEND: f64 = 0.07;
/// See [`figure`].
pub(super) const HORSE: Implicit<fn(DVec3) -> f64> = Implicit {
    distance: |p| figure(&TRUNK, &LIMBS, BLEND, p),
    low: DVec3::new(-0.5, -0.05, -1.5),
    high: DVec3::new(0.5, 2.1, 1.15),
};
/// Triangles times the square of a cell's edge, measured.
const TRIANGLES_PER_CELL: f64 = 17.5;

/// The horse in about `count` triangles: closed, every edge shared by two, fronts outward, one
/// material.
pub(super) fn build(triangles: usize) -> Mesh {
    let cell = (TRIANGLES_PER_CELL / triangles as f64).sqrt();
    // A saddle that just touches a grid plane joins four quads at one edge. The place depends on
    // the grid only, so other grids are tried: about two in five have no such saddle.
    let surface = (0..100)
        .map(|attempt| {
            let shift = (DVec3::new(0.755, 0.570, 0.430) * f64::from(attempt)).fract();
            HORSE.net(cell, shift)
        })
        .filter(Net::is_manifold)
        .map(|net| HORSE.surface(&net))
        .find(Surface::is_manifold);
    let Some(surface) = surface else {
        unreachable!("of a hundred grids one gives a manifold");
    };
    Mesh::bare(surface.positions, surface.triangles)
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;

    /// Every resolution that a number of patches can ask for, in steps, is closed, manifold and
    /// wound outward.
    #[test]
    fn closed_at_every_resolution() {
        for triangles in (3_000..=25_780).step_by(2_278) {
            let mesh = build(triangles);
            // The edge across from each corner, by its corner: around one vertex they must chain
            // into one loop.
            let mut rims: HashMap<u32, HashMap<u32, u32>> = HashMap::new();
            for [a, b, c] in mesh.triangles.iter().map(|t| t.corners) {
                for [at, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
                    let before = rims.entry(at).or_default().insert(from, to);
                    assert_eq!(before, None, "{triangles}: edge {at}-{from} twice");
                }
            }
            for (at, rim) in &rims {
                let start = *rim.keys().next().unwrap();
                let mut next = rim[&start];
                let mut length = 1;
                while next != start {
                    next = *rim
                        .get(&next)
                        .unwrap_or_else(|| panic!("{triangles}: hole at {at}"));
                    length += 1;
                }
                assert_eq!(length, rim.len(), "{triangles}: two fans meet at {at}");
            }
            let volume: f64 = mesh
                .triangles
                .iter()
                .map(|t| t.corners.map(|v| mesh.positions[v as usize]))
                .map(|[a, b, c]| a.dot(b.cross(c)) / 6.0)
                .sum();
            assert!(
                (0.4..0.8).contains(&volume),
                "{triangles}: volume {volume} m³"
            );
            let share = mesh.triangles.len() as f64 / triangles as f64;
            assert!(
                (0.85..1.15).contains(&share),
                "{triangles}: {share} of them"
            );
        }
    }
}
