//! Probes on a grid, and the light between them.

use glam::{DVec3, Vec3};

use super::{Probe, Probes};
use crate::scene::Scene;
use crate::solver::Place;

/// A grid of probes: one in the middle of each cell of a box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Corners of the box, scene units.
    pub low: DVec3,
    pub high: DVec3,
    /// Along x, y and z; x counts fastest.
    pub counts: [u32; 3],
}

/// Behind a surface by less than this, of the least spacing, a place counts as on it.
const BEYOND: f64 = 0.01;

/// Off the surface, of the least spacing: looked for there where no probe sees the place itself, as
/// on surfaces that are curved within a texel of what a probe sees.
const ABOVE: f64 = 0.2;

/// Of the sum of the weights that nothing hides: with less no probe sees the place.
const LEAST: f64 = 1e-3;

impl Grid {
    /// In the box about a scene.
    pub fn about(scene: &Scene, counts: [u32; 3]) -> Self {
        let (low, high) = scene.bounds();
        Self { low, high, counts }
    }

    /// Scene units from one probe to the next.
    pub fn spacing(&self) -> DVec3 {
        (self.high - self.low) / DVec3::from(self.counts.map(f64::from))
    }

    pub fn positions(&self) -> Vec<DVec3> {
        let [nx, ny, nz] = self.counts;
        let all = (0..nz).flat_map(|k| (0..ny).flat_map(move |j| (0..nx).map(move |i| [i, j, k])));
        all.map(|at| self.low + self.spacing() * (DVec3::from(at.map(f64::from)) + 0.5))
            .collect()
    }

    /// Indices of the eight probes about a position, and their trilinear weights.
    fn about_place(&self, position: DVec3) -> [(usize, f64); 8] {
        let at = (position - self.low) / self.spacing() - 0.5;
        let [nx, ny, nz] = self.counts;
        let axis = |at: f64, count: u32, step: usize| -> (usize, f64) {
            let at = at.clamp(0.0, f64::from(count - 1));
            let first = at.floor().min(f64::from(count.saturating_sub(2)));
            let part = at - first;
            match step {
                0 => (first as usize, 1.0 - part),
                _ => ((first as usize + 1).min(count as usize - 1), part),
            }
        };
        std::array::from_fn(|i| {
            let (x, wx) = axis(at.x, nx, i & 1);
            let (y, wy) = axis(at.y, ny, i >> 1 & 1);
            let (z, wz) = axis(at.z, nz, i >> 2);
            ((z * ny as usize + y) * nx as usize + x, wx * wy * wz)
        })
    }
}

impl Probes {
    /// Irradiance at a place between the probes of a grid, W·m⁻², RGB: of the eight about it, by
    /// their trilinear weights, how much they lie in front of the surface, and whether they see it
    /// ([`super::Walls::sees`]). None where no probe does, or there is no grid.
    pub fn at(&self, place: Place) -> Option<Vec3> {
        let grid = self.grid?;
        let least = grid.spacing().min_element();
        let about = grid.about_place(place.position);
        let seen_from = |above: f64| {
            let (mut sum, mut whole) = (DVec3::ZERO, 0.0);
            for (index, trilinear) in about {
                let probe: &Probe = &self.list[index];
                let offset = place.position + above * place.normal - probe.position;
                if !probe.valid || trilinear == 0.0 {
                    continue;
                }
                let front = 0.5 * (1.0 - offset.normalize_or(-place.normal).dot(place.normal));
                let seen = self.walls[index].sees(offset, BEYOND * least);
                let weight = trilinear * (front * front + 0.2) * seen;
                sum += weight * probe.at(place.normal).as_dvec3();
                whole += weight;
            }
            (whole > LEAST).then(|| (sum / whole).as_vec3())
        };
        seen_from(0.0).or_else(|| seen_from(ABOVE * least))
    }
}
