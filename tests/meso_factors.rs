//! Factors of the light on a relief's texels against the transfer that they factor.

mod common;

use common::device;
use glam::{DVec2, DVec3, Vec3};
use mesolux::math::directions::Directions;
use mesolux::meso::{Factors, HeightField, Shading};
use mesolux::passes::relief_visibility::ReliefVisibility;

const SIDE: u32 = 8;

/// Gentle slopes that differ along u and v and lie in no symmetry of the cell; black, so that
/// nothing bounces.
fn field() -> HeightField {
    let heights: Vec<f32> = (0..SIDE * SIDE)
        .map(|k| {
            let (x, y) = (f64::from(k % SIDE), f64::from(k / SIDE));
            let wave = |a: f64| (std::f64::consts::TAU * a / f64::from(SIDE)).sin();
            (0.15 * wave(x) + 0.07 * wave(y + 1.0) + 0.04 * wave(x + y)) as f32
        })
        .collect();
    let mean = heights.iter().sum::<f32>() / (SIDE * SIDE) as f32;
    HeightField {
        columns: SIDE,
        rows: SIDE,
        aspect: 1.3,
        heights: heights.into_iter().map(|h| h - mean).collect(),
    }
}

/// Light from the middle of each slot well above the slopes: E = n · ω at the corners of each cell,
/// seen from within it.
#[test]
fn corners_take_light_by_their_own_slope() {
    let field = field();
    let visibility = ReliefVisibility::new(&device())
        .expect("the passes fit the device")
        .run(&field)
        .expect("they run");
    let count = field.facet_count();
    let shading = Shading {
        normals: (0..count).map(|q| field.facet(q).normal).collect(),
        reflectance: vec![Vec3::ZERO; count],
    };
    for k in [16, 64] {
        let directions = Directions::new(k).expect("a number of the paper");
        let factors = Factors::new(&directions, &field, &visibility, &shading, 1e-3);
        println!(
            "K = {k}: rank {}, left out {:.2e}",
            factors.rank, factors.error
        );
        // Measured: 7.9e-4; what is asked for is 1e-3.
        assert!(factors.error <= 1e-3);
        let (mut worst, mut swapped) = (0.0_f64, 0.0_f64);
        for slot in 0..directions.count() {
            let towards = directions.centre(slot);
            if towards.z < 0.6 {
                continue;
            }
            let mut moments = vec![[Vec3::ZERO; 3]; directions.count()];
            moments[slot] = [towards.as_vec3(); 3];
            let coefficients: Vec<Vec3> = factors.coefficients(&moments).collect();
            for cell in 0..i64::from(SIDE * SIDE) {
                let (i, j) = (cell % i64::from(SIDE), cell / i64::from(SIDE));
                for (right, up) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                    let along = field.point(i + 1, j + up) - field.point(i, j + up);
                    let across = field.point(i + right, j + 1) - field.point(i + right, j);
                    let expected = |a: f64, b: f64| {
                        DVec3::new(-a, -b / field.aspect, 1.0)
                            .normalize()
                            .dot(towards)
                    };
                    let inward = |at: i64, side: i64| at as f64 + 1e-3 + side as f64 * (1.0 - 2e-3);
                    let at = DVec2::new(inward(i, right), inward(j, up));
                    let found = f64::from(factors.irradiance(&field, at, &coefficients).x);
                    worst = worst.max((found - expected(along, across)).abs());
                    swapped = swapped.max((found - expected(across, along)).abs());
                }
            }
        }
        println!("K = {k}: largest difference {worst:.3}, with u for v {swapped:.3}");
        // What a slot's linear fit and the rank leave of n · ω, which is 1 from above.
        assert!(worst < 0.01 && swapped > 3.0 * worst);
    }
}
