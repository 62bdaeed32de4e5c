//! A few pictures as they were when someone last looked at them, kept in `tests/golden`. They show
//! that something changed, not what is right: `relief_render` and `bench pictures` compare with the
//! path tracer.
//!
//! `MESOLUX_WRITE_GOLDEN=1 cargo test --test golden` writes them again; look at them, and say in
//! the commit what changed them.

mod common;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use common::{assert_silent, device};
use image::{ImageBuffer, Rgb};
use mesolux::bake::bake;
use mesolux::bench::relief_room::{CASES, room};
use mesolux::render::{Direct, Light, Lighting, Picture, View, render};
use mesolux::scene::{Camera, LoadOptions, Scene, Texture, load};
use mesolux::solver::Settings;

const SIZE: (u32, u32) = (96, 72);
const WRITE: &str = "MESOLUX_WRITE_GOLDEN";

/// Of the full range, in which a picture is kept. The same driver gives the same codes. Another one
/// rounds otherwise, by 1e-5 after a bake: this is not seen but where a sample of a pixel's 16 is
/// decided by it, at edges of things and of shadows. There a pixel may change by the sixteenth of
/// what the two sides differ by.
const EDGE: f64 = 1.0 / 16.0;
/// Share of the pixels that may differ by more than that: a pixel where several edges meet, now and
/// then.
const MOST_BEYOND: f64 = 2e-3;
/// Mean difference: one sample in every twentieth pixel, by a third of the range, 1/(16 · 20 · 3).
const MOST_MEAN: f64 = 1e-3;

type Kept = ImageBuffer<Rgb<u16>, Vec<u16>>;

/// Radiance L as x/(1 + x) of x = L · 2^`exposure`, in 16 bits: every radiance has a code, none is
/// cut off. With an x about 1, a light that is 1 % off changes the mean by 0.25 %.
fn kept(picture: &Picture, exposure: f32) -> Kept {
    let code = |l: f32| {
        let x = l * exposure.exp2();
        (f32::from(u16::MAX) * x / (1.0 + x)).round() as u16
    };
    let codes = picture
        .radiance
        .iter()
        .flatten()
        .map(|&l| code(l))
        .collect();
    Kept::from_raw(picture.width, picture.height, codes).expect("a code for each number")
}

/// The picture `name` is as it was.
fn check(name: &str, picture: &Picture, exposure: f32) {
    let found = kept(picture, exposure);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/golden/{name}.png"));
    if std::env::var_os(WRITE).is_some() {
        found.save(&path).expect("a picture file");
        return;
    }
    assert!(
        path.exists(),
        "{} is missing; `{WRITE}=1 cargo test --test golden` writes it",
        path.display()
    );
    let expected = image::open(&path).expect("a picture").into_rgb16();
    assert_eq!(found.dimensions(), expected.dimensions(), "{name}");
    let (mut sum, mut beyond) = (0.0, 0);
    for (a, b) in found.pixels().zip(expected.pixels()) {
        let apart =
            [0, 1, 2].map(|c| (f64::from(a[c]) - f64::from(b[c])).abs() / f64::from(u16::MAX));
        sum += apart.iter().sum::<f64>() / 3.0;
        beyond += usize::from(apart.iter().any(|&d| d > EDGE));
    }
    let count = f64::from(SIZE.0 * SIZE.1);
    let (mean, beyond) = (sum / count, beyond as f64 / count);
    println!(
        "{name}: mean difference {mean:.2e}, beyond an edge's {:.2} %",
        100.0 * beyond
    );
    if mean > MOST_MEAN || beyond > MOST_BEYOND {
        let got = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}.png"));
        found.save(&got).expect("a picture file");
        panic!(
            "{name}: mean difference {mean:.2e}, beyond an edge's {:.2} %; it is now {}, and was {}. If that is right, \
             `{WRITE}=1 cargo test --test golden` keeps it",
            100.0 * beyond,
            got.display(),
            path.display()
        );
    }
}

/// Bakes and draws.
fn draw(scene: &Scene, camera: &Camera, part: Light, direct: Direct) -> Picture {
    let settings = Settings {
        hemicube: 64,
        residual: 3e-3,
        ..Settings::default()
    };
    let solution =
        bake(&device(), scene, &settings, |_| true).expect("the device solves the scene");
    let lighting = Lighting {
        part,
        direct,
        ..Lighting::from(&solution)
    };
    let view = View {
        camera,
        width: SIZE.0,
        height: SIZE.1,
    };
    let picture = render(&device(), scene, lighting, &view).expect("a picture");
    assert_silent();
    picture
}

fn built_in(name: &str, patches: usize) -> Scene {
    let options = LoadOptions {
        patches: Some(patches),
        ..LoadOptions::default()
    };
    load(name, &options).expect("a built-in scene")
}

#[test]
fn cornell_box() {
    let scene = built_in("cornell", 4000);
    let picture = draw(&scene, &scene.cameras[0], Light::Global, Direct::Sharp);
    check("cornell", &picture, 3.5);
}

/// Bricks with their texture, all light by the factors.
#[test]
fn relief_by_its_factors() {
    let scene = room(&CASES[1]);
    let picture = draw(&scene, &scene.cameras[1], Light::Global, Direct::Slots);
    check("relief-factored", &picture, 3.5);
}

/// Noise at a grazing angle, shadowed at each pixel.
#[test]
fn relief_in_sharp_direct_light() {
    let scene = room(&CASES[3]);
    let picture = draw(&scene, &scene.cameras[2], Light::Direct, Direct::Sharp);
    check("relief-sharp", &picture, 4.5);
}

/// The bunny with relief, checked.
#[test]
fn figure_with_a_texture() {
    let mut scene = built_in("bowl-and-bunny", 6000);
    let checks: Vec<[f32; 3]> = (0..16 * 16)
        .map(|i: u32| match (i / 16 / 4 + i % 16 / 4) % 2 {
            0 => [1.0, 0.9, 0.7],
            _ => [0.5, 0.2, 0.1],
        })
        .collect();
    for material in scene.materials.iter_mut().filter(|m| m.has_relief()) {
        material.map_kd = Some(Arc::new(Texture {
            path: "test".into(),
            width: 16,
            height: 16,
            texels: checks.clone(),
        }));
    }
    let picture = draw(&scene, &scene.cameras[0], Light::Global, Direct::Sharp);
    check("figure", &picture, 2.5);
}
