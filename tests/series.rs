//! Series of pictures and the cache of bakes: what is kept between pictures and between runs
//! changes none of them.

mod common;

use std::collections::BTreeMap;
use std::os::unix::fs::MetadataExt;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

use common::{assert_silent, device};
use glam::DVec3;
use mesolux::bake::bake;
use mesolux::bake::solution::Bake;
use mesolux::bench::relief_room::{CASES, room};
use mesolux::render::{Lighting, Renderer, SAMPLES, View, render};
use mesolux::scene::{Camera, LoadOptions, camera_path, load, write_scene};
use mesolux::solver::Settings;
use safetensors::SafeTensors;

/// Places of cameras are a few products of numbers about 1, each rounded to 2⁻⁵³.
const ROUNDING: f64 = 1e-14;

fn camera(position: DVec3, fov_y: f64) -> Camera {
    Camera {
        name: "test".into(),
        position,
        look_at: DVec3::new(0.5, 0.25, 0.0),
        up: DVec3::Y,
        fov_y,
    }
}

#[test]
fn a_turntable_keeps_its_distance_and_its_height() {
    let own = camera(DVec3::new(2.0, 1.0, 3.0), 40.0);
    let whole = camera_path::turntable(&own, 360.0, 4).expect("a path");
    assert_eq!(whole[0].position, own.position);
    // A quarter turn about y takes (x, z) to (z, −x).
    let arm = own.position - own.look_at;
    let expected = [
        own.position,
        own.look_at + DVec3::new(arm.z, arm.y, -arm.x),
        own.look_at + DVec3::new(-arm.x, arm.y, -arm.z),
        own.look_at + DVec3::new(-arm.z, arm.y, arm.x),
    ];
    for (found, expected) in whole.iter().zip(expected) {
        assert!(found.position.distance(expected) < ROUNDING * 10.0);
        assert_eq!((found.look_at, found.fov_y), (own.look_at, own.fov_y));
    }
    // Of less than a whole turn the camera itself is in the middle.
    let swing = camera_path::turntable(&own, 60.0, 5).expect("a path");
    assert_eq!(swing[2].position, own.position);
    let angle = |i: usize| {
        (swing[i].position - own.look_at)
            .with_y(0.0)
            .angle_between(arm.with_y(0.0))
    };
    assert!((angle(0).to_degrees() - 30.0).abs() < 1e-9);
    assert!((angle(4).to_degrees() - 30.0).abs() < 1e-9);
    assert!(camera_path::turntable(&own, 360.0, 0).is_err());
    assert!(camera_path::turntable(&own, f64::NAN, 3).is_err());
}

#[test]
fn a_path_passes_all_cameras_without_a_kink() {
    let places = [
        [0.0, 0.0, 3.0],
        [1.0, 2.0, 3.0],
        [4.0, 1.0, 2.0],
        [5.0, 0.0, 6.0],
    ];
    let cameras: Vec<Camera> = places
        .iter()
        .zip([30.0, 40.0, 60.0, 50.0])
        .map(|(&p, fov)| camera(DVec3::from(p), fov))
        .collect();
    let path = camera_path::through(&cameras, 301).expect("a path");
    for (i, expected) in cameras.iter().enumerate() {
        let found = &path[100 * i];
        assert!(found.position.distance(expected.position) < ROUNDING * 10.0);
        assert!((found.fov_y - expected.fov_y).abs() < 1e-12);
    }
    // Speeds on both sides of a camera differ by what a step of acceleration adds, at most 0.01² of
    // twice the places' spread.
    for at in [100, 200] {
        let speed = |i: usize| path[i + 1].position - path[i].position;
        assert!(speed(at).distance(speed(at - 1)) < 2e-3);
    }
    // On a line with even steps, so is the path.
    let line: Vec<Camera> = (0..4)
        .map(|i| camera(DVec3::new(f64::from(i), 2.0, 1.0), 40.0))
        .collect();
    for (i, found) in camera_path::through(&line, 7)
        .expect("a path")
        .iter()
        .enumerate()
    {
        assert!((found.position.x - 0.5 * i as f64).abs() < ROUNDING * 10.0);
    }
    let error = camera_path::through(&line[..1], 7).expect_err("one camera is no path");
    assert!(error.to_string().contains("two"));
    assert_eq!(
        camera_path::through(&line, 1).expect("a path")[0].position,
        line[0].position
    );
}

/// A renderer that has looked elsewhere before draws the same bits as a new one.
#[test]
fn looking_again_is_drawing_anew() {
    let scene = room(&CASES[1]);
    let settings = Settings {
        hemicube: 32,
        shots: Some(64),
        ..Settings::default()
    };
    let device = device();
    let solution = bake(&device, &scene, &settings, |_| true).expect("the device solves the scene");
    let views: Vec<View> = scene
        .cameras
        .iter()
        .map(|camera| View {
            camera,
            width: 24,
            height: 24,
        })
        .collect();
    let lighting = Lighting::from(&solution);
    let mut renderer = Renderer::new(&device, &scene, lighting, &views[0], SAMPLES).expect("ready");
    for view in [&views[2], &views[0], &views[1]] {
        renderer.look(view).expect("another view");
        let found = renderer.picture().expect("a picture");
        let anew = render(&device, &scene, lighting, view).expect("a picture");
        assert!(found.radiance.as_flattened().iter().any(|&v| v > 0.0));
        assert!(found.radiance == anew.radiance, "{}", view.camera.name);
    }
    let nowhere = Camera {
        look_at: views[1].camera.position,
        ..views[1].camera.clone()
    };
    let wrong = View {
        camera: &nowhere,
        ..views[1]
    };
    let mut renderer = Renderer::new(&device, &scene, lighting, &views[1], SAMPLES).expect("ready");
    assert!(renderer.look(&wrong).is_err());
    assert_silent();
}

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    usemtl floor\nf 1 4 3 2\nusemtl light\nf 5 6 7 8\n";
const MATERIALS: &str = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl light\nKd 0 0 0\nKe 1 1 1\n";

/// Where the program runs, with the cache in `cache`.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder for the test");
    std::fs::write(folder.path().join("room.obj"), ROOM).expect("written");
    std::fs::write(folder.path().join("room.mtl"), MATERIALS).expect("written");
    folder
}

fn mesolux(args: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .output()
        .expect("the program runs")
}

fn text(run: &Output) -> String {
    String::from_utf8_lossy(&run.stderr).into_owned()
}

/// All pictures have the exposure of the first.
#[test]
fn series_are_numbered_and_do_not_flicker() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    // Half of the floor is dark, and the pictures see other halves.
    let floor = ROOM.replace("f 1 4 3 2\n", "f 1 4 3\nusemtl dark\nf 1 3 2\n");
    let materials = format!("{MATERIALS}newmtl dark\nKd 0.05 0.05 0.05\n");
    std::fs::write(at("room.obj"), floor).expect("written");
    std::fs::write(at("room.mtl"), materials).expect("written");
    let run = |args: &[&str]| mesolux(args, folder.path());
    let done = run(&["bake", "room.obj", "--no-refine", "-o", "room.safetensors"]);
    assert!(done.status.success(), "{}", text(&done));
    let look = [
        "--look-from",
        "0.5,0.4,0.1",
        "--look-at",
        "0.5,0.1,0.6",
        "--size",
        "24x18",
        "--fov",
        "8",
    ];
    let series = [
        "render",
        "room.safetensors",
        "-o",
        "turn.png",
        "--frames",
        "3",
    ];
    let done = run(&[&series[..], &look].concat());
    assert!(done.status.success(), "{}", text(&done));
    assert!(!at("turn.png").exists() && !at("turn-0004.png").exists());

    let scene = load(&at("room.obj").to_string_lossy(), &LoadOptions::default()).expect("read");
    let bake = Bake::load(&at("room.safetensors")).expect("read");
    let own = Camera {
        position: DVec3::new(0.5, 0.4, 0.1),
        look_at: DVec3::new(0.5, 0.1, 0.6),
        fov_y: 8.0,
        ..scene.cameras[0].clone()
    };
    let cameras = camera_path::turntable(&own, 360.0, 3).expect("a path");
    let device = device();
    let pictures: Vec<_> = cameras
        .iter()
        .map(|camera| {
            let view = View {
                camera,
                width: 24,
                height: 18,
            };
            render(&device, &scene, &bake, &view).expect("a picture")
        })
        .collect();
    let first = pictures[0].automatic_exposure;
    assert!(
        pictures
            .iter()
            .any(|p| (p.automatic_exposure - first).abs() > 0.05)
    );
    for (i, picture) in pictures.iter().enumerate() {
        picture
            .write(&at("expected.png"), Some(first))
            .expect("written");
        let read = |name: &str| std::fs::read(at(name)).expect("read");
        let found = read(&format!("turn-000{}.png", i + 1));
        assert!(found == read("expected.png"), "picture {}", i + 1);
    }
    // By the path tracer too; an .obj names one camera, which makes no path; parts of the series
    // belong to it.
    let traced = [
        "render",
        "room.obj",
        "--reference",
        "--paths",
        "2",
        "-o",
        "t.exr",
        "--frames",
        "2",
    ];
    let done = run(&[&traced[..], &look].concat());
    assert!(done.status.success(), "{}", text(&done));
    assert!(at("t-0001.exr").exists() && at("t-0002.exr").exists());
    for (wrong, said) in [
        (&["--frames", "2", "--path", "cameras"][..], "two"),
        (&["--frames", "0"], "--frames 0"),
        (&["--frames", "2", "--turn", "400"], "--turn 400"),
        (&["--path", "cameras"], "--frames"),
    ] {
        let done = run(&[&["render", "room.obj", "-o", "wrong.png"], wrong].concat());
        assert_eq!(done.status.code(), Some(2), "{wrong:?}");
        assert!(text(&done).contains(said), "{wrong:?}: {}", text(&done));
    }
    assert!(!at("wrong-0001.png").exists());
}

#[test]
fn bakes_of_scenes_are_kept() {
    let folder = folder();
    let cache = folder.path().join("cache").join("mesolux");
    let draw = |more: &[&str]| {
        let args = ["render", "room.obj", "-o", "p.exr", "--size", "16x12"];
        let run = mesolux(&[&args[..], more].concat(), folder.path());
        assert!(run.status.success(), "{}", text(&run));
        (
            text(&run),
            std::fs::read(folder.path().join("p.exr")).expect("read"),
        )
    };
    let bakes = || -> Vec<_> {
        let entries = std::fs::read_dir(&cache).into_iter().flatten().flatten();
        let paths = entries.map(|entry| entry.path());
        paths
            .filter(|p| p.extension().is_some_and(|e| e == "safetensors"))
            .collect()
    };
    // Bakes that the clock has stopped, and what is not to be kept, are not.
    let (said, _) = draw(&["--budget", "0"]);
    assert!(said.contains("not kept") && bakes().is_empty(), "{said}");
    let (said, plain) = draw(&["--no-cache"]);
    assert!(!said.contains("cache") && bakes().is_empty(), "{said}");

    let (said, first) = draw(&[]);
    let kept = bakes();
    assert_eq!(kept.len(), 1);
    assert!(
        said.contains(&format!("bake kept as {}", kept[0].display())),
        "{said}"
    );
    let (said, second) = draw(&[]);
    assert!(said.contains("bake found in the cache"), "{said}");
    assert!(first == plain && second == plain);
    // The file is a bake as any other.
    let args = [
        "render",
        &kept[0].to_string_lossy(),
        "-o",
        "p.exr",
        "--size",
        "16x12",
    ];
    assert!(mesolux(&args, folder.path()).status.success());

    // One bit of one number.
    let mut bytes = std::fs::read(&kept[0]).expect("read");
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    std::fs::write(&kept[0], &bytes).expect("written");
    let (said, third) = draw(&[]);
    assert!(
        said.contains("damaged") && said.contains("baking again"),
        "{said}"
    );
    assert!(third == plain);
    assert!(draw(&[]).0.contains("bake found in the cache"));

    // Other settings and another scene are another bake.
    for more in [["--seed", "1"], ["--hemicube", "64"], ["--shots", "1"]] {
        assert!(draw(&more).0.contains("bake kept as"), "{more:?}");
    }
    std::fs::write(
        folder.path().join("room.mtl"),
        MATERIALS.replace("0.5 0.5", "0.6 0.5"),
    )
    .expect("written");
    let (said, other) = draw(&[]);
    assert!(said.contains("bake kept as") && other != plain, "{said}");
    assert_eq!(bakes().len(), 5);
}

/// Two bakes that begin at once with one empty cache give the bytes of one alone, and leave a
/// cache that the next bake uses.
#[test]
fn bakes_side_by_side_share_a_cache() {
    let folder = folder();
    let scene = write_scene(&room(&CASES[1]), folder.path()).expect("it is written");
    let bake = |output: &str, cache: &str| {
        Command::new(env!("CARGO_BIN_EXE_mesolux"))
            .args([
                "bake",
                "--no-refine",
                "--directions",
                "16",
                "--quality",
                "preview",
            ])
            .args(["-o", output])
            .arg(&scene)
            .current_dir(folder.path())
            .env("XDG_CACHE_HOME", folder.path().join(cache))
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program starts")
    };
    let ends = |child: Child| {
        let run = child.wait_with_output().expect("it ran");
        assert!(run.status.success(), "{}", text(&run));
    };
    let tensors = |name: &str| {
        let bytes = std::fs::read(folder.path().join(name)).expect("a bake");
        let (header, _) = SafeTensors::read_metadata(&bytes).expect("a header");
        bytes[8 + header..].to_vec()
    };
    ends(bake("alone.safetensors", "own"));
    let names = ["a.safetensors", "b.safetensors"];
    let together = names.map(|name| bake(name, "shared"));
    together.into_iter().for_each(ends);
    let cached = |cache: &str| {
        let entries = std::fs::read_dir(folder.path().join(cache).join("mesolux"));
        let entries = entries.expect("a cache").map(|entry| {
            let entry = entry.expect("an entry");
            // A file that is written again is another one; reading marks it as used.
            (entry.file_name(), entry.metadata().expect("a file").ino())
        });
        entries.collect::<BTreeMap<_, _>>()
    };
    let entries = cached("shared");
    assert!(!entries.is_empty() && entries.keys().eq(cached("own").keys()));
    ends(bake("c.safetensors", "shared"));
    assert_eq!(cached("shared"), entries, "it is read, not written again");
    let alone = tensors("alone.safetensors");
    for name in names.into_iter().chain(["c.safetensors"]) {
        assert!(tensors(name) == alone, "{name}");
    }
}

/// The job array of `docs/clusters.md` bakes the line of its number, and refuses one that is not
/// there.
#[test]
fn jobs_of_an_array_bake_their_line() {
    let folder = folder();
    std::fs::write(folder.path().join("scenes.txt"), "other.obj\n./room.obj\n").expect("written");
    let job = |number: &str| {
        Command::new(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/bake-array.sh"))
            .args(["--no-refine", "--shots", "1"])
            .current_dir(folder.path())
            .env("SLURM_ARRAY_TASK_ID", number)
            .env("MESOLUX", env!("CARGO_BIN_EXE_mesolux"))
            .env("BAKES", ".")
            .output()
            .expect("the script runs")
    };
    let run = job("2");
    assert!(run.status.success(), "{}", text(&run));
    assert!(Bake::load(&folder.path().join("room.safetensors")).is_ok());
    let beyond = job("3");
    assert_eq!(beyond.status.code(), Some(2), "{}", text(&beyond));
    assert!(text(&beyond).contains("no line 3"), "{}", text(&beyond));
}
