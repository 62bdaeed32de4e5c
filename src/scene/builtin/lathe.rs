//! Closed surfaces of revolution about the y axis: bowls and plates.

use glam::{DVec2, DVec3};

use super::exact::split_longest;
use super::surface_nets::Surface;

/// Turns a profile about the y axis into exactly `triangles`, an even number.
///
/// The profile runs from the axis to the axis, points (radius, y), outside to the right of the way: up along the outer
/// side and back along the inner one. None where there are too few triangles to keep each of its points.
pub(super) fn turn(profile: &[DVec2], triangles: usize) -> Option<Surface> {
    assert!(triangles.is_multiple_of(2), "a closed surface is even");
    let lengths: Vec<f64> = profile.windows(2).map(|p| p[0].distance(p[1])).collect();
    let widest = profile.iter().map(|p| p.x).fold(0.0, f64::max);
    let total: f64 = lengths.iter().sum();
    let mut size = (total * widest * 8.0 / triangles as f64).sqrt();
    loop {
        let around = (std::f64::consts::TAU * widest / size).round().max(8.0) as usize;
        let cuts: Vec<usize> = lengths
            .iter()
            .map(|length| (length / size).round().max(1.0) as usize)
            .collect();
        let segments: usize = cuts.iter().sum();
        let found = 2 * around * (segments - 1);
        if found <= triangles {
            let mut surface = revolve(&cut(profile, &cuts), around);
            split_longest(&mut surface, triangles, |middle| middle);
            return Some(surface);
        }
        if around == 8 && segments == lengths.len() {
            return None;
        }
        size *= 1.002;
    }
}

fn cut(profile: &[DVec2], cuts: &[usize]) -> Vec<DVec2> {
    let mut points = Vec::new();
    for (ends, &count) in profile.windows(2).zip(cuts) {
        points.extend((0..count).map(|i| ends[0].lerp(ends[1], i as f64 / count as f64)));
    }
    points.extend(profile.last());
    points
}

fn revolve(points: &[DVec2], around: usize) -> Surface {
    let rings = &points[1..points.len() - 1];
    let mut positions = Vec::with_capacity(rings.len() * around + 2);
    for ring in rings {
        positions.extend((0..around).map(|k| {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / around as f64).sin_cos();
            DVec3::new(ring.x * cos, ring.y, ring.x * sin)
        }));
    }
    let (first, last) = (positions.len() as u32, positions.len() as u32 + 1);
    positions.extend([points[0], points[points.len() - 1]].map(|p| DVec3::new(0.0, p.y, 0.0)));
    let at = |ring: usize, k: usize| (ring * around + k % around) as u32;
    let mut triangles = Vec::new();
    for k in 0..around {
        triangles.push([first, at(0, k), at(0, k + 1)]);
        for ring in 1..rings.len() {
            let [a, b] = [at(ring - 1, k), at(ring - 1, k + 1)];
            let [d, c] = [at(ring, k), at(ring, k + 1)];
            triangles.extend([[a, d, c], [a, c, b]]);
        }
        triangles.push([last, at(rings.len() - 1, k + 1), at(rings.len() - 1, k)]);
    }
    Surface {
        positions,
        triangles,
    }
}
