//! The same scene, larger, smaller, far away, or solved by other threads, has the same radiosity.

mod common;

use std::path::{Path, PathBuf};
use std::process::Command;

use common::Build;
use glam::DVec3;
use mesolux::solver::Settings;

fn scene(scale: f64, offset: f64) -> Build {
    let mut build = Build::new();
    let light = build.material(0.3, 1.5);
    build.room(DVec3::ZERO, DVec3::new(1.0, 0.9, 1.1), 6, 0);
    build.sphere(DVec3::new(0.6, 0.35, 0.5), 0.22, 2, true, 0);
    build.quad(
        DVec3::new(0.3, 0.85, 0.3),
        DVec3::X * 0.3,
        DVec3::Z * 0.3,
        (2, 2),
        light,
    );
    build.scene.point_lights.clear();
    build.point_light(
        DVec3::new(0.3, 0.5, 0.8) * scale + offset,
        (0.4 * scale * scale) as f32,
    );
    for v in &mut build.scene.vertices {
        *v = *v * scale + offset;
    }
    build
}

/// Rms and largest difference of the radiosity, over its mean.
fn difference(a: &Build, b: &Build) -> [f64; 2] {
    // Far below 1e-5: with the last bit of a power, the order of two like sources may change, and so what is left over.
    let settings = Settings {
        residual: 3e-6,
        hemicube: 64,
        ..Settings::default()
    };
    let (a, b) = (a.solve(&settings), b.solve(&settings));
    let mean = a.mean(&a.radiosity, 0..a.radiosity.len());
    let differences = || {
        a.radiosity
            .iter()
            .zip(&b.radiosity)
            .map(|(x, y)| f64::from((*x - *y).abs().max_element()) / mean)
    };
    let rms = (differences().map(|d| d * d).sum::<f64>() / a.radiosity.len() as f64).sqrt();
    [rms, differences().fold(0.0, f64::max)]
}

#[test]
fn scaled_by_powers_of_two_and_moved() {
    let here = scene(1.0, 0.0);
    for power in [-20.0f64, 20.0] {
        let [_, max] = difference(&here, &scene(power.exp2(), 0.0));
        println!("scaled by 2^{power}: largest difference {max:e}");
        assert_eq!(
            max, 0.0,
            "scaled by 2^{power}: every sum is the same to the bit"
        );
    }
    // Numbers of 2^-20 steps are held at 10^6 as they are at 0.
    let held = |offset: f64| {
        let mut build = scene(1.0, 0.0);
        for v in &mut build.scene.vertices {
            *v = (*v * 20f64.exp2()).round() / 20f64.exp2() + offset;
        }
        for light in &mut build.scene.point_lights {
            light.position += offset;
        }
        build
    };
    let [rms, max] = difference(&held(0.0), &held(1e6));
    println!("moved by 10^6, numbers held: rms {rms:e}, largest {max:e}");
    assert!(max <= 1e-5, "moved by 10^6: {max}");
}

/// Runs a bake with a number of threads of the program and of the software device.
fn bake(folder: &Path, scene: &str, name: &str, threads: &str) -> PathBuf {
    let out = folder.join(name);
    let run = Command::new(env!("CARGO_BIN_EXE_mesolux"))
        .args([
            "bake",
            scene,
            "--patches",
            "8000",
            "--shots",
            "150",
            "--no-cache",
            "--validate",
        ])
        .args(["--threads", threads, "-o"])
        .arg(&out)
        .env("LP_NUM_THREADS", threads)
        .output()
        .expect("the program runs");
    assert!(
        run.status.success(),
        "{}",
        String::from_utf8_lossy(&run.stderr)
    );
    out
}

#[test]
fn runs_and_threads_give_the_same_bytes() {
    // With relief: visibility, moments and light by direction too.
    for (scene, tensor_count) in [("cornell", 7), ("cornell-relief", 13)] {
        let folder = tempfile::tempdir().expect("a folder for the test");
        let files = [("a", "1"), ("b", "2"), ("c", "2")]
            .map(|(name, threads)| bake(folder.path(), scene, name, threads));
        let bytes = files.map(|f| std::fs::read(f).expect("the bake was written"));
        let first = tensors(&bytes[0]);
        assert_eq!(first.len(), tensor_count);
        for other in &bytes[1..] {
            for ((name, a), (_, b)) in first.iter().zip(tensors(other)) {
                assert!(
                    *a == b,
                    "{scene}: {name} differs between runs or numbers of threads"
                );
            }
        }
    }
}

/// The tensors of a bake by name.
fn tensors(bytes: &[u8]) -> Vec<(String, Vec<u8>)> {
    let file = safetensors::SafeTensors::deserialize(bytes).expect("a safetensors file");
    let mut all: Vec<_> = file
        .tensors()
        .into_iter()
        .map(|(n, t)| (n, t.data().to_vec()))
        .collect();
    all.sort();
    all
}
