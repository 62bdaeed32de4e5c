//! Against the displaced mesh: light by the path tracer, outlines and heights by the rasteriser.

use std::sync::Arc;
use std::time::Instant;

use glam::{DVec3, Vec3};
use mesolux::bench::pictures::Reference;
use mesolux::bench::relief_room::{CASES, REPEAT, TEXELS, bumps, camera, room, smooth_step};
use mesolux::path_tracer::PathTracer;
use mesolux::render::{Comparison, Light, Lighting, Picture, SAMPLES, Show};
use mesolux::scene::{Scene, Texture, displace};
use mesolux::solver::Settings;

use crate::common::{Build, assert_silent, show};
use crate::{baked, draw, quick, settings, view};

/// Paths of each pixel. Their noise is known and taken off; what is left of it is a fiftieth of it,
/// for the pixels are many.
const DIRECT_PATHS: u32 = 64;
const INDIRECT_PATHS: u32 = 480;

/// Of [`Comparison::rel_mse`] less the reference's noise, and of [`Comparison::bias`].
#[derive(Clone, Copy)]
struct Limits {
    rel_mse: f64,
    bias: f64,
}

/// What was promised of the program's pictures of relief.
const PROMISED: Limits = Limits {
    rel_mse: 5e-3,
    bias: 0.01,
};

/// What is held of the indirect light on relief. Measured: 0.0034 at most, of which the paths' own
/// error of the mean is 0.001.
const INDIRECT: Limits = Limits {
    bias: 0.007,
    ..PROMISED
};

/// The same on the flat floor. Measured: 0.0074; elements of an eighth of the room, which the slope
/// of the light beside the red wall is not even over.
const INDIRECT_ON_FLAT: Limits = Limits {
    bias: 0.015,
    ..PROMISED
};

#[test]
fn pictures_are_those_of_the_displaced_scene() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut failures = Vec::new();
    for case in &CASES {
        let scene = room(case);
        let start = Instant::now();
        let solution = baked(&scene, &settings(64, 1e-3, Some(folder.path().to_owned())));
        let bake_time = start.elapsed();
        let fine = displace(&scene).unwrap();
        let tracer = PathTracer::new(&fine).expect("the scene is good");
        println!(
            "{}: {} elements in {:.1} s; reference: {} triangles",
            case.name,
            scene.triangles.len(),
            bake_time.as_secs_f64(),
            fine.triangles.len()
        );
        for camera in &scene.cameras {
            let start = Instant::now();
            let trace = |light, paths| {
                Reference::new(&tracer, &view(camera), light, paths, |_| true).expect("a picture")
            };
            let direct = trace(Light::Direct, DIRECT_PATHS);
            let indirect = trace(Light::Indirect, INDIRECT_PATHS);
            let global = direct.plus(&indirect);
            let trace_time = start.elapsed();
            let start = Instant::now();
            let of_indirect = match case.name {
                "flat" => INDIRECT_ON_FLAT,
                _ => INDIRECT,
            };
            let parts = [
                (Light::Global, PROMISED, &global),
                (Light::Direct, PROMISED, &direct),
                (Light::Indirect, of_indirect, &indirect),
            ];
            for (part, limits, reference) in parts {
                let lighting = Lighting {
                    part,
                    cache: Some(folder.path()),
                    ..Lighting::from(&solution)
                };
                let picture = draw(&scene, lighting, camera);
                let found = Comparison::new(&picture, &reference.picture).expect("alike in size");
                let noise = reference.noise();
                let rel_mse = found.rel_mse - noise;
                let at = format!("{} {} {part:?}", case.name, camera.name);
                println!(
                    "  {at}: relMSE {rel_mse:.2e} (and noise {noise:.2e}), bias {:+.2} %, rms {:.2} %",
                    100.0 * found.bias,
                    100.0 * found.rms
                );
                show(&at, &picture, &reference.picture);
                if rel_mse > limits.rel_mse || found.bias.abs() > limits.bias {
                    failures.push(at);
                }
            }
            println!(
                "  {:.1} s of paths, {:.1} s of pictures",
                trace_time.as_secs_f64(),
                start.elapsed().as_secs_f64()
            );
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
    assert_silent();
}

/// Shares of samples and of heights' ranges by which silhouettes and heights differ from the
/// displaced mesh's: one sample of sixteen in every other pixel of the outline, and what triangles
/// of a texel leave of the bumps.
const MOST_UNCOVERED: f64 = 0.03;
const MOST_HEIGHT: f64 = 0.015;

/// A plate and a ball with bumps, both shining white, and a black card that stands in the plate.
fn shining() -> Scene {
    let mut build = Build::new();
    let card = build.material(0.0, 0.0);
    let plate = build.material(0.0, 1.0);
    let skin = build.material(0.0, 1.0);
    build.relief(plate, TEXELS, |x, y| REPEAT * 0.15 * bumps(x, y));
    build.relief(skin, 24, |x, y| {
        // Even at its edges, where the texture meets itself turned.
        let edge = |a: f64| smooth_step(8.0 * (0.5 - (a - 0.5).abs()) - 0.5);
        0.04 * edge(x) * edge(y) * bumps(x, y)
    });
    let sides = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (4, 4), plate);
    build.cover(sides, plate, (DVec3::Z, DVec3::X));
    build.cube_sphere(DVec3::new(0.55, 0.45, 0.5), 0.25, 4, skin);
    build.quad(
        DVec3::new(0.63, -0.1, 0.88),
        DVec3::new(0.24, 0.0, -0.18),
        DVec3::Y * 0.2,
        (1, 1),
        card,
    );
    build.0.scene
}

#[test]
fn silhouettes_and_heights_are_those_of_the_displaced_mesh() {
    let scene = shining();
    let solution = baked(
        &scene,
        &Settings {
            shots: Some(1),
            ..quick()
        },
    );
    let fine = displace(&scene).unwrap();
    let dark = vec![Vec3::ZERO; fine.triangles.len()];
    // Its heights as a texture, lit by an irradiance of π.
    let mut painted = fine.clone();
    for (painted, material) in painted.materials.iter_mut().zip(&scene.materials) {
        painted.ke = [0.0; 3];
        let Some(map) = &material.map_height else {
            // As plain triangles are shown.
            painted.kd = [0.5; 3];
            continue;
        };
        let bounds = map
            .values
            .iter()
            .fold((f32::MAX, f32::MIN), |(low, high), &v| {
                (low.min(v), high.max(v))
            });
        painted.kd = [1.0; 3];
        painted.map_kd = Some(Arc::new(Texture {
            path: "test".into(),
            width: map.width,
            height: map.height,
            texels: map
                .values
                .iter()
                .map(|v| [(v - bounds.0) / (bounds.1 - bounds.0); 3])
                .collect(),
        }));
    }
    let bright = vec![Vec3::splat(std::f32::consts::PI); fine.triangles.len()];
    for angle in [30.0, 60.0, 80.0] {
        let camera = camera(DVec3::new(0.5, 0.2, 0.5), angle, 1.5, 45.0);
        let mask = draw(&scene, &solution, &camera);
        let true_mask = draw(&fine, &dark, &camera);
        let apart = |a: &Picture, b: &Picture, most: f32| {
            let pairs = a.radiance.iter().zip(&b.radiance);
            let differ = pairs.filter(|(a, b)| (a[0] - b[0]).abs() > most);
            differ.count() as f64 / a.radiance.len() as f64
        };
        let covered = apart(&mask, &true_mask, 0.5 / (SAMPLES * SAMPLES) as f32);
        let mean = Comparison::new(&mask, &true_mask).expect("alike in size");
        let heights = Lighting {
            show: Show::Height,
            ..Lighting::from(&solution)
        };
        let heights = draw(&scene, heights, &camera);
        let true_heights = draw(&painted, &bright, &camera);
        let pairs = heights.radiance.iter().zip(&true_heights.radiance);
        let squares = pairs.map(|(a, b)| f64::from(a[0] - b[0]).powi(2));
        let difference = (squares.sum::<f64>() / heights.radiance.len() as f64).sqrt();
        println!(
            "{angle} degrees: {:.2} % of the pixels are covered otherwise, by {:.2} % rms, {:+.3} % in all; heights by {:.2} % of their range rms",
            100.0 * covered,
            100.0 * mean.rms,
            100.0 * mean.bias,
            100.0 * difference
        );
        assert!(mean.rms <= MOST_UNCOVERED && difference <= MOST_HEIGHT);
        show(&format!("mask {angle}"), &mask, &true_mask);
        show(&format!("heights {angle}"), &heights, &true_heights);
    }
    assert_silent();
}
