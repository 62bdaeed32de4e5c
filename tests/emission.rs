//! Emission by textures: the light of a lamp with a texture against that of the same lamp in plain
//! pieces, and against paths that look the texture up.

mod common;

use std::f32::consts::PI;
use std::sync::Arc;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::mesh::elements::Elements;
use mesolux::path_tracer::PathTracer;
use mesolux::picture::Light;
use mesolux::scene::{LoadOptions, Refinement, Scene, Texture, load, write_scene};
use mesolux::solver::{Place, Settings, Solver};

const STRENGTH: f32 = 4.0;
const SIDE: u32 = 256;

/// A floor below a square lamp of the caller's, at y = 0.5.
fn room(lamp: impl FnOnce(&mut Build, DVec3)) -> Scene {
    let mut build = Build::new();
    let (x, z) = (DVec3::X, DVec3::Z);
    build.quad(-x - z, 2.0 * z, 2.0 * x, (1, 1), 0);
    build.quad(-x - z, 2.0 * x, 2.0 * DVec3::Y, (1, 1), 0);
    lamp(&mut build, 0.5 * DVec3::Y - 0.5 * (x + z));
    build.weld();
    std::mem::take(&mut build.scene)
}

fn texture(value: impl Fn(f32) -> f32) -> Arc<Texture> {
    let at = |k: u32| (k as f32 + 0.5) / SIDE as f32;
    Arc::new(Texture {
        path: "glow".into(),
        width: SIDE,
        height: 1,
        texels: (0..SIDE).map(|k| [value(at(k)); 3]).collect(),
    })
}

/// The lamp in two triangles with a texture along x.
fn textured(value: impl Fn(f32) -> f32) -> Scene {
    room(|build, corner| {
        let material = build.material(0.2, STRENGTH);
        let lamp = build.quad(corner, DVec3::X, DVec3::Z, (1, 1), material);
        build.uv(lamp.clone(), DVec3::X, DVec3::Z);
        for t in &mut build.scene.triangles[lamp] {
            t.uv = t.uv.map(|[u, v]| [u + 0.5, v + 0.5]);
        }
        build.scene.materials[material as usize].map_ke = Some(texture(value));
    })
}

/// The lamp in so many strips, each of the mean.
fn strips(count: u32, value: impl Fn(f32) -> f32) -> Scene {
    room(|build, corner| {
        let width = DVec3::X / f64::from(count);
        for k in 0..count {
            let own = 256 / count;
            let at = |i: u32| (k * own + i) as f32 / 256.0 + 0.5 / 256.0;
            let mean = (0..own).map(|i| value(at(i))).sum::<f32>() / own as f32;
            let material = build.material(0.2, STRENGTH * mean);
            build.quad(
                corner + width * f64::from(k),
                width,
                DVec3::Z,
                (1, 1),
                material,
            );
        }
        build.weld();
    })
}

/// On the floor, below the lamp and beside it.
fn places() -> Vec<Place> {
    let step = |k: usize, by: f64| 1.8 * (0.5 + by * k as f64).fract() - 0.9;
    (0..32)
        .map(|k| Place {
            position: DVec3::new(step(k, 0.754_877_666), 0.0, step(k, 0.569_840_291)),
            normal: DVec3::Y,
        })
        .collect()
}

fn light(scene: &Scene) -> Vec<f64> {
    let cut = scene.refined(&Refinement::default());
    let elements = Elements::new(&cut);
    println!("{} triangles", elements.len());
    let mut solver = Solver::new(&device(), elements, &cut.lights, &Settings::default())
        .expect("the scene fits the device");
    solver.run(|_| true).expect("it is solved");
    let found = solver.light_at(&places()).expect("the places are good");
    found
        .iter()
        .map(|l| f64::from((l.direct + l.indirect).x))
        .collect()
}

fn traced(scene: &Scene) -> Vec<f64> {
    let tracer = PathTracer::new(scene).expect("the scene can be traced");
    let at = |(k, place): (usize, Place)| {
        let paths = 1 << 15;
        let of = tracer.irradiance(place.position, place.normal, paths, k as u64, Light::Global);
        f64::from(of.0.x)
    };
    places().into_iter().enumerate().map(at).collect()
}

/// Rms of the difference, and that of the means, as shares of the mean.
fn apart(one: &[f64], other: &[f64]) -> [f64; 2] {
    let count = one.len() as f64;
    let mean = |of: &[f64]| of.iter().sum::<f64>() / count;
    let squares = one.iter().zip(other).map(|(a, b)| (a - b).powi(2));
    let rms = (squares.sum::<f64>() / count).sqrt();
    [rms / mean(other), (mean(one) / mean(other) - 1.0).abs()]
}

/// Rms and mean against plain pieces: what is promised of the one, twice what was measured of the
/// other. Measured: 4.4e-3 with 32 strips for the ramp, 1.6e-3 with halves; 2.5e-4.
const PIECES: [f64; 2] = [5e-3, 2.5e-4];

/// The same against paths, whose own error is some 5e-3 a place. Measured: 8.1e-3; 1.6e-3.
const PATHS: [f64; 2] = [1.6e-2, 3e-3];

fn check(count: u32, value: impl Fn(f32) -> f32 + Copy) {
    let scene = textured(value);
    let ours = light(&scene);
    let pieces = apart(&ours, &light(&strips(count, value)));
    let paths = apart(&ours, &traced(&scene));
    let even = apart(&ours, &light(&textured(|_| 0.5)));
    println!("pieces {pieces:.5?}, paths {paths:.5?}, its mean {even:.5?}");
    assert!((0..2).all(|k| pieces[k] <= PIECES[k] && paths[k] <= PATHS[k]));
    // What the mean of the texture would be off.
    assert!(even[0] > 0.1);
    assert_silent();
}

/// Emission in a place of its own beside colours elsewhere: the same light to the last bit.
#[test]
fn emission_in_a_place_of_its_own() {
    let plain = textured(|u| u);
    let mut own = plain.clone();
    let lamp = own.materials.iter().position(|m| m.map_ke.is_some());
    for t in &mut own.triangles {
        if Some(t.material as usize) == lamp {
            t.emission_uv = Some(t.uv);
            t.uv = t.uv.map(|[u, v]| [0.25 * v, 0.3 - u]);
        }
    }
    assert_eq!(light(&own), light(&plain));
    assert_eq!(traced(&own), traced(&plain));
    assert_ne!(own.hash(), plain.hash());
    let dir = tempfile::tempdir().unwrap();
    let error = write_scene(&own, dir.path()).unwrap_err().to_string();
    assert!(error.contains("emission"), "{error}");
    assert_silent();
}

#[test]
fn a_half_dark_lamp_lights_as_two_halves() {
    check(2, |u| f32::from(u8::from(u < 0.5)));
}

#[test]
fn a_dimmed_half_lights_as_two_halves() {
    check(2, |u| if u < 0.5 { 0.1 } else { 0.9 });
}

#[test]
fn a_gradient_lights_as_strips() {
    check(32, |u| u);
}

/// Emission follows the material's factor when it is set again.
#[test]
fn relit_elements_keep_their_textures() {
    let mut cut = textured(|u| u).refined(&Refinement::default());
    let mut elements = Elements::new(&cut);
    let before = elements.emitted.clone();
    let by_material = elements.emitted_by_material();
    assert_eq!(by_material[1], Vec3::splat(STRENGTH * PI));
    elements.set_emitted(&by_material);
    assert_eq!(elements.emitted, before);
    cut.materials[1].ke = [2.0 * STRENGTH; 3];
    elements.set_emission(&cut);
    let twice = before.iter().map(|&emitted| 2.0 * emitted);
    assert!(twice.eq(elements.emitted.iter().copied()));
    // The mean of a ramp that is 0 at one end.
    let power: f64 = (elements.emitted.iter().zip(&elements.area))
        .map(|(emitted, area)| f64::from(emitted.x) * area)
        .sum();
    let exact = f64::from(STRENGTH * PI) / elements.unit.powi(2);
    println!("{power} {exact}");
    assert!((power / exact - 1.0).abs() < 1e-3);
}

/// A texture of emission is hashed and written; without one the hash is as ever.
#[test]
fn textures_of_emission_are_written_and_read() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("glow.png");
    image::RgbImage::from_fn(4, 4, |x, y| image::Rgb([(60 * x) as u8, (60 * y) as u8, 9]))
        .save(&path)
        .unwrap();
    let mut scene = textured(|_| 0.5);
    let other = scene.hash();
    scene.materials[1].map_ke = Some(Arc::new(Texture::load(&path).unwrap()));
    assert_ne!(scene.hash(), other);
    let written = write_scene(&scene, &dir.path().join("out")).unwrap();
    let read = load(written.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(read.hash(), scene.hash());
    assert!(read.warnings.is_empty(), "{:?}", read.warnings);

    let toml = dir.path().join("scene.toml");
    let text = "[[mesh]]\nfile = \"out/scene.obj\"\n[material.m0]\nmap_ke = \"glow.png\"\n";
    std::fs::write(&toml, text).unwrap();
    let read = load(toml.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert!(read.materials[0].map_ke.is_some() && read.materials[0].ke == [1.0; 3]);
}
