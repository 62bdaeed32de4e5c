//! Light at probes: places in space from which light is taken for what moves.

mod files;
mod grid;
mod walls;

use std::path::Path;

use glam::{DVec3, Vec3};
use nalgebra::{DMatrix, SMatrix};
use rayon::prelude::*;

use super::text_points::{Row, read_rows};
use crate::error::Result;
use crate::scene::Scene;
use crate::scene::geometry::Geometry;
use crate::solver::{LightAt, Lit, Place};
pub use files::ProbeFile;
pub use grid::Grid;
pub use walls::{SIDE, Walls, off_square, on_square};

/// Coefficients of the real spherical harmonics up to the second degree.
pub const COEFFICIENTS: usize = 9;

/// Irradiance at a place by the direction of the normal, in spherical harmonics.
#[derive(Debug, Clone, PartialEq)]
pub struct Probe {
    /// Scene units.
    pub position: DVec3,
    /// E(n) = Σ c_i Y_i(n), W·m⁻², RGB; the order is that of [`harmonics`].
    pub irradiance: [Vec3; COEFFICIENTS],
    /// Whether it lies outside of all solids: within one, it sees backs, and has no light to give.
    pub valid: bool,
}

/// Probes with what they see.
pub struct Probes {
    /// None of given points.
    pub grid: Option<Grid>,
    pub list: Vec<Probe>,
    /// `[probe]`
    pub walls: Vec<Walls>,
}

/// Probes that are found between two calls of `go_on`.
const AT_ONCE: usize = 32;

impl Probes {
    /// At the places of a grid, or at given positions. `go_on` is called with how many are found;
    /// false stops, and gives None.
    ///
    /// # Errors
    /// A position that is not finite; a scene that cannot be traced.
    pub fn new(
        scene: &Scene,
        lit: &Lit<'_>,
        grid: Option<Grid>,
        positions: &[DVec3],
        go_on: &dyn Fn(usize) -> bool,
    ) -> Result<Option<Self>> {
        let geometry = Geometry::new(&scene.uncut())?;
        let (mut list, mut walls) = (Vec::new(), Vec::new());
        for some in positions.chunks(AT_ONCE) {
            if !go_on(list.len()) {
                return Ok(None);
            }
            let around = places(some);
            list.extend(probes(some, &lit.at(&around)?, &lit.backs(&around)?));
            let about = some.par_iter().map(|&at| Walls::new(&geometry, at));
            walls.extend(about.collect::<Vec<_>>());
        }
        Ok(Some(Self { grid, list, walls }))
    }
}

/// Reads positions of probes: `x y z` a line, scene units; what follows on the line, as the normals
/// of Radiance's points, is not used. Empty lines and those that begin with `#` are skipped.
///
/// # Errors
/// A file that cannot be read or has no point; a line that does not begin with three finite
/// numbers.
pub fn read_positions(path: &Path) -> Result<Vec<DVec3>> {
    let position = |row: Row<'_>| match row.numbers {
        [x, y, z, ..] => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(row.wrong("is not three numbers: x y z")),
    };
    read_rows(path, "x y z", position)
}

/// Y_00, Y_1−1, Y_10, Y_11, Y_2−2, Y_2−1, Y_20, Y_21, Y_22 of a unit vector, orthonormal over the
/// sphere, without the phase of Condon and Shortley.
pub fn harmonics(n: DVec3) -> [f64; COEFFICIENTS] {
    let DVec3 { x, y, z } = n;
    [
        0.282_094_791_773_878,
        0.488_602_511_902_920 * y,
        0.488_602_511_902_920 * z,
        0.488_602_511_902_920 * x,
        1.092_548_430_592_079 * x * y,
        1.092_548_430_592_079 * y * z,
        0.315_391_565_252_520 * (3.0 * z * z - 1.0),
        1.092_548_430_592_079 * x * z,
        0.546_274_215_296_039 * (x * x - y * y),
    ]
}

/// The 26 directions to the faces, edges and corners of a cube.
pub fn directions() -> Vec<DVec3> {
    let steps = [-1.0, 0.0, 1.0];
    let all = steps.into_iter().flat_map(|x| {
        steps
            .into_iter()
            .flat_map(move |y| steps.into_iter().map(move |z| DVec3::new(x, y, z)))
    });
    all.filter_map(DVec3::try_normalize).collect()
}

/// What is looked at for probes at these places: 26 places each.
pub fn places(positions: &[DVec3]) -> Vec<Place> {
    let directions = directions();
    let around = |&position: &DVec3| {
        let of = directions.iter();
        of.map(move |&normal| Place { position, normal })
            .collect::<Vec<_>>()
    };
    positions.iter().flat_map(around).collect()
}

/// Probes of the light at [`places`], in the least squares, and of where these see backs.
pub fn probes(positions: &[DVec3], light: &[LightAt], backs: &[bool]) -> Vec<Probe> {
    let fit = fit();
    let count = fit.ncols();
    let of_each = light.chunks_exact(count).zip(backs.chunks_exact(count));
    (positions.iter().zip(of_each))
        .map(|(&position, (light, backs))| {
            let mut irradiance = [Vec3::ZERO; COEFFICIENTS];
            for (i, coefficient) in irradiance.iter_mut().enumerate() {
                for (k, light) in light.iter().enumerate() {
                    *coefficient += (light.direct + light.indirect) * fit[(i, k)] as f32;
                }
            }
            Probe {
                position,
                irradiance,
                // A solid's inside sees backs all around.
                valid: backs.iter().filter(|is_back| **is_back).count() * 2 < count,
            }
        })
        .collect()
}

/// Weights of the light in each direction for each coefficient.
fn fit() -> DMatrix<f64> {
    let directions = directions();
    let values = DMatrix::from_fn(directions.len(), COEFFICIENTS, |k, i| {
        harmonics(directions[k])[i]
    });
    let square: SMatrix<f64, COEFFICIENTS, COEFFICIENTS> =
        SMatrix::from_fn(|i, j| values.column(i).dot(&values.column(j)));
    // The directions lie on both sides of each plane, so that no harmonic is zero on all of them.
    let inverse = square.try_inverse().unwrap_or_else(SMatrix::identity);
    DMatrix::from_fn(COEFFICIENTS, directions.len(), |i, k| {
        (0..COEFFICIENTS)
            .map(|j| inverse[(i, j)] * values[(k, j)])
            .sum()
    })
}

impl Probe {
    /// Irradiance of a surface with this normal, W·m⁻², RGB.
    pub fn at(&self, normal: DVec3) -> Vec3 {
        let all = harmonics(normal).into_iter().zip(self.irradiance);
        let sum: Vec3 = all.map(|(y, c)| c * y as f32).sum();
        sum.max(Vec3::ZERO)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance that is of the second degree comes back as it was.
    #[test]
    fn the_fit_is_exact_up_to_the_second_degree() {
        let wanted: Vec<f64> = (0..COEFFICIENTS).map(|i| 1.0 / (1.0 + i as f64)).collect();
        let value =
            |n: DVec3| -> f64 { harmonics(n).iter().zip(&wanted).map(|(y, c)| y * c).sum() };
        let light: Vec<LightAt> = (directions().into_iter())
            .map(|n| LightAt {
                direct: Vec3::splat(value(n) as f32),
                indirect: Vec3::ZERO,
            })
            .collect();
        let found = probes(&[DVec3::ZERO], &light, &vec![false; light.len()]);
        for (c, wanted) in found[0].irradiance.iter().zip(&wanted) {
            assert!((f64::from(c.x) - wanted).abs() < 1e-6, "{c} {wanted}");
        }
        assert!(found[0].valid);
    }
}
