//! A bake that was stopped goes on from its checkpoint to the same bytes as one that never was.

mod common;

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use common::{Build, assert_silent, device};
use mesolux::bake::{self, solution::Solution};
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::scene::Scene;
use mesolux::solver::{Checkpoints, Settings, Visibility};

fn settings(transport: Transport, folder: &Path) -> Settings {
    Settings {
        hemicube: 32,
        batch: 4,
        residual: 1e-3,
        relief: Options {
            transport,
            directions: Directions::new(16).expect("a number of the paper"),
            cache: None,
        },
        checkpoints: Some(Checkpoints {
            folder: folder.join("room.checkpoint"),
            every: Duration::ZERO,
            maker: "a test".into(),
        }),
        ..Settings::default()
    }
}

/// Bakes until so many looks at how far it is.
fn solve(scene: &Scene, settings: &Settings, kept: Option<&Visibility>, looks: u32) -> Solution {
    let mut looked = 0;
    let solver = bake::solve(&device(), scene, settings, kept, |_| {
        looked += 1;
        looked < looks
    });
    bake::solution(scene, &solver.expect("the scene is solved")).expect("it comes back")
}

/// Tensors and counts, without times.
fn result(solution: &Solution) -> (Vec<Vec<u8>>, String) {
    let report = &solution.report;
    let counts = format!(
        "{} {} {} {:?} {:?} {:?} {:?} {:?} {} {}",
        report.shots,
        report.hemicubes,
        report.emitters_by_rays,
        report.pairs,
        report.by_rays,
        report.skipped,
        report.raw_sums,
        report.stop,
        report.kept_sources,
        report.gathered_rows,
    );
    let tensors = solution.tensors().into_iter().map(|tensor| tensor.bytes);
    (tensors.collect(), counts)
}

const WHOLE: u32 = u32::MAX;

/// Stopped again and again, each time a few batches further on: with relief and without, with
/// memory for all rows, for some and for none.
#[test]
fn a_stopped_bake_goes_on_to_the_same_bytes() {
    let scene = Build::room_with_ball(true).0.scene;
    for (transport, memory) in [
        (Transport::Physical, None),
        (Transport::Physical, Some(12 << 10)),
        (Transport::Lambert, None),
        (Transport::Lambert, Some(6 << 10)),
        (Transport::Lambert, Some(0)),
    ] {
        let folder = tempfile::tempdir().expect("a folder");
        let settings = Settings {
            visibility_memory: memory,
            ..settings(transport, folder.path())
        };
        let never = Settings {
            checkpoints: None,
            ..settings.clone()
        };
        let expected = solve(&scene, &never, None, WHOLE);
        let drawn = expected.report.drawn_again;
        assert_eq!(drawn > 0, memory.is_some(), "{memory:?}: {drawn} again");
        let mut resumed = Vec::new();
        for looks in [3, 30, WHOLE] {
            let found = solve(&scene, &settings, None, looks);
            resumed.push(found.report.resumed);
            if looks == WHOLE {
                assert!(result(&found) == result(&expected), "{memory:?}");
            }
        }
        println!("{transport:?} {memory:?}: goes on from {resumed:?} rows, {drawn} drawn again");
        assert!(resumed.is_sorted() && resumed[0] == 0);
        assert_eq!(resumed[1] > 0 && resumed[2] > 20, memory != Some(0));
        let checkpoints = settings.checkpoints.expect("they are set");
        assert_eq!(checkpoints.exist(), memory != Some(0));
        checkpoints.remove();
        assert!(!checkpoints.folder.exists());
    }
    assert_silent();
}

/// Also with form factors that an earlier bake has kept.
#[test]
fn relighting_goes_on_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(Transport::Physical, folder.path());
    let mut scene = Build::room_with_ball(true).0.scene;
    let device = device();
    let few = Settings {
        shots: Some(20),
        checkpoints: None,
        ..settings.clone()
    };
    let solver = bake::solve(&device, &scene, &few, None, |_| true).expect("it is solved");
    let kept = solver.visibility(&scene).expect("it comes back");
    scene.lights.points[0].intensity = [3.0, 2.0, 1.0];
    let never = Settings {
        checkpoints: None,
        ..settings.clone()
    };
    let expected = solve(&scene, &never, kept.as_ref(), WHOLE);
    let stopped = solve(&scene, &settings, kept.as_ref(), 4);
    let found = solve(&scene, &settings, kept.as_ref(), WHOLE);
    assert_eq!(
        (stopped.report.resumed, found.report.resumed > 8),
        (0, true)
    );
    assert!(result(&found) == result(&expected));
    // Without the kept rows it is another bake.
    assert_eq!(solve(&scene, &settings, None, 2).report.resumed, 0);
    assert_silent();
}

/// A checkpoint of another scene, of other settings or of another program; parts that are cut off,
/// changed, or lacking; a folder that cannot be written.
#[test]
fn what_is_no_checkpoint_is_not_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let settings = settings(Transport::Lambert, folder.path());
    let checkpoints = settings.checkpoints.as_ref().expect("they are set");
    let part = |i: u32| checkpoints.folder.join(format!("{i:04}.rows"));
    let scene = Build::room_with_ball(true).0.scene;
    let expected = result(&solve(&scene, &settings, None, WHOLE));
    let begin = || {
        checkpoints.remove();
        solve(&scene, &settings, None, 6);
        assert!(part(4).is_file() && !part(8).is_file());
    };
    let goes_on = |scene: &Scene, settings: &Settings| {
        let found = solve(scene, settings, None, WHOLE);
        (found.report.resumed, result(&found) == expected)
    };

    begin();
    // Six batches of four, and the two that were under way.
    assert_eq!(goes_on(&scene, &settings).0, 32);
    let mut painted = scene.clone();
    painted.materials[1].ke = [1.0, 2.0, 3.0];
    begin();
    assert_eq!(goes_on(&painted, &settings), (0, false));
    begin();
    let turned = Settings {
        seed: 1,
        ..settings.clone()
    };
    assert_eq!(goes_on(&scene, &turned), (0, false));
    begin();
    let rebuilt = Settings {
        checkpoints: Some(Checkpoints {
            maker: "another test".into(),
            ..checkpoints.clone()
        }),
        ..settings.clone()
    };
    assert_eq!(goes_on(&scene, &rebuilt), (0, true));

    let mut rows = Vec::new();
    for damage in ["cut off", "changed", "lacking", "another", "a folder"] {
        begin();
        let whole = std::fs::read(part(2)).expect("a part");
        let mut changed = whole.clone();
        *changed.last_mut().expect("bytes") ^= 1;
        match damage {
            "cut off" => std::fs::write(part(2), &whole[..whole.len() / 2]),
            "changed" => std::fs::write(part(2), changed),
            "lacking" => std::fs::remove_file(part(2)),
            "another" => std::fs::copy(part(1), part(2)).map(drop),
            _ => std::fs::remove_file(part(2)).and_then(|()| std::fs::create_dir(part(2))),
        }
        .expect("it is damaged");
        let (resumed, same) = goes_on(&scene, &settings);
        assert!(same, "{damage}");
        rows.push(resumed);
        let _ = std::fs::remove_dir_all(&checkpoints.folder);
    }
    println!("goes on from {rows:?} rows");
    assert!(rows[0] > 0 && rows.iter().all(|found| *found == rows[0]));

    std::fs::write(&checkpoints.folder, "in its way").expect("a file");
    assert_eq!(goes_on(&scene, &settings), (0, true));
    assert_silent();
}

fn program(folder: &Path, output: &str, more: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_mesolux"));
    command
        .args(["bake", "cornell", "--no-cache", "--patches", "4000"])
        .args(["--hemicube", "64", "-o", output])
        .args(more)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    if let Ok(device) = std::env::var("MESOLUX_TEST_DEVICE") {
        command.args(["--device", &device]);
    }
    command.spawn().expect("the program starts")
}

fn tensors(path: &Path) -> Vec<u8> {
    let bytes = std::fs::read(path).expect("a bake");
    let (header, _) = safetensors::SafeTensors::read_metadata(&bytes).expect("a header");
    bytes[8 + header..].to_vec()
}

/// Killed at places that are spread over the whole of a bake, and once more while it goes on.
/// `MESOLUX_TEST_KILLS` sets how many.
#[test]
#[ignore = "long: runs by scripts/test --all"]
fn killed_bakes_go_on_to_the_same_bytes() {
    let kills = std::env::var("MESOLUX_TEST_KILLS").map_or(10, |n| n.parse().expect("a number"));
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let often = ["--checkpoint", "0.05"];
    let start = Instant::now();
    let never = program(folder.path(), "never.safetensors", &["--checkpoint", "0"]).wait();
    let whole = start.elapsed();
    assert!(never.expect("it ran").success());
    let expected = tensors(&path("never.safetensors"));
    let (mut went_on, mut ended) = (0, 0);
    for i in 1..=kills {
        // Shares of the golden ratio fill an interval evenly.
        let share = (f64::from(i) * 0.618_033_988_75).fract();
        for share in [share, 0.5 * share] {
            let mut child = program(folder.path(), "killed.safetensors", &often);
            std::thread::sleep(whole.mul_f64(share));
            let _ = child.kill();
            let status = child.wait().expect("it ran");
            ended += u32::from(status.success());
        }
        went_on += u32::from(path("killed.checkpoint/0000.rows").is_file());
        let done = program(folder.path(), "killed.safetensors", &often).wait();
        assert!(done.expect("it ran").success());
        assert!(tensors(&path("killed.safetensors")) == expected, "kill {i}");
        let left = std::fs::read_dir(folder.path()).expect("a folder");
        let names = left.map(|entry| entry.expect("an entry").file_name());
        let names: Vec<_> = names.filter_map(|name| name.into_string().ok()).collect();
        assert!(
            !names.iter().any(|name| name.ends_with(".checkpoint")),
            "{names:?}"
        );
        std::fs::remove_file(path("killed.safetensors")).expect("a bake");
    }
    println!("{kills} killed twice, of {whole:.1?}: {went_on} went on, {ended} had ended before");
    assert!(4 * went_on >= kills);
}
