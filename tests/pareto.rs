//! `bench pareto`, what it measures besides our bakes, and the presets that it led to.

mod common;

use std::f64::consts::PI;
use std::path::Path;
use std::process::{Command, Output};

use common::Build;
use glam::DVec3;
use mesolux::math::form_factor::to_polygon;
use mesolux::path_tracer::{PathTracer, VirtualLights};

/// A lamp over a dark floor, and a point light beside it.
///
/// Each of 4,096 lights counts as a disc of the 64 of area over 4,096: 0.016 / π d² is 1.3e-3 of
/// the light at a distance of 2; beside the point light 77 % of the paths begin on the lamp, and it
/// is 1.6e-3. What so many points of Halton's sequence leave of the lamp's integral is less, since
/// all of them are of nearly the same weight.
const LAMP_TOLERANCE: f64 = 2.5e-3;

#[test]
fn virtual_lights_of_a_lamp_and_a_point() {
    let mut build = Build::new();
    let (black, lamp) = (build.material(0.0, 0.0), build.material(0.0, 10.0));
    let (x, z) = (DVec3::X, DVec3::Z);
    build.quad(DVec3::new(-4.0, 0.0, -4.0), z * 8.0, x * 8.0, (2, 2), black);
    let contour = [
        DVec3::new(-0.1, 2.0, -0.1),
        DVec3::new(0.1, 2.0, -0.1),
        DVec3::new(0.1, 2.0, 0.1),
        DVec3::new(-0.1, 2.0, 0.1),
    ];
    build.quad(contour[0], x * 0.2, z * 0.2, (1, 1), lamp);
    for (name, points) in [("lamp", false), ("lamp and point", true)] {
        if points {
            build.point_light(DVec3::new(2.0, 1.0, 0.0), 0.03);
        }
        let tracer = PathTracer::new(&build.scene).expect("a sound scene");
        let lights = VirtualLights::new(&tracer, 4096, 1);
        for at in [DVec3::ZERO, DVec3::new(1.5, 0.0, 0.7)] {
            let mut exact = PI * 10.0 * to_polygon(at, DVec3::Y, &contour);
            if points {
                let to = DVec3::new(2.0, 1.0, 0.0) - at;
                exact += 0.03 * to.normalize().y / to.length_squared();
            }
            let found = f64::from(lights.irradiance(at, DVec3::Y).x);
            println!("{name} at {at}: {found} of {exact}");
            assert!((found / exact - 1.0).abs() < LAMP_TOLERANCE);
        }
        assert_eq!(lights.irradiance(DVec3::ZERO, -DVec3::Y).x, 0.0, "a back");
    }
}

/// 8,192 paths leave 16,384 lights. At the middle of a side of a unit cube their weights cosθ cosθ'
/// / d² spread by about their mean: 0.8 % were they independent, of which three standard errors are
/// allowed.
const FURNACE_TOLERANCE: f64 = 0.024;

/// A room whose sides reflect and emit one half: E = π everywhere.
#[test]
fn virtual_lights_in_a_furnace() {
    let mut build = Build::new();
    let side = build.material(0.5, 0.5);
    build.room(DVec3::ZERO, DVec3::ONE, 2, side);
    let tracer = PathTracer::new(&build.scene).expect("a sound scene");
    let lights = VirtualLights::new(&tracer, 8192, 1);
    println!("{} lights", lights.count());
    for normal in [DVec3::X, DVec3::Y, DVec3::Z] {
        for normal in [normal, -normal] {
            let at = DVec3::splat(0.5) - 0.5 * normal;
            let found = f64::from(lights.irradiance(at, normal).x);
            println!("{normal}: {found}");
            assert!((found / PI - 1.0).abs() < FURNACE_TOLERANCE);
        }
    }
}

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    usemtl floor\nf 1 4 3 2\nusemtl light\nf 5 6 7 8\n";
const MATERIALS: &str = "newmtl floor\nKd 0.5 0.5 0.5\nnewmtl light\nKd 0 0 0\nKe 1 1 1\n";

fn mesolux(args: &[&str], folder: &Path) -> Output {
    std::fs::write(folder.join("room.obj"), ROOM).expect("written");
    std::fs::write(folder.join("room.mtl"), MATERIALS).expect("written");
    Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args(args)
        .current_dir(folder)
        .output()
        .expect("the program runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// `bench pareto` of a scene at a cost that a test can bear, without Mitsuba.
fn measure(scene: &str, folder: &Path) -> Output {
    let args = [
        "bench",
        "pareto",
        scene,
        "-o",
        "out",
        "--samples",
        "20",
        "--paths",
        "64",
        "--hemicube",
        "16",
        "--pixel-hemicube",
        "16",
        "--source-scale",
        "1",
        "--peer-limit",
        "0",
        "--python",
        "no-such-python",
    ];
    mesolux(&args, folder)
}

/// The methods that have rows in what [`measure`] has written.
fn methods(folder: &Path) -> Vec<String> {
    let json = std::fs::read(folder.join("out/pareto.json")).expect("there");
    let found: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
    let rows = found["rows"].as_array().expect("rows");
    assert!(rows.iter().any(|r| r["best"] == true));
    assert!(found["breakdown"]["worst"][0]["triangle"].is_u64());
    let method = |row: &serde_json::Value| row["method"].as_str().expect("a name").to_owned();
    rows.iter().map(method).collect()
}

/// The reference is traced once; every method has its rows; what is not installed is one line.
#[test]
fn measures_a_scene() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut truths = Vec::new();
    for _ in 0..2 {
        let run = measure("room.obj", folder.path());
        let (said, logged) = (text(&run.stdout), text(&run.stderr));
        assert!(run.status.success(), "{logged}");
        assert_eq!(said.matches("Mitsuba 3 is left out").count(), 1, "{said}");
        truths.push(logged.contains("reference:"));
        for name in ["pareto.csv", "pareto.json", "pareto.svg", "pareto.png"] {
            assert!(folder.path().join("out").join(name).exists(), "{name}");
        }
    }
    assert_eq!(truths, [true, false], "the second run traces nothing");
    let there = methods(folder.path());
    for method in ["receiver", "pixel", "instant-radiosity", "path-tracer"] {
        assert!(there.iter().any(|name| name == method), "{method}");
    }
}

/// Peers that know surfaces and points alone have no rows beside a sun, a sky or a beam, and say
/// why.
#[test]
fn peers_say_which_lights_they_do_not_know() {
    for (kind, light) in [
        (
            "suns",
            "[[sun]]\ntowards = [0.0, 1.0, 0.2]\nirradiance = 1.0\n",
        ),
        ("skies", "[sky]\nmodel = \"uniform\"\nradiance = 1.0\n"),
        (
            "beams",
            "[[point_light]]\nposition = [0.5, 0.8, 0.5]\nintensity = 1.0\naxis = [0.0, -1.0, 0.0]\n\
             spot = { inner = 10.0, outer = 40.0 }\n",
        ),
    ] {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let text_of = format!("[[mesh]]\nfile = \"room.obj\"\n{light}");
        std::fs::write(folder.path().join("scene.toml"), text_of).expect("written");
        let run = measure("scene.toml", folder.path());
        let (said, logged) = (text(&run.stdout), text(&run.stderr));
        assert!(run.status.success(), "{kind}: {logged}");
        for peer in ["the pixel estimator", "instant radiosity", "Mitsuba 3"] {
            let line = format!("{peer} is left out: it knows no {kind}");
            assert_eq!(said.matches(&line).count(), 1, "{kind}: {said}");
        }
        let there = methods(folder.path());
        let known = ["receiver", "path-tracer"];
        assert!(there.iter().all(|m| known.contains(&m.as_str())), "{kind}");
        assert!(known.iter().all(|m| there.iter().any(|t| t == m)), "{kind}");
    }
}

#[test]
fn a_preset_gives_way_to_what_is_given() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let bake = |more: &[&str]| {
        let mut args = vec!["bake", "room.obj", "-o", "o.safetensors", "--json"];
        args.extend(more);
        mesolux(&args, folder.path())
    };
    let report = |more: &[&str]| -> serde_json::Value {
        let run = bake(more);
        assert!(run.status.success(), "{}", text(&run.stderr));
        serde_json::from_slice(&run.stdout).expect("JSON")
    };
    let draft = mesolux::bake::quality::Quality::Draft.settings();
    assert_eq!(report(&[])["hemicube"], 128);
    assert_eq!(report(&["--quality", "draft"])["hemicube"], draft.hemicube);
    let both = ["--quality", "draft", "--hemicube", "32"];
    assert_eq!(report(&both)["hemicube"], 32);
    // The lamp alone shoots more often when it is cut finer.
    let few = report(&["--source-power", "1", "--source-area", "1"]);
    let many = report(&["--source-power", "0.01", "--source-area", "1"]);
    assert!(many["sources"].as_u64() > few["sources"].as_u64());
    // What the file says of its settings has no gaps.
    let file = std::fs::read(folder.path().join("o.safetensors")).expect("there");
    assert!(text(&file).contains(r#"\"source_elements\":48"#));
    // A better one cuts built-in scenes too, unless it is told not to.
    let elements = |more: &[&str]| {
        let mut args = vec!["bake", "cornell", "-o", "c.safetensors", "--json"];
        args.extend(["--patches", "3000", "--shots", "1"]);
        args.extend(more);
        let run = mesolux(&args, folder.path());
        assert!(run.status.success(), "{}", text(&run.stderr));
        let report: serde_json::Value = serde_json::from_slice(&run.stdout).expect("JSON");
        report["elements"].as_u64().expect("a number")
    };
    assert_eq!(elements(&["--quality", "normal"]), 3000);
    assert_eq!(elements(&["--quality", "high", "--no-refine"]), 3000);
    let high = elements(&["--quality", "high"]);
    assert!(high > 20_000);
    assert_eq!(elements(&["--fineness", "2"]), high);
    for (option, value) in [
        ("--fineness", "0.5"),
        ("--source-elements", "0"),
        ("--source-area", "2"),
        ("--source-power", "nan"),
        ("--quality", "best"),
    ] {
        let run = bake(&[option, value]);
        assert_eq!(run.status.code(), Some(2), "{option} {value}");
        assert!(text(&run.stderr).contains(option));
    }
}
