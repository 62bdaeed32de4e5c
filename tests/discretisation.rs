//! The report's estimate of what cutting into elements leaves, against light at random points.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::bench::measure::Measure;
use mesolux::bench::places::{Sample, place_of, places};
use mesolux::bench::truth::{PARTS, Truth};
use mesolux::path_tracer::PathTracer;
use mesolux::scene::{LoadOptions, Refinement, Scene};
use mesolux::solver::{Place, Settings};

/// A room with a block that stands aslant in it, and a lamp below the ceiling: 26 triangles.
fn room() -> Scene {
    let mut build = Build::new();
    let lamp = build.material(0.0, 10.0);
    let red = build.material(0.4, 0.0);
    build.room(DVec3::ZERO, DVec3::new(2.0, 2.0, 2.0), 1, 0);
    let foot = DVec3::new(0.9, 0.0, 0.3);
    let (u, v, up) = (
        DVec3::new(0.2, 0.0, 0.5),
        DVec3::new(-0.5, 0.0, 0.2),
        0.6 * DVec3::Y,
    );
    // Sides that face outward.
    build.quad(foot + up, u, -v, (1, 1), red);
    for (from, along) in [(foot, u), (foot + u, v), (foot + u + v, -u), (foot + v, -v)] {
        build.quad(from, up, along, (1, 1), red);
    }
    let corner = DVec3::new(0.8, 1.99, 0.8);
    build.quad(corner, 0.4 * DVec3::X, 0.4 * DVec3::Z, (1, 1), lamp);
    build.weld();
    build.scene.clone()
}

/// The estimate, and the rms at random points against [`mesolux::solver::Solver::light_at`].
fn estimate_and_truth(scene: &Scene, count: usize) -> [f64; 2] {
    let solver = mesolux::bake::solve(&device(), scene, &Settings::default(), None, |_| true)
        .expect("the scene is solved");
    let solution = mesolux::bake::solution(scene, &solver).expect("a solution");
    let tracer = PathTracer::new(scene).expect("a sound scene");
    let chosen = places(scene, &tracer, Sample::Some(count), 3).expect("places");
    let at: Vec<Place> = (chosen.iter())
        .map(|place| Place {
            position: place.position(scene),
            normal: place_of(scene, place.triangle).1,
        })
        .collect();
    let light: Vec<[Vec3; PARTS]> = (solver.light_at(&at).expect("good places").iter())
        .map(|light| [light.direct + light.indirect; PARTS])
        .collect();
    let truth = Truth {
        places: chosen,
        centroids: light.clone(),
        points: light,
        ..Truth::default()
    };
    let corners = solution.corners.as_ref().expect("corners");
    let found = Measure::new(&solution.irradiance, &corners.irradiance, &truth);
    let estimate = solution.report.discretisation.expect("an estimate");
    println!(
        "{} elements: estimate {:.2} %, truth {:.2} % ({:.2} to {:.2}), ratio {:.2}; {:.4?}",
        scene.triangles.len(),
        100.0 * estimate.rms,
        100.0 * found.points.rms,
        100.0 * found.points.rms_interval[0],
        100.0 * found.points.rms_interval[1],
        estimate.rms / found.points.rms,
        estimate.surfaces
    );
    [estimate.rms, found.points.rms]
}

fn cut(scene: &Scene, size: f64) -> Scene {
    scene.refined(&Refinement {
        element_size: Some(size),
        ..Refinement::default()
    })
}

#[test]
fn estimate_is_near_the_truth() {
    let room = room();
    for size in [0.8, 0.4] {
        let [estimate, truth] = estimate_and_truth(&cut(&room, size), 4000);
        assert!((1.0 / FACTOR..FACTOR).contains(&(estimate / truth)));
    }
    assert_silent();
}

/// Measured: 0.95 and 0.98. The truth itself is uncertain by 10 % and 20 %.
const FACTOR: f64 = 1.5;

/// Over eight scenes 0.54 to 1.06.
const FACTOR_OF_OTHERS: f64 = 2.5;

/// Of elements as the program cuts them, and of a statue: the estimate is of the right size. With
/// `MESOLUX_TEST_FIGURES`, the table of `docs/measurements.md`.
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn estimates_of_other_scenes() {
    let all = std::env::var_os("MESOLUX_TEST_FIGURES").is_some();
    let statue = |patches| {
        let options = LoadOptions {
            patches: Some(patches),
            ..LoadOptions::default()
        };
        mesolux::scene::load("cornell", &options).expect("a built-in scene")
    };
    let mut scenes = vec![room().refined(&Refinement::default()), statue(20_000)];
    if all {
        scenes.extend([0.8, 0.4, 0.2, 0.1].map(|size| cut(&room(), size)));
        scenes.extend([5000, 40_000].map(statue));
    }
    for scene in &scenes {
        let [estimate, truth] = estimate_and_truth(scene, if all { 6000 } else { 3000 });
        assert!((1.0 / FACTOR_OF_OTHERS..FACTOR_OF_OTHERS).contains(&(estimate / truth)));
    }
}

/// The command line and the report give the estimate, and that elements ran out.
#[test]
fn limits_are_reported() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let obj = mesolux::scene::write_scene(&room(), folder.path()).expect("written");
    let run = std::process::Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args([
            "bake",
            "--json",
            "--max-elements",
            "300",
            "-o",
            "o.safetensors",
        ])
        .arg(obj)
        .current_dir(folder.path())
        .output()
        .expect("the program runs");
    let said = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{said}");
    assert!(said.contains("--max-elements 300"), "{said}");
    assert!(
        said.contains("estimated error of cutting into elements"),
        "{said}"
    );
    let report: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
    let notes = report["notes"].as_array().expect("notes");
    let is_limit = |note: &serde_json::Value| note.to_string().contains("--max-elements");
    assert!(notes.iter().any(is_limit), "{notes:?}");
    let surfaces = report["discretisation"]["surfaces"].as_array();
    assert_eq!(surfaces.map(Vec::len), Some(2), "{report}");
}
