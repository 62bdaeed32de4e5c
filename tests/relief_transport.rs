//! Light between elements with a relief, by the whole program's way.

mod common;

use common::Build;
use glam::{DVec3, Vec3};
use mesolux::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::solver::Settings;

fn settings(transport: Transport, directions: u32) -> Settings {
    Settings {
        residual: 1e-4,
        relief: Options {
            transport,
            directions: Directions::new(directions).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    }
}

/// Bumps and grooves, rms slope near 0.5.
fn bumps(x: f64, y: f64) -> f64 {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.02 * wave(x) * wave(2.0 * y) + 0.01 * wave(3.0 * x + y)
}

/// A closed room with a sphere in it; floor, one wall and the sphere have a relief. Everywhere E = 1 − ρ.
fn furnace() -> Build {
    let mut build = Build::new();
    let mut material = |rho: f32| build.material(rho, (1.0 - rho) / std::f32::consts::PI);
    let [plain, floor, wall, ball] = [0.5, 0.8, 0.6, 0.7].map(&mut material);
    build.relief(floor, 24, |x, y| 0.25 * bumps(x, y));
    build.relief(wall, 24, |x, y| 0.25 * bumps(y, x));
    build.relief(ball, 24, |x, y| 0.25 * bumps(x, y));
    let sides = build.room(DVec3::ZERO, DVec3::new(1.0, 1.0, 1.0), 16, plain);
    let sphere = build.sphere(DVec3::new(0.5, 0.45, 0.55), 0.22, 3, true, ball);
    for (side, material) in [(&sides[0], floor), (&sides[2], wall)] {
        for t in &mut build.scene.triangles[side.clone()] {
            t.material = material;
        }
    }
    build.uv(sides[0].clone(), DVec3::Z * 0.25, DVec3::X * 0.25);
    build.uv(sides[2].clone(), DVec3::Y * 0.25, DVec3::Z * 0.25);
    // Box projection.
    for i in sphere {
        let t = &mut build.scene.triangles[i];
        let corners = t.vertices.map(|v| build.scene.vertices[v as usize]);
        let n = (corners[1] - corners[0])
            .cross(corners[2] - corners[0])
            .abs();
        let (u, v) = if n.x >= n.y && n.x >= n.z {
            (1, 2)
        } else if n.y >= n.z {
            (2, 0)
        } else {
            (0, 1)
        };
        t.uv = corners.map(|p| [(4.0 * p[u]) as f32, (4.0 * p[v]) as f32]);
    }
    build
}

#[test]
fn furnace_with_relief() {
    let build = furnace();
    for k in [16, 32, 64] {
        let solved = build.solve(&settings(Transport::Physical, k));
        let relief = solved.relief.as_ref().expect("three materials have one");
        let error = |values: &mut dyn Iterator<Item = Vec3>| {
            let errors: Vec<f64> = values.map(|b| f64::from(b.x) - 1.0).collect();
            let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
            (rms, errors.iter().fold(0.0_f64, |m, e| m.max(e.abs())))
        };
        let (rms, max) = error(&mut solved.radiosity.iter().copied());
        let (slot_rms, slot_max) = error(&mut relief.exitant.iter().copied());
        let classes = &solved
            .report
            .relief
            .as_ref()
            .expect("there is relief")
            .classes;
        println!(
            "furnace with relief, K = {k}: {} elements, {} with relief in {} classes: radiosity rms {:.3} %, max {:.2} %; by slot rms {:.3} %, max {:.2} %",
            solved.area.len(),
            relief.elements.len(),
            classes.len(),
            100.0 * rms,
            100.0 * max,
            100.0 * slot_rms,
            100.0 * slot_max
        );
        assert!(max <= 0.02);
    }
    // What the paper's transport loses.
    let solved = build.solve(&settings(Transport::Paper, 64));
    let mean = solved.mean(&solved.radiosity, 0..solved.area.len());
    println!(
        "furnace with relief, paper transport: mean radiosity {mean:.4}, {:.2} % of the light is lost",
        100.0 * (1.0 - mean)
    );
    assert!(mean < 0.99);
}
