//! The error bound: what is missing of the light when a bake stops early is no more than the bound
//! says, and not far less.

mod common;

use std::time::Duration;

use common::{Solved, solve};
use glam::{DVec3, Vec3};
use mesolux::mesh::elements::Elements;
use mesolux::scene::shapes::Shapes;
use mesolux::scene::{Lights, PointLight};
use mesolux::solver::{Settings, Solver, StopReason};

/// A closed room with a ball and a lamp in the ceiling. Walls on one side reflect `rho`, all else
/// less: half of it in some colours.
fn room(rho: f32) -> Elements {
    let mut shapes = Shapes::new();
    shapes.room(DVec3::ZERO, DVec3::new(1.0, 0.8, 1.2), 8, 0);
    shapes.sphere(DVec3::new(0.4, 0.3, 0.5), 0.2, 2, true, 0);
    let mut elements = Elements::new(&shapes.scene);
    // Places in the room, 0 to 1.
    let corners = || elements.vertices.iter().copied();
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let size = corners().fold(DVec3::NEG_INFINITY, DVec3::max) - low;
    for e in 0..elements.len() {
        let at = (elements.centroid[e] - low) / size;
        elements.reflectance[e] = match at.x > 0.5 {
            true => Vec3::splat(rho),
            false => Vec3::new(0.9, 0.5, 0.7) * rho,
        };
        let lamp = at.y > 0.99 && at.x.max(at.z) < 0.7 && at.x.min(at.z) > 0.3;
        elements.emitted[e] = Vec3::new(3.0, 2.0, 1.0) * f32::from(u8::from(lamp));
    }
    elements
}

/// Power that arrives, RGB together.
fn arrived(solved: &Solved) -> f64 {
    let each = solved.irradiance.iter().zip(&solved.area);
    each.map(|(light, area)| f64::from(light.element_sum()) * area)
        .sum()
}

fn emitted(elements: &Elements, lights: &Lights) -> f64 {
    let each = elements.emitted.iter().zip(&elements.area);
    let lamps: f64 = each
        .map(|(light, area)| f64::from(light.element_sum()) * area)
        .sum();
    let sphere = 4.0 * std::f64::consts::PI / elements.unit.powi(2);
    let of_light = |light: &PointLight| f64::from(light.intensity.iter().sum::<f32>()) * sphere;
    lamps + lights.points.iter().map(of_light).sum::<f64>()
}

#[test]
fn no_more_is_missing_than_the_bound_says() {
    holds(&[0.5, 0.9, 0.999], &Lights::NONE);
}

/// Its light at an element is no share of what the element sees.
#[test]
fn nor_by_a_point_light() {
    let light = PointLight {
        name: "bulb".into(),
        position: DVec3::new(0.8, 0.5, 0.9),
        intensity: [0.3, 0.2, 0.1],
        beam: None,
    };
    holds(&[0.9], &light.into());
}

fn holds(reflectances: &[f32], lights: &Lights) {
    for &rho in reflectances {
        let emitted = emitted(&room(rho), lights);
        let solve_to = |residual: f64, shots: Option<u32>| {
            let settings = Settings {
                residual,
                shots,
                // What is carried is not missing.
                carries: false,
                ..Settings::default()
            };
            solve(room(rho), lights, &settings)
        };
        let all = solve_to(1e-6, None);
        let sources = all.report.sources as u32;
        println!("reflectance {rho}: {sources} sources");
        for share in [8, 2] {
            check(rho, emitted, &all, &solve_to(1e-6, Some(sources / share)));
        }
        // Near the end the bound is that of each source.
        for residual in [4.0, 2.0, 1.0] {
            check(rho, emitted, &all, &solve_to(residual, None));
        }
        // Bright rooms need every source for so little.
        let residual = if rho < 0.9 { 0.01 } else { 0.5 };
        let stopped = solve_to(residual, None);
        let slack = check(rho, emitted, &all, &stopped);
        assert!(stopped.report.error_bound.is_some_and(|b| b <= residual));
        if stopped.report.shots < sources {
            // Measured: 1.01 to 1.13, with a point light 1.11.
            assert!(
                slack <= 2.0,
                "reflectance {rho}: bound {slack:.2} x what is missing"
            );
        }
        assert!(stopped.report.shots < sources || rho > 0.99);
    }
}

/// The bound over what is missing.
fn check(rho: f32, emitted: f64, all: &Solved, stopped: &Solved) -> f64 {
    let missing = (arrived(all) - arrived(stopped)) / emitted;
    let bound = stopped
        .report
        .error_bound
        .expect("all reflectances are below 1");
    let shots = stopped.report.shots;
    println!("  {shots} shots: missing {missing:.3e}, bound {bound:.3e}");
    // What `all` itself lacks, and rounding.
    let rounding = 2e-6 + 1e-6 * arrived(all) / emitted;
    // Sweeps may also leave too much.
    assert!(
        missing.abs() <= bound + rounding,
        "reflectance {rho}, {shots} shots"
    );
    bound / missing
}

/// Of the power that arrives in the end, what is missing where the light of undrawn sources is
/// carried, at most. Measured where 1/8, 1/4 and 1/2 of them are drawn: −0.012, −0.019, −0.011;
/// without −0.79, −0.72, −0.57.
const MOST_MISSING: f64 = 0.035;

/// The light of sources that are not drawn is sent by those beside them: little is missing, and
/// much less than without.
#[test]
fn neighbours_carry_the_light_of_undrawn_sources() {
    let solve_to = |carries: bool, residual: f64, shots: Option<u32>| {
        let settings = Settings {
            residual,
            shots,
            carries,
            ..Settings::default()
        };
        solve(room(0.9), &Lights::NONE, &settings)
    };
    let all = solve_to(true, 1e-6, None);
    let off = |stopped: &Solved| {
        let (mut sum, mut square) = (0.0, 0.0);
        for ((a, b), area) in (stopped.irradiance.iter().zip(&all.irradiance)).zip(&all.area) {
            let apart = f64::from((*a - *b).element_sum());
            sum += apart * area;
            square += apart * apart * area;
        }
        let whole: f64 = all.area.iter().sum();
        let mean = arrived(&all) / whole;
        [sum / whole / mean, (square / whole).sqrt() / mean]
    };
    let sources = all.report.sources as u32;
    for share in [8, 4, 2] {
        let [with, without] =
            [true, false].map(|carries| off(&solve_to(carries, 1e-6, Some(sources / share))));
        println!("1/{share} of {sources} drawn: bias, rms {with:.4?}; not carried {without:.4?}");
        assert!(with[0].abs() <= MOST_MISSING, "1/{share}");
        assert!(with[1] <= 0.5 * without[1], "1/{share}");
    }
}

/// What is carried bounces, and counts as missing: a bake draws on until the bound holds with it.
#[test]
fn the_bound_is_met_with_carried_light() {
    for (rho, residual) in [(0.5, 0.5), (0.5, 0.05), (0.9, 2.0), (0.9, 0.2)] {
        let settings = Settings {
            residual,
            ..Settings::default()
        };
        let solved = solve(room(rho), &Lights::NONE, &settings);
        let report = &solved.report;
        let bound = report.error_bound.expect("the room absorbs light");
        println!(
            "{rho}, {residual}: {} of {}, bound {bound}",
            report.shots, report.sources
        );
        assert!(bound <= residual && report.stop == StopReason::Residual);
    }
}

/// What was spent on the set-up is of the budget.
#[test]
fn spent_time_is_of_the_budget() {
    let budget = Duration::from_secs(1_000_000);
    for (spent, stop) in [
        (Duration::ZERO, StopReason::Residual),
        (budget, StopReason::Budget),
    ] {
        let settings = Settings {
            budget: Some(budget),
            ..Settings::default()
        };
        let device = common::device();
        let solver = Solver::new(&device, room(0.5), &Lights::NONE, &settings);
        let mut solver = solver.expect("the scene fits the device");
        solver.spend(spent);
        solver.run(|_| true).expect("the device solves the scene");
        assert_eq!(solver.report().stop, stop);
    }
}
