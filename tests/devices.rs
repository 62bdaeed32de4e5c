//! Several devices give the bytes that one gives.

mod common;

use std::sync::Arc;

use common::{Build, assert_silent, device, own_device};
use glam::{DVec3, Vec3};
use mesolux::bake;
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::scene::{LoadOptions, Scene};
use mesolux::solver::{Estimator, Report, Settings, Solver, StopReason, Visibility, open_devices};
use mesolux::vk::Device;

/// Devices of one kind, each with threads of its own; the same for all of a test.
fn devices(count: usize) -> Vec<Arc<Device>> {
    thread_local!(static ALL: [Arc<Device>; 3] = std::array::from_fn(|_| own_device()));
    ALL.with(|all| all[..count].to_vec())
}

/// A room, or a floor below the open sky, with a lamp, a ball and a point light; floor and ball may
/// have a relief.
fn scene(relief: bool, closed: bool) -> Scene {
    let mut build = Build::new();
    let material = build.material(0.7, 0.0);
    let lamp = build.material(0.2, 3.0);
    if relief {
        let wave = |a: f64| (std::f64::consts::TAU * a).sin();
        build.relief(material, 8, |x, y| 0.03 * wave(x) * wave(y));
    }
    let floor = if closed {
        let sides = build.room(DVec3::ZERO, DVec3::ONE, 4, 0);
        build.paint(sides[0].clone(), material);
        sides[0].clone()
    } else {
        build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (6, 6), material)
    };
    build.uv(floor, 0.25 * DVec3::X, 0.25 * DVec3::Z);
    let ball = build.sphere(DVec3::new(0.5, 0.4, 0.5), 0.2, 2, true, material);
    build.uv(ball, DVec3::new(0.2, 0.05, 0.0), DVec3::new(0.0, 0.1, 0.2));
    let low = DVec3::new(0.3, 0.9, 0.3);
    if closed {
        // A body, so that all that is sent arrives, and form factors are scaled to that.
        build.solid(low, DVec3::new(0.4, 0.05, 0.4), 2, lamp);
    } else {
        build.quad(low, 0.4 * DVec3::X, 0.4 * DVec3::Z, (2, 2), lamp);
    }
    build.point_light(DVec3::new(0.2, 0.7, 0.8), 0.3);
    build.0.scene
}

fn settings() -> Settings {
    Settings {
        hemicube: 32,
        batch: 6,
        residual: 1e-4,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(16).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    }
}

/// All that a bake holds, to the bit.
fn bits(solver: &Solver) -> Vec<u32> {
    let light = solver.light().expect("the light comes back");
    let mut vectors: Vec<Vec3> = light.irradiance;
    vectors.extend(light.irradiance_direct);
    vectors.extend(light.radiosity);
    if let Some(relief) = light.relief {
        vectors.extend(relief.moments.iter().flatten());
        vectors.extend(relief.moments_direct.iter().flatten());
        vectors.extend(relief.exitant);
    }
    let words = vectors.iter().flat_map(|v| v.to_array());
    words.map(f32::to_bits).collect()
}

/// What the report counts, without what it times.
fn counts(report: &Report) -> String {
    let stopped = (
        report.stop,
        report.shots,
        report.unshot_share,
        report.error_bound,
    );
    let drawn = (
        report.hemicubes,
        report.emitter_hemicubes,
        report.emitters_by_rays,
        report.triangles_drawn,
    );
    let kept = (
        report.kept_sources,
        report.drawn_again,
        report.gathered_rows,
    );
    format!("{stopped:?} {drawn:?} {kept:?} {:?}", report.skipped)
}

fn solve(
    devices: &[Arc<Device>],
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
) -> Solver {
    bake::solve_by(&devices.into(), scene, settings, kept, |_| true).expect("the scene is solved")
}

/// Bakes with one device, two and three.
fn agree(what: &str, (scene, enclosed): (&Scene, bool), settings: &Settings) -> Report {
    let all = devices(3);
    let alone = solve(&all[..1], scene, settings, None);
    let report = alone.report().clone();
    assert_eq!(alone.problem.connections.enclosed, enclosed, "{what}");
    println!("{what}: {}", counts(&report));
    let bits_alone = bits(&alone);
    for several in [2, 3] {
        let together = solve(&all[..several], scene, settings, None);
        assert_eq!(
            counts(together.report()),
            counts(&report),
            "{what}, {several} devices"
        );
        assert!(
            bits(&together) == bits_alone,
            "{what}, {several} devices: other light"
        );
        assert_eq!(together.report().other_devices.len(), several - 1);
    }
    assert_silent();
    report
}

#[test]
fn several_devices_give_the_bytes_of_one() {
    for relief in [false, true] {
        for closed in [false, true] {
            let report = agree(
                &format!("relief {relief}, closed {closed}"),
                (&scene(relief, closed), closed),
                &settings(),
            );
            assert!(report.gathered_rows > 0 && report.hemicubes > 30);
            assert!(report.skipped.receivers_facing_away > 0);
        }
    }
}

#[test]
fn so_they_do_where_no_form_factors_are_kept() {
    for relief in [false, true] {
        let settings = Settings {
            visibility_memory: Some(0),
            residual: 5e-3,
            ..settings()
        };
        let what = format!("relief {relief}, no memory");
        let report = agree(&what, (&scene(relief, true), true), &settings);
        assert_eq!(report.kept_sources, 0);
        assert!(report.drawn_again > 0);
    }
}

/// Where there are fewer sources than devices, some have nothing to find.
#[test]
fn so_they_do_where_a_device_has_no_elements() {
    for relief in [false, true] {
        let mut build = Build::new();
        let wall = build.material(0.5, 0.0);
        let lamp = build.material(0.2, 3.0);
        if relief {
            build.relief(wall, 8, |x, y| 0.03 * (x * y));
        }
        let wall = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (1, 1), wall);
        build.uv(wall, DVec3::X, DVec3::Z);
        build.quad(DVec3::Y, DVec3::X, DVec3::Z, (1, 1), lamp);
        for memory in [None, Some(0)] {
            let settings = Settings {
                visibility_memory: memory,
                ..settings()
            };
            let what = format!("two squares, relief {relief}, memory {memory:?}");
            agree(&what, (&build.0.scene, false), &settings);
        }
    }
}

/// Each device has memory of its own: two keep about twice the rows, and draw fewer of them again.
/// What is drawn again is added up apart, so that the light differs by rounding, and by what may be
/// unshot.
#[test]
fn memory_for_rows_adds_up_over_devices() {
    const RESIDUAL: f64 = 1e-4;
    for relief in [false, true] {
        let scene = scene(relief, true);
        let settings = Settings {
            visibility_memory: Some(40 << 10),
            residual: RESIDUAL,
            ..settings()
        };
        let all = devices(2);
        let [one, two] = [1, 2].map(|count| solve(&all[..count], &scene, &settings, None));
        let kept = [&one, &two].map(|solver| solver.report().kept_sources);
        let again = [&one, &two].map(|solver| solver.report().drawn_again);
        let [a, b] = [&one, &two].map(|solver| solver.light().expect("it comes back").irradiance);
        let mean = a.iter().map(|e| f64::from(e.element_sum())).sum::<f64>() / a.len() as f64;
        let apart = |(a, b): (&Vec3, &Vec3)| f64::from((*a - b).abs().element_sum()) / mean;
        let apart = a.iter().zip(&b).map(apart).fold(0.0, f64::max);
        println!("relief {relief}: {kept:?} kept, {again:?} again, {apart:.1e} apart");
        assert!(kept[1] as f64 > 1.5 * kept[0] as f64 && again[1] < again[0]);
        assert!(kept[1] < two.report().sources && apart < 10.0 * RESIDUAL);
    }
    assert_silent();
}

#[test]
fn so_they_do_where_a_limit_of_shots_stops_them() {
    let scene = scene(true, true);
    for shots in [1, 33, 60] {
        let settings = Settings {
            shots: Some(shots),
            ..settings()
        };
        let report = agree(&format!("{shots} shots"), (&scene, true), &settings);
        assert_eq!((report.shots, report.stop), (shots, StopReason::Shots));
    }
}

/// Stopped after the same batches, and gone on with.
#[test]
fn so_they_do_when_they_are_interrupted_and_go_on() {
    let scene = scene(true, true);
    let settings = settings();
    let all = devices(2);
    let interrupted = |devices: &[Arc<Device>]| {
        let elements =
            bake::elements(&devices[0], &scene, &settings).expect("the relief fits the device");
        let lights = &scene.lights;
        let mut solver = Solver::by(&devices.into(), elements, lights, &settings, None)
            .expect("the scene fits the device");
        let mut parts = Vec::new();
        for batches in [1, 2, 5, usize::MAX] {
            let mut left = batches;
            solver
                .turn(|_| {
                    left -= 1;
                    left > 0
                })
                .expect("the device solves the scene");
            solver.gather().expect("the light is gathered");
            parts.push((counts(solver.report()), bits(&solver)));
        }
        parts
    };
    let [alone, together] = [1, 2].map(|count| interrupted(&all[..count]));
    for (part, (alone, together)) in alone.iter().zip(&together).enumerate() {
        assert_eq!(alone.0, together.0, "part {part}");
        assert!(alone.1 == together.1, "part {part}: other light");
    }
    assert!(alone[0].0.contains("Interrupted") && alone[3].0.contains("Residual"));
    assert_silent();
}

#[test]
fn several_devices_keep_and_relight_as_one() {
    let first = scene(true, true);
    let mut relit = first.clone();
    relit.lights.points[0].position.x += 0.3;
    let settings = settings();
    let all = devices(2);
    let made = [1, 2].map(|count| {
        let solver = solve(&all[..count], &first, &settings, None);
        let kept = solver.visibility(&first).expect("it comes back");
        kept.expect("it is kept")
    });
    let folder = tempfile::tempdir().expect("a folder for the test");
    let files = ["one", "two"].map(|name| folder.path().join(name));
    for (kept, file) in made.iter().zip(&files) {
        kept.save(file).expect("it is written");
    }
    let [one, two] = files.map(|file| std::fs::read(file).expect("it is read"));
    assert!(one == two, "other form factors are kept");
    let [alone, together] =
        [1, 2].map(|count| solve(&all[..count], &relit, &settings, Some(&made[1])));
    assert_eq!(counts(alone.report()), counts(together.report()));
    assert!(bits(&alone) == bits(&together));
    assert_silent();
}

/// Nor where a place is looked at from many places of an emitter in a large scene, which takes more
/// turns of a shader's loops than lavapipe lets one invocation make.
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn so_they_do_with_a_hundred_thousand_elements() {
    let options = LoadOptions {
        patches: Some(100_000),
        ..LoadOptions::default()
    };
    let scene = mesolux::scene::load("cornell", &options).expect("it is built in");
    let settings = Settings {
        shots: Some(64),
        ..Settings::default()
    };
    let all = devices(2);
    let [one, two] = [1, 2].map(|count| bits(&solve(&all[..count], &scene, &settings, None)));
    let other = one.iter().zip(&two).filter(|(a, b)| a != b).count();
    assert_eq!(other, 0, "of {} numbers", one.len());
    assert_silent();
}

#[test]
fn lists_of_devices_are_read_or_refused() {
    let name = device().name().to_owned();
    assert_eq!(open_devices(None, true).expect("the best").len(), 1);
    // A name may have commas of its own.
    assert_eq!(open_devices(Some(&name), true).expect("by name").len(), 1);
    let listed = open_devices(Some("0, 0,0"), true).expect("three times the first");
    assert_eq!(listed.len(), 3);
    for (list, told) in [
        ("0,97", "no device \"97\""),
        ("97,0", "no device \"97\""),
        ("0,,1", "missing"),
        ("0,", "missing"),
        (",0", "missing"),
        (",", "missing"),
        ("x y z", "no device \"x y z\""),
        ("0,x y z", "no device \"x y z\""),
        // Digits of a driver's version are no name.
        ("15", "no device \"15\""),
    ] {
        let error = open_devices(Some(list), true).err().expect("it is refused");
        let error = error.to_string();
        println!("{list}: {error}");
        assert!(
            error.contains(told) && !error.contains('\n'),
            "{list}: {error}"
        );
    }
    assert_silent();
}

#[test]
fn the_pixel_estimator_takes_one_device() {
    let settings = Settings {
        estimator: Estimator::Pixel,
        ..settings()
    };
    let scene = scene(false, true);
    let error = bake::solve_by(&devices(2)[..].into(), &scene, &settings, None, |_| true);
    let error = error.err().expect("it is refused").to_string();
    println!("{error}");
    assert!(error.contains("--estimator pixel") && error.contains("--device"));
    let none = bake::solve_by(&[][..].into(), &scene, &settings, None, |_| true);
    assert!(none.is_err());
}
