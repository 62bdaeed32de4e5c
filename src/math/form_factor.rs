//! Lambert's formula: form factor from a point to a polygon, clipped to the receiver's horizon.
//! Pure mathematics in f64; `shaders/shared/lambert.glsl` is the same in f32.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::DVec3;

/// Form factor from `p` with unit normal `n` to a closed contour, counter-clockwise seen from its
/// front: F = 1/(2π) Σ θ_e (n·γ_e) over its edges. Positive where `p` sees the front.
pub fn to_polygon(p: DVec3, n: DVec3, contour: &[DVec3]) -> f64 {
    let clipped = clip_to_horizon(p, n, contour);
    let mut sum = 0.0;
    for (i, a) in clipped.iter().enumerate() {
        let b = clipped[(i + 1) % clipped.len()];
        let normal = a.cross(b);
        let length = normal.length();
        if length > 0.0 {
            sum += length.atan2(a.dot(b)) * n.dot(normal) / length;
        }
    }
    -sum / TAU
}

/// [`to_polygon`] of a triangle, within 10⁻⁷.
pub fn to_triangle(p: DVec3, n: DVec3, triangle: &[DVec3; 3]) -> f64 {
    vector_to_triangle(p, n, triangle).dot(n)
}

/// Of what a triangle shows above the horizon of `n` the vector whose dot product with a normal is
/// the form factor from a facet with that normal, as long as all of it lies above the facet's
/// horizon.
pub fn vector_to_triangle(p: DVec3, n: DVec3, triangle: &[DVec3; 3]) -> DVec3 {
    let corners = triangle.map(|v| v - p);
    let heights = corners.map(|v| v.dot(n));
    // One corner more than the triangle where the horizon cuts one off.
    let mut clipped = [DVec3::ZERO; 4];
    let mut count = 0;
    let mut push = |v: DVec3| {
        clipped[count] = v;
        count += 1;
    };
    for i in 0..3 {
        let next = (i + 1) % 3;
        let (a, ha, hb) = (corners[i], heights[i], heights[next]);
        if ha > 0.0 {
            push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            push(a + (corners[next] - a) * (ha / (ha - hb)));
        }
    }
    let mut sum = DVec3::ZERO;
    for i in 0..count {
        let (a, b) = (clipped[i], clipped[if i + 1 < count { i + 1 } else { 0 }]);
        let normal = a.cross(b);
        let lengths = (a.length_squared() * b.length_squared()).sqrt();
        let length = normal.length();
        if length > 0.0 {
            let over_sine = angle_over_sine(a.dot(b) / lengths, lengths / length);
            sum += normal * (over_sine / lengths);
        }
    }
    -sum / TAU
}

/// θ / sin θ for the angle θ of which `x` is the cosine and `over_sine` is 1 / sin θ, within
/// 3·10⁻⁷: `shaders/shared/lambert.glsl` is the same.
fn angle_over_sine(x: f64, over_sine: f64) -> f64 {
    let of_acute = ACUTE.iter().fold(0.0, |sum, c| sum * x.abs() + c);
    match x >= 0.0 {
        true => of_acute,
        false => PI * over_sine - of_acute,
    }
}

/// Coefficients of θ / sin θ for cosines from 0 to 1, highest power first.
const ACUTE: [f64; 9] = [
    1.7478988e-2,
    -9.7265430e-2,
    2.5208697e-1,
    -4.2358306e-1,
    5.5655622e-1,
    -6.6096932e-1,
    7.8488100e-1,
    -9.9998152e-1,
    FRAC_PI_2,
];

/// Sample points of a triangle (two barycentric coordinates, weight), by how close what it sees is:
/// the centroid; degree 2; Radon's degree 5. `shaders/shared/form_factors.glsl` has the same.
pub fn sample_points(near: bool, touching: bool) -> &'static [[f64; 3]] {
    match (near, touching) {
        (_, true) => &POINTS[4..],
        (true, _) => &POINTS[1..4],
        _ => &POINTS[..1],
    }
}

/// Barycentric coordinates (weights of the second and third corner) of the k-th of places that
/// spread evenly in a triangle: the R₂ sequence (Roberts 2018), folded.
pub fn spread_in_triangle(k: usize) -> [f64; 2] {
    const STEPS: [f64; 2] = [0.754_877_666_246_693, 0.569_840_290_998_053];
    let [u, v] = STEPS.map(|step| (0.5 + step * k as f64).fract());
    match u + v > 1.0 {
        true => [1.0 - u, 1.0 - v],
        false => [u, v],
    }
}

const POINTS: [[f64; 3]; 11] = [
    [1.0 / 3.0, 1.0 / 3.0, 1.0],
    [1.0 / 6.0, 1.0 / 6.0, 1.0 / 3.0],
    [2.0 / 3.0, 1.0 / 6.0, 1.0 / 3.0],
    [1.0 / 6.0, 2.0 / 3.0, 1.0 / 3.0],
    [1.0 / 3.0, 1.0 / 3.0, 0.225],
    [0.470142064, 0.470142064, 0.132394153],
    [0.059715872, 0.470142064, 0.132394153],
    [0.470142064, 0.059715872, 0.132394153],
    [0.101286507, 0.101286507, 0.125939181],
    [0.797426985, 0.101286507, 0.125939181],
    [0.101286507, 0.797426985, 0.125939181],
];

/// The contour relative to `p`, cut at the plane through `p` (Sutherland–Hodgman).
fn clip_to_horizon(p: DVec3, n: DVec3, contour: &[DVec3]) -> Vec<DVec3> {
    let mut clipped = Vec::with_capacity(contour.len() + 2);
    for (i, a) in contour.iter().enumerate() {
        let a = *a - p;
        let b = contour[(i + 1) % contour.len()] - p;
        let (ha, hb) = (a.dot(n), b.dot(n));
        if ha > 0.0 {
            clipped.push(a);
        }
        if (ha > 0.0) != (hb > 0.0) {
            clipped.push(a + (b - a) * (ha / (ha - hb)));
        }
    }
    clipped
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A polygon in the plane z = 1 or beside it, wound so that the origin sees its front.
    fn seen(corners: &[[f64; 3]]) -> Vec<DVec3> {
        corners
            .iter()
            .rev()
            .map(|c| DVec3::from_array(*c))
            .collect()
    }

    /// Angles by a polynomial, up to nearly π, horizons included.
    #[test]
    fn triangles_are_polygons() {
        let mut most = 0.0_f64;
        for k in 0..1000 {
            let [u, v] = spread_in_triangle(k);
            let n = DVec3::new(u, v, 0.2).normalize();
            let p = DVec3::new(u, v, 1e-3 + 0.5 * u);
            let triangle = [DVec3::ZERO, DVec3::Y, DVec3::X].map(|c| c + (v - u) * DVec3::Z);
            let exact = to_polygon(p, n, &triangle);
            most = most.max((to_triangle(p, n, &triangle) - exact).abs());
        }
        println!("largest difference {most:.1e}");
        assert!(most > 0.0 && most <= ANGLES);
    }

    /// Measured: 6.0e-8.
    const ANGLES: f64 = 1.2e-7;

    #[test]
    fn equals_closed_forms() {
        let f = |corners: &[[f64; 3]]| to_polygon(DVec3::ZERO, DVec3::Z, &seen(corners));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-12;
        // Shared reference, differential element to polygon (Howell's B-3 and walls).
        assert!(close(
            f(&[[0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]]),
            0.138531605994893
        ));
        assert!(close(
            f(&[[-1., -1., 1.], [1., -1., 1.], [1., 1., 1.], [-1., 1., 1.]]),
            0.554126423979572
        ));
        assert!(close(
            f(&[[1., 0., 1.], [0., 1., 1.], [-0.5, -0.5, 1.]]),
            0.21887541274623826
        ));
        // A wall that reaches below the horizon has the form factor of its upper half.
        let wall = |low: f64| {
            f(&[
                [1., -0.5, low],
                [1., -0.5, 1.],
                [1., 0.5, 1.],
                [1., 0.5, low],
            ])
        };
        assert!(close(wall(0.0).abs(), 0.07109343904694551));
        assert!(close(wall(-1.0).abs(), 0.07109343904694551));
    }

    #[test]
    fn the_back_is_negative_and_below_is_nothing() {
        let square = [[-1., -1., 1.], [1., -1., 1.], [1., 1., 1.], [-1., 1., 1.]];
        let front = seen(&square);
        let back: Vec<_> = front.iter().rev().copied().collect();
        let f = to_polygon(DVec3::ZERO, DVec3::Z, &front);
        assert_eq!(to_polygon(DVec3::ZERO, DVec3::Z, &back), -f);
        assert_eq!(to_polygon(DVec3::ZERO, -DVec3::Z, &front), 0.0);
    }
}
