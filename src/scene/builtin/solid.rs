//! Closed solids in an exact number of triangles.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::splitting;
use super::surface_nets::{Implicit, Surface};
use crate::scene::assemble::Mesh;

/// Grids to try, and the share of the wanted triangles that is close enough to stop at.
const ATTEMPTS: u32 = 60;
const NEAR_ENOUGH: f64 = 0.93;

/// A surface in exactly `count` triangles, which is even: closed, every edge shared by two, fronts
/// outward.
pub(super) fn sculpt(of: &Implicit<impl Fn(DVec3) -> f64 + Sync>, count: usize) -> Mesh {
    // The first estimate, a solid with the surface of the box: eight triangles for six cells' worth
    // of it.
    let size = of.high - of.low;
    let faces = 2.0 * (size.x * size.y + size.y * size.z + size.z * size.x);
    let mut cell = (2.0 * faces / count as f64).sqrt();
    let mut best: Option<Surface> = None;
    for attempt in 0..ATTEMPTS {
        // A saddle that just touches a grid plane is not manifold: other offsets of the grid are
        // tried.
        let shift = (DVec3::new(0.755, 0.570, 0.430) * f64::from(attempt)).fract();
        let net = of.net(cell, shift);
        let got = net.triangles();
        let triangles = |best: &Option<Surface>| best.as_ref().map_or(0, |b| b.triangles.len());
        if got > triangles(&best) && got <= count && net.is_manifold() {
            best = Some(of.surface(&net)).filter(Surface::is_manifold).or(best);
        }
        if triangles(&best) as f64 >= NEAR_ENOUGH * count as f64 {
            break;
        }
        // Aim a little below: the number goes with the inverse square of the cell. Near the goal,
        // one step at a time.
        let aim = (got.max(1) as f64 / (0.97 * count as f64)).sqrt();
        cell *= aim.clamp(0.5, 2.0);
    }
    let Some(surface) = best else {
        unreachable!("of sixty grids one gives a manifold");
    };
    exactly(surface.positions, surface.triangles, count)
}

/// A solid of revolution about y in exactly `count` triangles. The profile, (radius, height), runs
/// from the axis at the bottom to the axis at the top, the outside on the right.
pub(super) fn revolve(profile: &[DVec2], count: usize) -> Mesh {
    let length: f64 = profile.windows(2).map(|p| p[0].distance(p[1])).sum();
    let widest = profile.iter().map(|p| p.x).fold(0.0, f64::max);
    // 2 rings × segments triangles; the quads about square at half the greatest radius.
    let ratio = TAU * widest * 0.6 / length;
    let rings = (count as f64 / 2.0 / ratio).sqrt() as usize;
    let rings = rings.min(count / 6).max(profile.len() - 2);
    let segments = (count / 2 / rings).max(3);
    let rings = resample(profile, rings);
    let mut positions = vec![DVec3::new(0.0, profile[0].y, 0.0)];
    for ring in &rings {
        positions.extend((0..segments).map(|s| {
            let (sin, cos) = (TAU * s as f64 / segments as f64).sin_cos();
            DVec3::new(ring.x * cos, ring.y, ring.x * sin)
        }));
    }
    positions.push(DVec3::new(0.0, profile[profile.len() - 1].y, 0.0));
    let top = positions.len() as u32 - 1;
    let at = |ring: usize, s: usize| (1 + ring * segments + s % segments) as u32;
    let mut triangles = Vec::new();
    for s in 0..segments {
        triangles.push([0, at(0, s), at(0, s + 1)]);
        for ring in 1..rings.len() {
            let [a, b] = [at(ring - 1, s), at(ring - 1, s + 1)];
            let [c, d] = [at(ring, s), at(ring, s + 1)];
            triangles.extend([[a, c, b], [b, c, d]]);
        }
        triangles.push([top, at(rings.len() - 1, s + 1), at(rings.len() - 1, s)]);
    }
    exactly(positions, triangles, count)
}

/// `count` points between the ends of a profile, its corners among them, the rest spread by length.
fn resample(profile: &[DVec2], count: usize) -> Vec<DVec2> {
    let stretches: Vec<f64> = profile.windows(2).map(|p| p[0].distance(p[1])).collect();
    let mut cells = vec![1_usize; stretches.len()];
    for _ in stretches.len()..=count {
        // The last of equal ones, so that every machine chooses the same.
        let longest = (0..cells.len())
            .max_by(|&a, &b| {
                (stretches[a] / cells[a] as f64).total_cmp(&(stretches[b] / cells[b] as f64))
            })
            .unwrap_or(0);
        cells[longest] += 1;
    }
    let mut points = Vec::with_capacity(count);
    for (ends, &cells) in profile.windows(2).zip(&cells) {
        points.extend((0..cells).map(|i| ends[0].lerp(ends[1], i as f64 / cells as f64)));
    }
    points.split_off(1)
}

/// Splits the longest edge of a closed mesh until there are `count` triangles; each split gives two
/// more.
fn exactly(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, count: usize) -> Mesh {
    assert!(
        triangles.len() <= count && (count - triangles.len()).is_multiple_of(2),
        "{} triangles cannot become {count}",
        triangles.len()
    );
    let mut mesh = Mesh::bare(positions, triangles);
    splitting::split(&mut mesh, count, |_| 1.0);
    mesh
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use super::*;

    #[test]
    fn splitting_keeps_a_solid_closed_and_as_large() {
        let corners = [[0, 0, 0], [3, 0, 0], [0, 2, 0], [0, 0, 1]];
        let positions = corners.map(|p| DVec3::from(p.map(f64::from))).to_vec();
        let faces = vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        for count in [4, 6, 100, 1_002] {
            let mesh = exactly(positions.clone(), faces.clone(), count);
            assert_eq!(mesh.triangles.len(), count);
            let mut edges = HashSet::new();
            let mut volume = 0.0;
            for [a, b, c] in mesh.triangles.iter().map(|t| t.corners) {
                for edge in [[a, b], [b, c], [c, a]] {
                    assert!(edges.insert(edge), "{count}: {edge:?} twice");
                }
                let [a, b, c] = [a, b, c].map(|v| mesh.positions[v as usize]);
                volume += a.dot(b.cross(c)) / 6.0;
            }
            assert!(edges.iter().all(|&[a, b]| edges.contains(&[b, a])));
            assert!((volume - 1.0).abs() < 1e-12, "{count}: {volume}");
        }
    }
}
