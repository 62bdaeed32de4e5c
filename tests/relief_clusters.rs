//! Pictures of relief lit by clusters against the path tracer on the displaced mesh.

mod common;

use std::path::PathBuf;

use common::{Build, assert_silent, device, show};
use glam::DVec3;
use mesolux::bake::bake;
use mesolux::bake::solution::Solution;
use mesolux::bench::pictures::Reference;
use mesolux::bench::relief_room::{self, REPEAT, TEXELS, bumps};
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::path_tracer::PathTracer;
use mesolux::render::{Comparison, Light, Lighting, ReliefShading, View, render};
use mesolux::scene::{Camera, Scene, displace};
use mesolux::solver::Settings;

/// Pixels a side of the pictures.
const SIDE: u32 = 48;
/// Paths of each pixel. Their noise is known and taken off.
const PATHS: u32 = 96;

/// What was promised of the program's pictures of relief: relMSE less the reference's noise, and
/// bias.
const PROMISED_REL_MSE: f64 = 5e-3;
const PROMISED_BIAS: f64 = 0.01;

/// What one beam for each slot adds to relMSE where light comes from everywhere. A slot that the
/// relief's horizon cuts is seen whole or not at all, which is wrong by 1/√12 of it rms; of K slots
/// in a square the horizon cuts as many as lie along the square's border, and one brings at most 2
/// / K of the irradiance, the greatest cosine over the mean one.
fn beams(k: u32) -> f64 {
    let k = f64::from(k);
    4.0 * (k.sqrt() - 1.0) * (2.0 / k).powi(2) / 12.0
}

/// The same where all light comes from the lamp and is one beam at worst. A penumbra's light falls
/// from 1 to 0 and the beam's from 1 to 0 in its middle: ∫ (beam − b)² / b² = 1.5 − 2 ln 2 + 0.5 =
/// 0.61 of the penumbra's area. A bump 0.14 repeats high, under a lamp 0.4 radians high at 38°, has
/// one 0.14 · 0.4 / sin² 38° = 0.15 repeats wide, and two bumps are 0.6 repeats across.
const PENUMBRA: f64 = 0.61 * 0.15 * 0.6;

/// And to the bias: a beam's cosine for the mean over a slot, s² / 24 with s² = 2π / K the slot's
/// solid angle.
fn beam_bias(k: u32) -> f64 {
    2.0 * std::f64::consts::PI / f64::from(k) / 24.0
}

/// A room with bumps as its floor, lit from aside; one wall is red.
fn room() -> Scene {
    let mut build = Build::new();
    let white = build.material(0.4, 0.0);
    let red = build.material(0.0, 0.0);
    build.scene.materials[red as usize].kd = [0.6, 0.1, 0.1];
    let lamp = build.material(0.0, 10.0);
    let floor = build.material(0.0, 0.0);
    build.scene.materials[floor as usize].kd = [0.3, 0.5, 0.8];
    build.relief(floor, TEXELS, |x, y| 0.12 * REPEAT * bumps(x, y));
    let sides = build.room(DVec3::ZERO, DVec3::splat(2.0), 16, white);
    build.cover(sides[0].clone(), floor, (DVec3::Z, DVec3::X));
    build.paint(sides[2].clone(), red);
    // Low enough that bumps throw shadows: 27 to 50 degrees above the floor's middle.
    let corner = DVec3::new(1.98, 0.5, 0.7);
    build.quad(corner, DVec3::Z * 0.7, DVec3::Y * 0.7, (3, 3), lamp);
    build.0.scene
}

fn view(camera: &Camera) -> View<'_> {
    View {
        camera,
        width: SIDE,
        height: SIDE,
    }
}

fn baked(scene: &Scene, k: u32, cache: PathBuf) -> Solution {
    let settings = Settings {
        hemicube: 64,
        residual: 1e-3,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(k).expect("a number of the paper"),
            cache: Some(cache),
        },
        ..Settings::default()
    };
    bake(&device(), scene, &settings, |_| true).expect("the device solves the scene")
}

#[test]
fn pictures_are_those_of_the_displaced_scene_within_a_slot() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let scene = room();
    let fine = displace(&scene).unwrap();
    let tracer = PathTracer::new(&fine).expect("the scene is good");
    // Of the floor alone.
    let middle = DVec3::new(1.0, 0.0, 1.0);
    let cameras = [(20.0, 1.0, 30.0), (70.0, 0.9, 16.0)]
        .map(|(angle, distance, fov_y)| relief_room::camera(middle, angle, distance, fov_y));
    let solutions = [16, 64].map(|k| (k, baked(&scene, k, folder.path().to_owned())));
    let mut failures = Vec::new();
    for camera in &cameras {
        for part in [Light::Global, Light::Direct, Light::Indirect] {
            let truth = Reference::new(&tracer, &view(camera), part, PATHS).expect("a picture");
            let (truth, noise) = (&truth.picture, truth.noise());
            for (k, solution) in &solutions {
                let lighting = Lighting {
                    part,
                    shading: ReliefShading::Clusters,
                    cache: Some(folder.path()),
                    ..Lighting::from(solution)
                };
                let picture =
                    render(&device(), &scene, lighting, &view(camera)).expect("a picture");
                let found = Comparison::new(&picture, truth).expect("alike in size");
                let rel_mse = found.rel_mse - noise;
                let at = format!("K {k} {} {part:?}", camera.name);
                println!(
                    "{at}: relMSE {rel_mse:.2e} (and noise {noise:.2e}), bias {:+.2} %, rms {:.2} %",
                    100.0 * found.bias,
                    100.0 * found.rms
                );
                show(&at, &picture, truth);
                let added = if part == Light::Direct {
                    PENUMBRA
                } else {
                    beams(*k)
                };
                if rel_mse > PROMISED_REL_MSE + added
                    || found.bias.abs() > PROMISED_BIAS + beam_bias(*k)
                {
                    failures.push(at);
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
    assert_silent();
}
