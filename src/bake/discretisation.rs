//! An estimate of how far light that is linear over elements is from what it stands for.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::math::groups::{edges, shared};
use crate::mesh::corners::PLANE_COS;
use crate::scene::Scene;
use crate::solver::{Discretisation, SurfaceError};

/// Part of the square of a jump between two elements of a plane that counts for each: a border of
/// shadow crosses one of them, the smaller side of which, a quarter of its area on average, has the
/// light of the other.
const OF_JUMP: f64 = 1.0 / 6.0;

/// Estimates the error of light at the corners, `[triangle][corner]`, that stands for light at the
/// centroids, `[triangle]`: the square of what the corners' mean differs from the centroid, and of
/// the jumps at edges of a plane where elements are not joined. What facets of a curved surface
/// differ by does not count, nor does the error of the light at the centroids.
pub fn discretisation(scene: &Scene, irradiance: &[Vec3], corners: &[[Vec3; 3]]) -> Discretisation {
    let crosses: Vec<DVec3> = (scene.triangles.par_iter())
        .map(|t| {
            let [a, b, c] = scene.corners(t);
            (b - a).cross(c - a)
        })
        .collect();
    let mut squares: Vec<f64> = (irradiance.par_iter().zip(corners))
        .map(|(&light, [a, b, c])| square(light - (a + b + c) / 3.0))
        .collect();
    for [e, other] in pairs(scene) {
        let [one, two] = [e, other].map(|e| crosses[e].normalize_or_zero());
        if one.dot(two) >= PLANE_COS {
            let jump = OF_JUMP * jump(scene, corners, [e, other]);
            squares[e] += jump;
            squares[other] += jump;
        }
    }
    let mut sums = vec![Sum::default(); scene.materials.len()];
    for (e, triangle) in scene.triangles.iter().enumerate() {
        let area = 0.5 * crosses[e].length();
        let sum = &mut sums[triangle.material as usize];
        sum.area += area;
        sum.light += area * irradiance[e].as_dvec3().element_sum() / 3.0;
        sum.squares += area * squares[e];
    }
    summary(scene, &sums)
}

/// Integrals over a surface.
#[derive(Debug, Clone, Copy, Default)]
struct Sum {
    area: f64,
    light: f64,
    squares: f64,
}

fn summary(scene: &Scene, sums: &[Sum]) -> Discretisation {
    let plain = || {
        let all = scene.materials.iter().zip(sums);
        all.filter(|(material, sum)| sum.area > 0.0 && !material.emits() && !material.has_relief())
    };
    let whole = plain().fold(Sum::default(), |a, (_, b)| Sum {
        area: a.area + b.area,
        light: a.light + b.light,
        squares: a.squares + b.squares,
    });
    let rms = |sum: &Sum| match whole.light > 0.0 {
        true => (sum.squares / sum.area).sqrt() * whole.area / whole.light,
        false => 0.0,
    };
    Discretisation {
        rms: rms(&whole),
        surfaces: plain()
            .map(|(material, sum)| SurfaceError {
                name: material.name.clone(),
                area: sum.area / whole.area,
                rms: rms(sum),
            })
            .collect(),
    }
}

impl std::fmt::Display for Discretisation {
    /// The whole scene and the worst surface.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.2} % rms of the mean", 100.0 * self.rms)?;
        match (self.surfaces.iter()).max_by(|a, b| a.rms.total_cmp(&b.rms)) {
            Some(worst) => write!(f, ", {:.2} % on {}", 100.0 * worst.rms, worst.name),
            None => Ok(()),
        }
    }
}

/// The two triangles of each edge that joins two.
fn pairs(scene: &Scene) -> Vec<[usize; 2]> {
    let edges = edges(scene.triangles.iter().map(|t| t.vertices));
    (shared(&edges))
        .filter_map(|run| match run {
            [a, b] => Some([a, b].map(|edge| edge.triangle as usize)),
            _ => None,
        })
        .collect()
}

/// Mean square of what two triangles differ by at the vertices that they share.
fn jump(scene: &Scene, corners: &[[Vec3; 3]], [one, two]: [usize; 2]) -> f64 {
    let others = scene.triangles[two].vertices;
    let shared = (0..3).filter_map(|k| {
        let vertex = scene.triangles[one].vertices[k];
        let m = others.iter().position(|&other| other == vertex)?;
        Some(square(corners[one][k] - corners[two][m]))
    });
    0.5 * shared.sum::<f64>()
}

/// Mean square over the colours.
fn square(light: Vec3) -> f64 {
    light.as_dvec3().length_squared() / 3.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::shapes::Shapes;

    /// Two triangles of a unit square. The first has light 2 at its centroid and corners whose mean
    /// is 2.3; the other is even, with light 1. They differ by 1 at one shared vertex and by 1.9 at
    /// the other.
    #[test]
    fn squares_are_of_means_and_jumps() {
        let mut shapes = Shapes::new();
        shapes.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (1, 1), 0);
        // Another surface, dark, of three times the area, and a lamp.
        let dark = shapes.material(0.5, 0.0);
        shapes.quad(DVec3::Y, 3.0 * DVec3::Z, DVec3::X, (1, 1), dark);
        let lamp = shapes.material(0.5, 1.0);
        shapes.quad(2.0 * DVec3::Y, DVec3::Z, DVec3::X, (1, 1), lamp);
        let scene = &shapes.scene;
        let [first, second] = [0, 1].map(|e| scene.triangles[e].vertices);
        let shared: Vec<usize> = (0..3).filter(|&k| second.contains(&first[k])).collect();
        let mut values = [2.0; 3];
        values[shared[1]] = 2.9;
        let mut corners = vec![[Vec3::ONE; 3]; 6];
        corners[0] = values.map(Vec3::splat);
        corners[2..4].fill([Vec3::ZERO; 3]);
        let light = [2.0, 1.0, 0.0, 0.0, 7.0, 8.0].map(Vec3::splat);
        let found = discretisation(scene, &light, &corners);
        let jump = (1.0 + 1.9 * 1.9) / 2.0 / 6.0;
        let squares = 0.5 * (0.3 * 0.3 + 2.0 * jump);
        // The mean over an area of 4 is 1.5 / 4.
        let mean = 0.375;
        assert!((found.rms - (squares / 4.0_f64).sqrt() / mean).abs() < 1e-6);
        let [lit, dark] = &found.surfaces[..] else {
            panic!("not two surfaces: {found:?}");
        };
        assert!((lit.rms - squares.sqrt() / mean).abs() < 1e-6 && lit.area == 0.25);
        assert!(dark.rms == 0.0 && dark.area == 0.75);
    }
}
