//! Suns, skies and beams in the solver.

mod common;

use std::f64::consts::PI;
use std::sync::Arc;

use common::{Build, Solved, assert_silent, device};
use glam::DVec3;
use mesolux::math::form_factor::{spread_in_triangle, to_polygon};
use mesolux::mesh::elements::Elements;
use mesolux::path_tracer::PathTracer;
use mesolux::picture::Light;
use mesolux::reference::light_rows::light_rows;
use mesolux::scene::sky::{Dome, Sky};
use mesolux::scene::{Beam, PointLight, Sun, Web};
use mesolux::solver::{Place, Settings, Solver};

fn uniform(radiance: f32) -> Sky {
    Sky {
        up: DVec3::Y,
        north: DVec3::Z,
        scale: [radiance; 3],
        dome: Dome::Uniform,
    }
}

/// A plane at every tilt θ receives π L (1 + cos θ)/2 of an even sky.
#[test]
fn a_plane_receives_what_it_sees_of_an_even_sky() {
    // 0.013 %.
    const MOST: f64 = 3e-4;
    for degrees in [0.0_f64, 30.0, 60.0, 90.0, 135.0, 180.0] {
        let tilt = degrees.to_radians();
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let y = DVec3::new(0.0, tilt.sin(), tilt.cos());
        let along = build.quad(DVec3::ZERO, y, DVec3::X, (4, 4), black);
        build.scene.lights.sky = Some(uniform(2.0));
        let solved = build.solve(&Settings::default());
        let expected = PI * (1.0 + tilt.cos());
        let found = solved.mean(&solved.irradiance, along.clone());
        assert!(
            (found - expected).abs() < MOST * 2.0 * PI,
            "{degrees}: {found}"
        );
        assert_eq!(
            solved.mean(&solved.direct, along),
            0.0,
            "the sky is indirect"
        );
    }
}

/// Light of a lamp, a sun and a sky together is the sum of theirs, with a plate between: what one
/// has on the device is not taken for another's.
#[test]
fn lights_of_all_kinds_add_up() {
    let lit = |[point, sun, sky]: [bool; 3]| {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (6, 6), black);
        let corner = DVec3::new(0.3, 0.4, 0.3);
        build.quad(corner, 0.3 * DVec3::Z, 0.3 * DVec3::X, (1, 1), black);
        // A plate that emits has places of its own.
        let lamp = build.material(0.0, 1.0);
        let corner = DVec3::new(0.7, 0.6, 0.7);
        build.quad(corner, 0.2 * DVec3::X, 0.2 * DVec3::Z, (1, 1), lamp);
        if point {
            build.point_light(DVec3::new(0.2, 0.8, 0.6), 0.5);
            build.point_light(DVec3::new(0.9, 0.5, 0.1), 0.25);
        }
        if sun {
            build.scene.lights.suns.push(Sun {
                towards: DVec3::new(0.3, 1.0, 0.2).normalize(),
                angle: 5.0,
                irradiance: [1.5; 3],
                name: "sun".into(),
            });
        }
        if sky {
            build.scene.lights.sky = Some(uniform(0.4));
        }
        build.solve(&Settings::default()).irradiance
    };
    let all = lit([true; 3]);
    let none = lit([false; 3]);
    let each = [0, 1, 2].map(|of| lit([0, 1, 2].map(|k| k == of)));
    let mut most = 0.0_f32;
    for e in 0..all.len() {
        let sum: glam::Vec3 = each.iter().map(|light| light[e] - none[e]).sum();
        most = most.max((all[e] - none[e] - sum).abs().max_element());
    }
    println!("largest difference {most:.1e}");
    assert!(most <= 1e-5, "{most}");
    assert!(each.iter().all(|light| light[3].x > none[3].x));
}

/// What triangles of the scene receive of an even sky of radiance 1 through an opening, by
/// Lambert's formula at 64 places of each.
fn through(build: &Build, opening: &[DVec3]) -> Vec<f64> {
    let mean = |t: &mesolux::scene::Triangle| {
        let [a, b, c] = build.scene.corners(t);
        let normal = (b - a).cross(c - a).normalize();
        let at = |k| {
            let [v, w] = spread_in_triangle(k);
            a + v * (b - a) + w * (c - a)
        };
        let seen = |k| to_polygon(at(k), normal, opening).abs();
        PI * (0..64).map(seen).sum::<f64>() / 64.0
    };
    build.scene.triangles.iter().map(mean).collect()
}

/// Root mean square over the mean, the mean's error and the worst element, as shares of the mean.
fn errors(solved: &Solved, expected: &[f64]) -> (f64, f64, f64) {
    let whole: f64 = solved.area.iter().sum();
    let by_area = |of: &dyn Fn(usize) -> f64| -> f64 {
        (0..expected.len())
            .map(|e| solved.area[e] * of(e))
            .sum::<f64>()
            / whole
    };
    let off = |e: usize| f64::from(solved.irradiance[e].x) - expected[e];
    let mean = by_area(&|e| expected[e]);
    let square = by_area(&|e| off(e).powi(2));
    let worst = (0..expected.len())
        .map(|e| off(e).abs())
        .fold(0.0, f64::max);
    (square.sqrt() / mean, by_area(&off) / mean, worst / mean)
}

/// Every element of a trench as wide as deep, and of a groove of 90°.
#[test]
fn a_trench_and_a_groove_receive_an_even_sky_through_their_opening() {
    // rms, bias, worst element over the mean.
    const MOST: [f64; 3] = [5e-3, 2e-3, 3e-2];
    let length = DVec3::Z * 8.0;
    for kind in ["trench", "groove"] {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        if kind == "trench" {
            build.quad(DVec3::ZERO, length, DVec3::X, (80, 10), black);
            build.quad(DVec3::ZERO, DVec3::Y, length, (10, 80), black);
            build.quad(DVec3::X, length, DVec3::Y, (80, 10), black);
            build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (10, 10), black);
            build.quad(length, DVec3::Y, DVec3::X, (10, 10), black);
        } else {
            let (left, right) = (DVec3::new(-0.5, 0.5, 0.0), DVec3::new(0.5, 0.5, 0.0));
            build.quad(DVec3::ZERO, left, length, (10, 80), black);
            build.quad(DVec3::ZERO, length, right, (80, 10), black);
            let first = build.vertex(DVec3::ZERO);
            let (a, b) = (build.vertex(left), build.vertex(right));
            build.triangle([first, b, a], black);
            let last = build.vertex(length);
            let (a, b) = (build.vertex(length + left), build.vertex(length + right));
            build.triangle([last, a, b], black);
        }
        build.weld();
        let low = if kind == "trench" {
            DVec3::Y
        } else {
            DVec3::new(-0.5, 0.5, 0.0)
        };
        let opening = [low, low + DVec3::X, low + DVec3::X + length, low + length];
        build.scene.lights.sky = Some(uniform(1.0));
        let solved = build.solve(&Settings::default());
        let (rms, bias, worst) = errors(&solved, &through(&build, &opening));
        println!(
            "{kind}: rms {rms:.2e}, bias {bias:.2e}, worst {worst:.2e}, {:.2} s",
            solved.report.seconds.solve_wall
        );
        assert!(
            rms < MOST[0] && bias.abs() < MOST[1] && worst < MOST[2],
            "{kind}: {rms} {bias} {worst}"
        );
    }
}

/// A room of 4 by 4 by 3 with a hole of 1 by 1 in its roof, or in a wall, as in CIE 171:2006 5.9
/// and 5.11; all places of its floor.
#[test]
fn places_and_elements_see_the_sky_through_a_hole() {
    // Of each place; of the elements rms, bias and the worst over the mean.
    const MOST_PLACE: f64 = 0.01;
    const MOST: [f64; 3] = [3e-2, 1e-2, 3e-1];
    for in_roof in [true, false] {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let floor = build.quad(DVec3::ZERO, 4.0 * z, 4.0 * x, (20, 20), black);
        build.quad(DVec3::ZERO, 3.0 * y, 4.0 * z, (1, 1), black);
        build.quad(4.0 * x, 4.0 * z, 3.0 * y, (1, 1), black);
        build.quad(4.0 * z, 3.0 * y, 4.0 * x, (1, 1), black);
        let (sides, corner) = match in_roof {
            true => ([4.0 * x, 4.0 * z], 3.0 * y),
            false => ([4.0 * x, 3.0 * y], DVec3::ZERO),
        };
        // A frame about the hole, which lies in the middle.
        let [u, v] = sides.map(|side| side.normalize());
        let (wide, high) = (sides[0].length(), sides[1].length());
        let (left, below) = ((wide - 1.0) / 2.0, (high - 1.0) / 2.0);
        for (at, across, up) in [
            (DVec3::ZERO, wide, below),
            ((below + 1.0) * v, wide, below),
            (below * v, left, 1.0),
            (below * v + (left + 1.0) * u, left, 1.0),
        ] {
            build.quad(corner + at, across * u, up * v, (1, 1), black);
        }
        if in_roof {
            build.quad(DVec3::ZERO, 4.0 * x, 3.0 * y, (1, 1), black);
        } else {
            build.quad(3.0 * y, 4.0 * x, 4.0 * z, (1, 1), black);
        }
        let hole = corner + left * u + below * v;
        let opening = [hole, hole + u, hole + u + v, hole + v];
        build.scene.lights.sky = Some(uniform(1.0));
        let elements = Elements::new(&build.scene);
        let mut solver = Solver::new(
            &device(),
            elements,
            &build.scene.lights,
            &Settings::default(),
        )
        .expect("it fits");
        solver.run(|_| true).expect("it is solved");
        let expected = through(&build, &opening);
        let mut most: f64 = 0.0;
        for i in 0..100 {
            let place = DVec3::new(
                0.2 + 0.4 * f64::from(i % 10),
                0.0,
                0.2 + 0.4 * f64::from(i / 10),
            );
            let place = Place {
                position: place,
                normal: y,
            };
            let found = solver.light_at(&[place]).expect("it is good")[0].indirect.x;
            // Only what is seen of a sky above the horizon: all of it.
            let right = PI * to_polygon(place.position, y, &opening).abs();
            most = most.max((f64::from(found) / right - 1.0).abs());
        }
        let light = solver.light().expect("the device gives it");
        let e = &solver.problem.elements;
        let solved = Solved {
            area: e.to_input_order(&e.area),
            irradiance: e.to_input_order(&light.irradiance),
            direct: Vec::new(),
            radiosity: Vec::new(),
            relief: None,
            report: solver.report().clone(),
        };
        let on_floor = Solved {
            area: solved.area[floor.clone()].to_vec(),
            irradiance: solved.irradiance[floor.clone()].to_vec(),
            ..solved
        };
        let (rms, bias, worst) = errors(&on_floor, &expected[floor]);
        println!(
            "in the roof {in_roof}: places {most:.1e}; elements rms {rms:.2e}, bias {bias:.2e}, worst {worst:.2e}"
        );
        assert!(most < MOST_PLACE, "{most}");
        assert!(
            rms < MOST[0] && bias.abs() < MOST[1] && worst < MOST[2],
            "{rms} {bias} {worst}"
        );
        assert_silent();
    }
}

/// A plate above a floor: the sun's power is cut by the plate's shadow, exactly.
#[test]
fn the_sun_casts_the_shadow_of_a_plate() {
    const MOST: f64 = 2e-3;
    for angle in [0.0, 0.53, 10.0] {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let floor = build.quad(
            DVec3::new(-2.0, 0.0, -2.0),
            DVec3::Z * 4.0,
            DVec3::X * 4.0,
            (40, 40),
            black,
        );
        let plate = build.quad(
            DVec3::new(-0.4, 0.7, -0.4),
            DVec3::X * 0.8,
            DVec3::Z * 0.6,
            (3, 3),
            black,
        );
        let above = build.quad(
            DVec3::new(-0.4, 0.7, -0.4),
            DVec3::Z * 0.6,
            DVec3::X * 0.8,
            (3, 3),
            black,
        );
        let towards = DVec3::new(0.3, 0.8, 0.2).normalize();
        build.scene.lights.suns.push(Sun {
            name: "sun".into(),
            towards,
            irradiance: [3.0; 3],
            angle,
        });
        let solved = build.solve(&Settings::default());
        let floor_power = 16.0 * solved.mean(&solved.direct, floor);
        let expected = 3.0 * towards.y * (16.0 - 0.48);
        println!("{angle}: {}", floor_power / expected - 1.0);
        assert!(
            (floor_power / expected - 1.0).abs() < MOST,
            "{floor_power} {expected}"
        );
        assert_eq!(solved.mean(&solved.direct, plate), 0.0);
        let on_it = solved.mean(&solved.direct, above);
        assert!((on_it / (3.0 * towards.y) - 1.0).abs() < MOST, "{on_it}");
    }
}

/// A court with a sun, a sky and a spot, against the path tracer.
#[test]
fn bounces_agree_with_the_path_tracer() {
    // Of the mean, rms and bias.
    const MOST: [f64; 2] = [3e-2, 1e-2];
    let mut build = Build::new();
    let grey = build.material(0.6, 0.0);
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 1.5, DVec3::Z * 2.0);
    build.quad(DVec3::ZERO, z, x, (14, 14), grey);
    build.quad(DVec3::ZERO, y, z, (10, 14), grey);
    build.quad(x, z, y, (14, 10), grey);
    build.quad(DVec3::ZERO, x, y, (14, 10), grey);
    build.quad(z, y, x, (10, 14), grey);
    build.solid(
        DVec3::new(0.7, 0.2, 0.8),
        DVec3::new(0.5, 0.4, 0.6),
        5,
        grey,
    );
    build.weld();
    build.scene.lights.sky = Some(uniform(0.4));
    build.scene.lights.suns.push(Sun {
        name: "sun".into(),
        towards: DVec3::new(0.4, 0.8, 0.3).normalize(),
        irradiance: [3.0; 3],
        angle: 2.0,
    });
    // Brighter along its axis.
    let web = Web {
        rows: 181,
        columns: 1,
        shares: (0..181)
            .map(|i| f32::from(i as u16).to_radians().cos().max(0.0).powi(4))
            .collect(),
    };
    let axis = DVec3::new(-0.3, -1.0, 0.2).normalize();
    build.scene.lights.points.push(PointLight {
        name: "spot".into(),
        position: DVec3::new(1.6, 1.3, 0.4),
        intensity: [1.5; 3],
        beam: Some(Beam {
            axis,
            zero: axis.any_orthonormal_vector(),
            web: Arc::new(web),
        }),
    });
    let solved = build.solve(&Settings {
        residual: 1e-3,
        ..Settings::default()
    });
    let tracer = PathTracer::new(&build.scene).expect("it can be traced");
    let (mut sum, mut off, mut square, mut noise) = (0.0, 0.0, 0.0, 0.0);
    let mut count = 0.0;
    for e in (3..build.scene.triangles.len()).step_by(29) {
        let (found, spread) = mean_irradiance(&tracer, &build, e);
        let error = f64::from(solved.irradiance[e].x) - found;
        sum += found;
        off += error;
        square += error * error;
        noise += spread;
        count += 1.0;
    }
    let mean = sum / count;
    let rms = ((square - noise).max(0.0) / count).sqrt() / mean;
    let bias = off / sum;
    println!(
        "{count} elements: rms {rms:.2e} (noise {:.1e}), bias {bias:.2e}",
        (noise / count).sqrt() / mean
    );
    assert!(rms < MOST[0] && bias.abs() < MOST[1], "{rms} {bias}");
}

/// Mean irradiance over places of a triangle, and its squared standard error.
fn mean_irradiance(tracer: &PathTracer<'_>, build: &Build, e: usize) -> (f64, f64) {
    let [a, b, c] = build.scene.corners(&build.scene.triangles[e]);
    let normal = (b - a).cross(c - a).normalize();
    let found: Vec<f64> = (0..16)
        .map(|k| {
            let [v, w] = spread_in_triangle(k);
            let place = a + v * (b - a) + w * (c - a);
            let paths = 1 << 12;
            let seed = 16 * e as u64 + k as u64;
            f64::from(
                tracer
                    .irradiance(place, normal, paths, seed, Light::Global)
                    .0
                    .x,
            )
        })
        .collect();
    let mean = found.iter().sum::<f64>() / 16.0;
    let spread: f64 = found.iter().map(|f| (f - mean).powi(2)).sum();
    (mean, spread / 16.0 / 15.0)
}

/// Light of every element against the sum of the twin's rows: a room with a ball, a hole and a
/// corner of the sky.
#[test]
fn rows_are_those_of_the_twin() {
    // Of the mean: rounding of rows and single rays along edges.
    const MOST: f64 = 2e-2;
    const MOST_RMS: f64 = 1e-3;
    let mut build = Build::new();
    let black = build.material(0.0, 0.0);
    build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (4, 4), black);
    build.quad(DVec3::ZERO, DVec3::Y, DVec3::Z, (4, 4), black);
    build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (4, 4), black);
    build.sphere(DVec3::new(0.5, 0.4, 0.5), 0.3, 1, true, black);
    build.weld();
    build.scene.lights.sky = Some(uniform(1.0));
    build.scene.lights.suns.push(Sun {
        name: "sun".into(),
        towards: DVec3::new(0.5, 0.6, 0.62).normalize(),
        irradiance: [1.0; 3],
        angle: 5.0,
    });
    let elements = Elements::new(&build.scene);
    let mut solver = Solver::new(
        &device(),
        elements,
        &build.scene.lights,
        &Settings::default(),
    )
    .expect("it fits");
    solver.run(|_| true).expect("it is solved");
    let light = solver.light().expect("the device gives it");
    let problem = &solver.problem;
    let occluders = problem
        .occluders
        .casters(&problem.elements, &problem.connections);
    let mut expected = vec![0.0; problem.elements.len()];
    for source in problem.sources.list.iter().filter(|s| s.emitted.x > 0.0) {
        let row = light_rows(&problem.elements, &occluders, source);
        for (sum, factor) in expected.iter_mut().zip(row) {
            *sum += factor * f64::from(source.emitted.x);
        }
    }
    let count = expected.len() as f64;
    let mean = expected.iter().sum::<f64>() / count;
    let errors = || (light.irradiance.iter().zip(&expected)).map(|(f, e)| f64::from(f.x) - e);
    let worst = errors().fold(0.0_f64, |most, off| most.max(off.abs())) / mean;
    let rms = (errors().map(|off| off * off).sum::<f64>() / count).sqrt() / mean;
    println!("rms {rms:.2e}, worst {worst:.2e}");
    assert!(worst < MOST && rms < MOST_RMS, "{worst} {rms}");
}
