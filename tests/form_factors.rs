//! Form factors through the whole GPU path against closed forms.

mod common;

use common::Build;
use glam::DVec3;
use mesolux::solver::{Estimator, Settings};

/// Mean form factor from a receiver range to an emitter of radiosity 1, by one emission and no
/// reflection.
fn form_factor(build: &Build, receivers: std::ops::Range<usize>, estimator: Estimator) -> f64 {
    let settings = Settings {
        estimator,
        ..Settings::default()
    };
    let solved = build.solve(&settings);
    // Ke = 1 gives a radiosity of π.
    solved.mean(&solved.direct, receivers) / std::f64::consts::PI
}

/// Coaxial parallel rectangles a × b at distance 1 (C-11): receiver below, emitter above.
fn c11(x: f64, y: f64, cells: (u32, u32)) -> [f64; 2] {
    let mut build = Build::new();
    let black = build.material(0.0, 0.0);
    let light = build.material(0.0, 1.0);
    let (u, v) = (DVec3::X * x, DVec3::Y * y);
    let low = build.quad(DVec3::ZERO, u, v, cells, black);
    build.quad(DVec3::Z, v, u, (cells.1, cells.0), light);
    [Estimator::Receiver, Estimator::Pixel].map(|e| form_factor(&build, low.clone(), e))
}

/// Of the `receiver` estimator; measured: 1.5e-3.
const RECEIVER: f64 = 2.5e-3;

/// Of the `pixel` estimator; measured: 4.5e-3, and 1.9 % of a rectangle that the other is ten times
/// as long as.
const PARALLEL: f64 = 9e-3;
const TOUCHING: f64 = 4e-2;

#[test]
fn parallel_rectangles() {
    for (x, y, cells, exact) in [
        (1.0, 1.0, (12, 12), 0.19982489569838738),
        (2.0, 1.0, (16, 8), 0.28587538485071473),
        (0.5, 0.5, (8, 8), 0.06858958881855244),
        (10.0, 10.0, (40, 40), 0.8269945223972566),
        (0.1, 0.1, (4, 4), 0.003162056838757602),
        (4.0, 0.25, (32, 2), 0.10381291391603246),
    ] {
        let [receiver, pixel] = c11(x, y, cells);
        let error = receiver / exact - 1.0;
        println!(
            "C-11 X={x} Y={y}: receiver {:+.4} %, pixel {:+.2} %",
            100.0 * error,
            100.0 * (pixel / exact - 1.0)
        );
        assert!(
            error.abs() <= RECEIVER,
            "C-11 {x} {y}: {receiver} for {exact}"
        );
        let error = pixel / exact - 1.0;
        assert!(error.abs() <= PARALLEL, "C-11 {x} {y}: {pixel} for {exact}");
    }
}

#[test]
fn perpendicular_rectangles_that_touch() {
    for (h, w, exact) in [
        (1.0, 1.0, 0.20004377607540316),
        (2.0, 1.0, 0.23285260279536188),
        (1.0, 2.0, 0.11642630139768094),
        (0.5, 0.5, 0.2406360061769617),
        (0.1, 1.0, 0.04325136940068586),
    ] {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let light = build.material(0.0, 1.0);
        let base = build.quad(DVec3::ZERO, DVec3::X * w, DVec3::Y, (16, 16), black);
        build.quad(DVec3::ZERO, DVec3::Y, DVec3::Z * h, (16, 16), light);
        build.weld();
        let receiver = form_factor(&build, base.clone(), Estimator::Receiver);
        let pixel = form_factor(&build, base, Estimator::Pixel);
        let error = receiver / exact - 1.0;
        println!(
            "C-14 H={h} W={w}: receiver {:+.4} %, pixel {:+.2} %",
            100.0 * error,
            100.0 * (pixel / exact - 1.0)
        );
        assert!(
            error.abs() <= RECEIVER,
            "C-14 {h} {w}: {receiver} for {exact}"
        );
        let error = pixel / exact - 1.0;
        assert!(error.abs() <= TOUCHING, "C-14 {h} {w}: {pixel} for {exact}");
    }
}
