//! Lights that are sketched: which have changed, and what they send from where.

use glam::{DVec3, Vec3};

use super::Wanted;
use crate::math::form_factor::spread_in_triangle;
use crate::scene::{PointLight, Scene};

/// A light as it was and as it is, each with what it sends: W·sr⁻¹, or W·m⁻²·sr⁻¹ of an emitter.
pub(super) type Change = [(Light, Vec3); 2];

/// What sends light.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Light {
    Point(PointLight),
    Emitter(Vec<Spot>),
}

/// A part of an emitter, in whose middle it is taken to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spot {
    pub at: DVec3,
    pub normal: DVec3,
    /// Square scene units.
    pub area: f64,
}

/// Whether the lights of two scenes of the same triangles differ by no more than point lights, and
/// emitters that have moved.
pub fn is_possible(base: &Scene, scene: &Scene) -> bool {
    let moved = moved(base, scene);
    let emission = |scene: &Scene, m: usize| scene.materials[m].ke;
    let same = |m: usize| emission(base, m) == emission(scene, m) || moved.contains(&m);
    let [points, points_now] = [base, scene].map(|scene| scene.lights.points.len());
    (0..base.materials.len()).all(same) && points == points_now && (points > 0 || !moved.is_empty())
}

/// Materials of emitters that are elsewhere in another scene of the same triangles.
pub(super) fn moved(base: &Scene, scene: &Scene) -> Vec<usize> {
    let mut moved = Vec::new();
    if base.vertices != scene.vertices {
        for (before, now) in base.triangles.iter().zip(&scene.triangles) {
            let m = now.material as usize;
            if base.corners(before) != scene.corners(now) && !moved.contains(&m) {
                moved.push(m);
            }
        }
    }
    moved
}

/// The lights that are others now.
pub(super) fn changes(wanted: &Wanted) -> Vec<Change> {
    let (base, scene) = (&wanted.base.scene, &wanted.scene);
    let both = base.lights.points.iter().zip(&scene.lights.points);
    let points = both.filter(|(before, now)| before != now).map(|both| {
        let [before, now] = [both.0, both.1];
        [before, now].map(|light| (Light::Point(light.clone()), light.intensity.into()))
    });
    let emitters = moved(base, scene).into_iter().map(|m| {
        let light = |scene: &Scene| {
            let sent = Vec3::from(scene.materials[m].mean_emission());
            (Light::Emitter(spots(scene, m)), sent)
        };
        [light(base), light(scene)]
    });
    points.chain(emitters).collect()
}

/// Rays to all spots of an emitter, about: fewer spots where there are more triangles.
const EMITTER_RAYS: usize = 150_000;
const SPOTS: [usize; 2] = [4, 32];

/// Parts of an emitter of one area, spread over its triangles by how large they are.
fn spots(scene: &Scene, material: usize) -> Vec<Spot> {
    let own = scene
        .triangles
        .iter()
        .filter(|t| t.material as usize == material);
    let faces: Vec<_> = own
        .map(|t| {
            let [a, b, c] = scene.corners(t);
            let cross = (b - a).cross(c - a);
            ([a, b, c], cross.normalize_or_zero(), 0.5 * cross.length())
        })
        .collect();
    let whole: f64 = faces.iter().map(|face| face.2).sum();
    let [least, most] = SPOTS;
    let count = (EMITTER_RAYS / scene.triangles.len().max(1)).clamp(least, most);
    let area = whole / count as f64;
    let mut before = 0.0;
    let mut spots = Vec::with_capacity(count);
    for ([a, b, c], normal, own) in faces {
        // Those whose middle, counted by area, lies in this triangle.
        while let middle = (spots.len() as f64 + 0.5) * area
            && spots.len() < count
            && middle < before + own
        {
            let [of_b, of_c] = spread_in_triangle(spots.len());
            let at = a + (b - a) * of_b + (c - a) * of_c;
            spots.push(Spot { at, normal, area });
        }
        before += own;
    }
    spots
}
