//! The generalised furnace: in a closed scene where every surface emits 1 − ρ, the radiosity is 1
//! everywhere, whatever the shapes and reflectances. It tests form factors, visibility, the
//! solver's sums and its stop rule at once.

mod common;

use common::solve;
use mesolux::bench::stress::occluded_elements;
use mesolux::solver::{Estimator, Settings};

/// Area-weighted rms and largest error of the radiosity.
fn errors(estimator: Estimator) -> (f64, f64) {
    let solved = solve(
        occluded_elements(20, 3, 0.9),
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
