//! The generalised furnace: in a closed scene where every surface emits 1 − ρ, the radiosity is 1
//! everywhere, whatever the shapes and reflectances. It tests form factors, visibility, the
//! solver's sums and its stop rule at once.

mod common;

use common::solve;
use glam::Vec3;
use mesolux::bench::stress::occluded_elements;
use mesolux::solver::{Estimator, Settings};

/// Area-weighted rms and largest error of the radiosity.
fn errors(estimator: Estimator) -> (f64, f64) {
    let solved = solve(
        occluded_elements(20, 3, 0.9),
        &mesolux::scene::Lights::NONE,
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
    // Measured: 1.1e-3 and 0.91 %; of pixels 3.0 and 26 %.
    assert!(rms <= 2e-3 && max <= 1.8e-2, "rms {rms}, max {max}");
    assert!(
        pixel_rms <= 0.06 && pixel_max <= 0.5,
        "pixel: rms {pixel_rms}, max {pixel_max}"
    );
}

/// Black surfaces that all emit one radiosity receive it everywhere. Each source is a strong
/// emitter, of which rays find the share that is seen.
#[test]
fn irradiance_is_that_of_all_emitters() {
    let mut elements = occluded_elements(20, 3, 0.0);
    elements.emitted.fill(Vec3::ONE);
    let solved = solve(
        elements,
        &mesolux::scene::Lights::NONE,
        &Settings::default(),
    );
    let (mut sum, mut area, mut max) = (0.0, 0.0, 0f64);
    for (e, a) in solved.irradiance.iter().zip(&solved.area) {
        let error = f64::from(e.x) - 1.0;
        sum += a * error * error;
        area += a;
        max = max.max(error.abs());
    }
    let rms = (sum / area).sqrt();
    println!("{:?}", solved.report.by_rays);
    println!("rms {:.3} %, max {:.2} %", 100.0 * rms, 100.0 * max);
    assert!(solved.report.by_rays.silhouettes > 100_000);
    assert!(
        rms <= STRONG_RMS && max <= STRONG_MOST,
        "rms {rms}, max {max}"
    );
}

/// Measured: 1.02e-3 and 0.96 %; with places of one weight the first was 3e-4 more.
const STRONG_RMS: f64 = 1.05e-3;
const STRONG_MOST: f64 = 2e-2;
