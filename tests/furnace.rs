//! The generalised furnace: in a closed scene where every surface emits 1 − ρ, the radiosity is 1 everywhere, whatever
//! the shapes and reflectances. It tests form factors, visibility, the solver's sums and its stop rule at once.

mod common;

use common::{Build, solve};
use glam::{DVec3, Vec3};
use mesolux::elements::Elements;
use mesolux::solver::{Estimator, Settings};

/// A box with two spheres afloat, ρ drawn at random in 0..0.9 for each element.
fn furnace() -> Elements {
    let mut build = Build::new();
    build.room(DVec3::ZERO, DVec3::new(1.0, 1.0, 1.0), 20, 0);
    build.sphere(DVec3::new(0.32, 0.3, 0.35), 0.2, 3, true, 0);
    build.sphere(DVec3::new(0.68, 0.62, 0.6), 0.17, 3, true, 0);
    let mut elements = Elements::new(&build.scene);
    let mut state = 1u64;
    let mut random = || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1u64 << 24) as f32
    };
    for e in 0..elements.len() {
        let rho = Vec3::new(random(), random(), random()) * 0.9;
        elements.reflectance[e] = rho;
        elements.emitted[e] = Vec3::ONE - rho;
    }
    elements
}

/// Area-weighted rms and largest error of the radiosity.
fn errors(estimator: Estimator) -> (f64, f64) {
    let solved = solve(
        furnace(),
        &[],
        &Settings {
            estimator,
            ..Settings::default()
        },
    );
    println!("{:?}", solved.report);
    let (mut sum, mut area, mut max) = (0.0, 0.0, 0f64);
    for (b, a) in solved.radiosity.iter().zip(&solved.area) {
        for c in b.to_array() {
            let error = f64::from(c) - 1.0;
            sum += a * error * error / 3.0;
            max = max.max(error.abs());
        }
        area += a;
    }
    ((sum / area).sqrt(), max)
}

#[test]
fn radiosity_is_one_everywhere() {
    let (rms, max) = errors(Estimator::Receiver);
    println!(
        "furnace, receiver: rms {:.3} %, max {:.2} %",
        100.0 * rms,
        100.0 * max
    );
    let (pixel_rms, pixel_max) = errors(Estimator::Pixel);
    println!(
        "furnace, pixel:    rms {:.3} %, max {:.2} %",
        100.0 * pixel_rms,
        100.0 * pixel_max
    );
    assert!(rms <= 3e-3 && max <= 2e-2, "rms {rms}, max {max}");
}
