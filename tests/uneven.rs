//! Sources are cut where they are lit unevenly: what a source's mean costs where shadows end.

mod common;

use common::Build;
use glam::DVec3;
use mesolux::solver::Settings;

/// A room of 3 m with a lamp below its ceiling and a table that shades the floor.
fn room() -> Build {
    let mut build = Build::new();
    let lamp = build.material(0.2, 10.0);
    build.room(DVec3::ZERO, DVec3::splat(3.0), 14, 0);
    let (x, z) = (DVec3::X, DVec3::Z);
    build.quad(DVec3::new(1.2, 2.9, 1.2), 0.6 * x, 0.6 * z, (4, 4), lamp);
    build.quad(DVec3::new(0.4, 1.0, 0.6), 1.3 * z, 1.1 * x, (6, 6), 0);
    build.quad(DVec3::new(0.4, 0.97, 0.6), 1.1 * x, 1.3 * z, (6, 6), 0);
    build.weld();
    build
}

/// Against each element as a source of its own.
#[test]
fn uneven_light_costs_little() {
    let build = room();
    let one = Settings::default();
    let coarse = build.solve(&one);
    let mut each = one.clone();
    each.grouping.max_elements = 1;
    each.grouping.max_area = 1.0 / 2400.0;
    let fine = build.solve(&each);
    let all = 0..fine.area.len();
    let mean = fine.mean(&fine.irradiance, all.clone());
    let apart: Vec<f64> = (coarse.irradiance.iter().zip(&fine.irradiance))
        .map(|(ours, truth)| f64::from((*ours - *truth).element_sum()) / 3.0 / mean)
        .collect();
    let total: f64 = fine.area.iter().sum();
    let over = |of: &dyn Fn(f64) -> f64| {
        let terms = apart.iter().zip(&fine.area);
        terms.map(|(&apart, area)| area * of(apart)).sum::<f64>() / total
    };
    let (bias, rms) = (over(&|a| a), over(&|a| a * a).sqrt());
    let (sources, most) = (coarse.report.sources, fine.report.sources);
    println!("{sources} sources against {most}: bias {bias:.5}, rms {rms:.5}");
    assert!(most > 2 * sources);
    assert!(bias.abs() < BIAS && rms < RMS);
}

/// Measured: −1.8e-4 and 3.1e-3; −5.8e-4 and 4.5e-3 where sources are cut by size alone.
const BIAS: f64 = 4e-4;
const RMS: f64 = 4e-3;
