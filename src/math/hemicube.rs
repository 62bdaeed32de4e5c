//! The hemicube: five faces, their pixels and exact delta form factors. Pure mathematics in f64.
//!
//! A hemicube of N pixels a side is a column of N × 3 N pixels: the top (N × N), then the upper
//! halves of +x, −x, +y, −y (N × N/2 each), as in `shaders/shared/hemicube.glsl`.

use std::f64::consts::PI;

use glam::DVec3;

use crate::constants::FIXED_POINT_BITS;

/// A pixel in a hemicube's column.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Pixel {
    pub column: u32,
    pub row: u32,
}

/// Pixels of a hemicube of `n` a side.
pub fn pixel_count(n: u32) -> usize {
    3 * n as usize * n as usize
}

/// Viewport of a face within the column: x, y, width, height.
pub fn face_rectangle(face: u32, n: u32) -> [u32; 4] {
    match face {
        0 => [0, 0, n, n],
        f => [0, n + (f - 1) * (n / 2), n, n / 2],
    }
}

/// Column and row that a direction in the source's frame points to, in pixels of the column;
/// directions below the horizon point to the lowest row.
pub fn texel_of(direction: DVec3, n: u32) -> (f64, f64) {
    let a = direction.abs();
    let z = direction.z.max(0.0);
    let size = f64::from(n);
    let (u, row) = if z >= a.x.max(a.y) {
        (direction.x / z, (direction.y / z * 0.5 + 0.5) * size)
    } else {
        let along_x = a.x >= a.y;
        let (w, u, positive, first) = if along_x {
            (a.x, direction.y, direction.x > 0.0, 1.0)
        } else {
            (a.y, direction.x, direction.y > 0.0, 2.0)
        };
        let first_row = if positive { first } else { first + 0.5 };
        (u / w, (first_row + 0.5 * z / w) * size)
    };
    ((u * 0.5 + 0.5) * size, row)
}

/// The pixel that a direction in the source's frame falls in; directions below the horizon fall in
/// the lowest row.
pub fn pixel_of(direction: DVec3, n: u32) -> Pixel {
    let (column, row) = texel_of(direction, n);
    Pixel {
        column: (column.max(0.0) as u32).min(n - 1),
        row: (row.max(0.0) as u32).min(3 * n - 1),
    }
}

/// The face a pixel lies on, and its corners there: (u0, u1, v0, v1), u in −1..1, v in −1..1 on the
/// top and 0..1 on a side.
fn face_of(pixel: Pixel, n: u32) -> (u32, [f64; 4]) {
    let step = 2.0 / f64::from(n);
    let u0 = f64::from(pixel.column) * step - 1.0;
    if pixel.row < n {
        let v0 = f64::from(pixel.row) * step - 1.0;
        return (0, [u0, u0 + step, v0, v0 + step]);
    }
    let half = n / 2;
    let face = 1 + (pixel.row - n) / half;
    let v0 = f64::from((pixel.row - n) % half) * step;
    (face, [u0, u0 + step, v0, v0 + step])
}

/// The direction through a pixel's centre, in the source's frame, not normalised: its largest
/// component is 1.
pub fn direction_of(pixel: Pixel, n: u32) -> DVec3 {
    let (face, [u0, u1, v0, v1]) = face_of(pixel, n);
    let (u, v) = (0.5 * (u0 + u1), 0.5 * (v0 + v1));
    match face {
        0 => DVec3::new(u, v, 1.0),
        1 => DVec3::new(1.0, u, v),
        2 => DVec3::new(-1.0, u, v),
        3 => DVec3::new(u, 1.0, v),
        _ => DVec3::new(u, -1.0, v),
    }
}

/// Exact form factor ΔF of a pixel from the hemicube's centre, whose normal is z: the difference of
/// the antiderivative at the pixel's corners (Lambert; Cohen and Greenberg 1985 give the
/// integrand). Over all pixels the sum is 1.
pub fn delta_form_factor(pixel: Pixel, n: u32) -> f64 {
    let (face, corners) = face_of(pixel, n);
    let top = |x: f64, y: f64| {
        let (a, b) = ((1.0 + x * x).sqrt(), (1.0 + y * y).sqrt());
        (x / a * (y / a).atan() + y / b * (x / b).atan()) / (2.0 * PI)
    };
    let side = |y: f64, z: f64| {
        let a = (1.0 + z * z).sqrt();
        -(y / a).atan() / (2.0 * PI * a)
    };
    if face == 0 {
        difference(corners, top)
    } else {
        difference(corners, side)
    }
}

/// Solid angle of a pixel as a share of the hemisphere's 2π sr; over all pixels the sum is 1.
pub fn solid_angle_share(pixel: Pixel, n: u32) -> f64 {
    let (_, corners) = face_of(pixel, n);
    difference(corners, |x, y| {
        (x * y / (1.0 + x * x + y * y).sqrt()).atan()
    }) / (2.0 * PI)
}

fn difference([u0, u1, v0, v1]: [f64; 4], f: impl Fn(f64, f64) -> f64) -> f64 {
    f(u1, v1) - f(u0, v1) - f(u1, v0) + f(u0, v0)
}

/// Every pixel's [`delta_form_factor`], then every pixel's [`solid_angle_share`],
/// `[2][row][column]`, in fixed point of [`FIXED_POINT_BITS`].
pub fn fixed_point_tables(n: u32) -> Vec<u64> {
    let unit = (1u64 << FIXED_POINT_BITS) as f64;
    let pixels = || (0..3 * n).flat_map(move |row| (0..n).map(move |column| Pixel { column, row }));
    pixels()
        .map(|p| delta_form_factor(p, n))
        .chain(pixels().map(|p| solid_angle_share(p, n)))
        .map(|f| (f * unit).round() as u64)
        .collect()
}

/// Form factors of the pixels, then their shares of half the sphere, as numbers; each `[3 n][n]`.
pub fn pixel_form_factors(n: u32) -> Vec<f32> {
    let unit = (1u64 << FIXED_POINT_BITS) as f64;
    let fixed = fixed_point_tables(n);
    fixed.iter().map(|&f| (f as f64 / unit) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_one() {
        for n in [2, 8, 64, 256] {
            let mut sums = [0.0; 2];
            for row in 0..3 * n {
                for column in 0..n {
                    let pixel = Pixel { column, row };
                    sums[0] += delta_form_factor(pixel, n);
                    sums[1] += solid_angle_share(pixel, n);
                }
            }
            // Neumaier-free sums of 2·10⁵ terms in f64.
            assert!(
                (sums[0] - 1.0).abs() < 1e-11 && (sums[1] - 1.0).abs() < 1e-11,
                "{sums:?}"
            );
        }
    }

    #[test]
    fn pixels_equal_the_reference_values() {
        let at = |column, row| delta_form_factor(Pixel { column, row }, 64);
        // shared reference: N = 64, computed two independent ways in f64; the difference of corners
        // loses six digits.
        let close = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-10;
        assert!(close(at(32, 32), 0.00031044529885447997));
        assert!(close(at(0, 0), 3.60161392350955e-05));
        assert!(close(at(32, 64), 4.849130122957027e-06));
        assert!(close(at(32, 64 + 31), 7.88999305691416e-05));
        assert!(close(at(0, 64 + 31), 3.544945888613038e-05));
        assert!(close(at(0, 64), 1.252379809885129e-06));
    }

    #[test]
    fn a_pixels_own_direction_falls_in_it() {
        for n in [2, 6, 64] {
            for row in 0..3 * n {
                for column in 0..n {
                    let pixel = Pixel { column, row };
                    assert_eq!(pixel_of(direction_of(pixel, n), n), pixel);
                }
            }
        }
    }
}
