//! Twin of `shaders/shared/disc.glsl`: a wide source, approximated by an ellipse of even radiance
//! from the vector of its light alone.

use glam::{DVec2, DVec3};

const WIDE: f64 = 0.01;
const WIDEST: f64 = 0.1;
/// Angle between successive points: the golden angle.
const TURN: f64 = 2.399_963_23;

/// Shares of `f`, ∫ ω dω / π over the source in the element's frame, by direction: they sum to `f`,
/// and none lies below the horizon.
pub fn points(f: DVec3) -> Vec<DVec3> {
    let size = f.length();
    let pairs = match size {
        0.0 => return Vec::new(),
        size if size < WIDE => return vec![f],
        size if size < WIDEST => 4,
        _ => 8,
    };
    let axis = f / size;
    let flat = axis.truncate().length();
    let away = match flat > 1e-6 {
        true => axis.truncate() / flat,
        false => DVec2::X,
    };
    let up = (-axis.z * away).extend(flat);
    let side = DVec3::new(-away.y, away.x, 0.0);
    // The ellipse's projection along the axis has the area π |f|.
    let rise = size.sqrt().min(axis.z);
    let width = (size / rise.max(1e-6)).min(1.0);
    let share = size / f64::from(2 * pairs);
    (0..pairs)
        .flat_map(|j| {
            let r = ((f64::from(j) + 0.5) / f64::from(pairs)).sqrt();
            let (sin, cos) = (TURN * f64::from(j)).sin_cos();
            [r, -r].map(|r| r * DVec2::new(width * cos, rise * sin))
        })
        .map(|p| {
            let along = (1.0 - p.length_squared()).max(1e-4).sqrt();
            share * (axis + (p.x * side + p.y * up) / along)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[test]
    fn points_sum_to_their_light_and_stay_above_the_horizon() {
        for i in 0..=60 {
            let tilt = 0.5 * PI * f64::from(i) / 60.0;
            for size in [1e-4, 0.02, 0.2, 0.7, 0.99] {
                let f = size * DVec3::new(tilt.sin() * 0.6, tilt.sin() * 0.8, tilt.cos());
                let points = points(f);
                assert!(points.iter().sum::<DVec3>().distance(f) < 1e-9 * size);
                let lowest = points.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
                assert!(lowest > -1e-9, "{lowest} at {tilt}, {size}");
            }
        }
    }

    /// Second moments measure the spread of the light: ∫ z² dω, for a cone (1 − cos³ θ) · 2π / 3.
    #[test]
    fn points_are_spread_as_the_source_is() {
        let second = |f: DVec3, along: DVec3| -> f64 {
            // A point p of the sum is L ω dω: p · a (p · a) / |p|.
            points(f)
                .iter()
                .map(|p| p.dot(along).powi(2) / p.length())
                .sum()
        };
        for degrees in [10.0f64, 20.0, 40.0, 60.0] {
            let angle = degrees.to_radians();
            let got = second(DVec3::Z * angle.sin().powi(2), DVec3::Z);
            let want = (1.0 - angle.cos().powi(3)) * 2.0 / 3.0;
            assert!(
                (got / want - 1.0).abs() < 0.03,
                "{degrees}°: {got} for {want}"
            );
        }
        // The quarter of a sphere on one side of a wall that rises from the horizon, ∫ x² dω = ∫ y²
        // dω = ∫ z² dω = π / 3: sixteen points miss the ends of its arc, not its height.
        let quarter = DVec3::new(0.5, 0.0, 0.5);
        for (along, most_off) in [(DVec3::X, 0.15), (DVec3::Y, 0.4), (DVec3::Z, 0.15)] {
            let got = 3.0 * second(quarter, along);
            assert!((got - 1.0).abs() < most_off, "{along}: {got} for 1");
        }
    }
}
