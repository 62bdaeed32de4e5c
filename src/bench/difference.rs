//! How far two solutions of the same triangles are apart.

use std::collections::HashMap;

use glam::Vec3;
use serde::Serialize;

use crate::mesh::sources::triangle_area;
use crate::scene::{Scene, Triangle};

/// Difference of irradiance over triangles that two scenes share, by area, colours together.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Difference {
    pub triangles: u64,
    /// Mean difference over the mean of the reference.
    pub bias: f64,
    /// Root of the mean square of the difference over the mean of the reference.
    pub rms: f64,
}

/// Triangles `[of scene, of displaced]` without relief that [`crate::scene::displace`] left as they
/// were.
pub fn plain_pairs(scene: &Scene, displaced: &Scene) -> Vec<[usize; 2]> {
    let key = |t: &Triangle| (t.vertices, t.material);
    let known: HashMap<_, usize> = displaced
        .triangles
        .iter()
        .enumerate()
        .map(|(index, t)| (key(t), index))
        .collect();
    let plain = |t: &Triangle| !scene.materials[t.material as usize].has_relief();
    scene
        .triangles
        .iter()
        .enumerate()
        .filter(|(_, t)| plain(t))
        .filter_map(|(index, t)| Some([index, *known.get(&key(t))?]))
        .collect()
}

impl Difference {
    /// Of `ours` from `reference`, `[triangle]`, over `pairs` of triangles of the two, whose areas
    /// are those of `scene`.
    pub fn new(scene: &Scene, pairs: &[[usize; 2]], (ours, reference): (&[Vec3], &[Vec3])) -> Self {
        let (mut whole, mut difference, mut squares, mut light) = (0.0, 0.0, 0.0, 0.0);
        for &[a, b] in pairs {
            let area = triangle_area(scene.corners(&scene.triangles[a]));
            let (ours, reference) = (ours[a].as_dvec3(), reference[b].as_dvec3());
            let apart = ours - reference;
            whole += area;
            difference += area * apart.element_sum();
            squares += area * apart.length_squared() / 3.0;
            light += area * reference.element_sum();
        }
        let mean = light / (3.0 * whole);
        Self {
            triangles: pairs.len() as u64,
            bias: difference / light,
            rms: (squares / whole).sqrt() / mean,
        }
    }
}
