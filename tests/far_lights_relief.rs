//! Suns and skies on relief, against its geometry.

mod common;

use std::f64::consts::PI;
use std::path::Path;
use std::sync::OnceLock;

use common::{Build, assert_silent, device};
use glam::{DVec2, DVec3};
use mesolux::bake::bake;
use mesolux::bench::pictures::Reference;
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::path_tracer::PathTracer;
use mesolux::picture::Picture;
use mesolux::render::{Comparison, Lighting, render};
use mesolux::render::{Light, View};
use mesolux::scene::sky::{Dome, Sky};
use mesolux::scene::{Camera, Scene, Sun, displace};
use mesolux::solver::Settings;

/// Where visibilities of the reliefs are kept while the tests run.
fn cache() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| tempfile::tempdir().expect("a folder for the test"))
        .path()
}

fn settings(directions: u32) -> Settings {
    Settings {
        residual: 1e-3,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(directions).expect("a number of the paper"),
            cache: Some(cache().to_owned()),
        },
        ..Settings::default()
    }
}

/// A corrugated plate of 8 by 8 repeats, facing up, whose height depends on x alone.
fn corrugated(rho: f32, texels: u32, height: impl Fn(f64) -> f64) -> Build {
    let mut build = Build::new();
    let plate = build.material(rho, 0.0);
    build.relief(plate, texels, |x, _| height(x));
    let all = build.quad(DVec3::ZERO, DVec3::Z * 8.0, DVec3::X * 8.0, (4, 4), plate);
    build.uv(all, DVec3::X, -DVec3::Z);
    build
}

/// What a cavity between level ground sends of an even sky of radiance 1, over π and for each
/// length of the profile from 0 to 1, by Hottel's crossed strings. `corners` are those of the
/// cavity, whose pieces all see each other.
fn sent_by_profile(rho: f64, corners: &[DVec2]) -> f64 {
    const PIECES: usize = 40;
    let mut ends = Vec::new();
    for pair in corners.windows(2) {
        for i in 0..PIECES {
            let at = |i: usize| pair[0].lerp(pair[1], i as f64 / PIECES as f64);
            ends.push((at(i), at(i + 1)));
        }
    }
    let count = ends.len();
    let length = |i: usize| ends[i].0.distance(ends[i].1);
    // From pieces in order along the profile.
    let between = |i: usize, j: usize| {
        let ((a, b), (c, d)) = (ends[i.min(j)], ends[i.max(j)]);
        (a.distance(c) + b.distance(d) - a.distance(d) - b.distance(c)).abs() / (2.0 * length(i))
    };
    let row = |i: usize| -> Vec<f64> {
        let factor = |j| if i == j { 0.0 } else { between(i, j) };
        (0..count).map(factor).collect()
    };
    let factors: Vec<Vec<f64>> = (0..count).map(row).collect();
    let sky: Vec<f64> = factors
        .iter()
        .map(|row| 1.0 - row.iter().sum::<f64>())
        .collect();
    let mut light = sky.clone();
    for _ in 0..200 {
        let next = |i: usize| -> f64 {
            let others = factors[i].iter().zip(&light);
            sky[i]
                + others
                    .map(|(factor, light)| factor * rho * light)
                    .sum::<f64>()
        };
        light = (0..count).map(next).collect();
    }
    let absorbed: f64 = (0..count).map(|i| (1.0 - rho) * light[i] * length(i)).sum();
    let opening = corners[0].distance(corners[corners.len() - 1]);
    opening - absorbed + rho * (1.0 - opening)
}

/// Grooves of 90° and trenches under an even sky: what leaves them.
#[test]
fn grooves_and_trenches_of_relief_send_what_their_geometry_sends() {
    // 0.12 %.
    const MOST: f64 = 3e-3;
    let mut worst: f64 = 0.0;
    let groove = |x: f64| (x - 0.5).abs() - 0.5;
    // Corners at texels' middles; walls of four texels: of one texel, 38 times as high as wide,
    // they are two facets, and what the trench sends is off by 2.9 %.
    let step = 1.0 / f64::from(TEXELS);
    let (first, last, wide) = (12.5 * step, 51.5 * step, 4.0 * step);
    let trench = |x: f64| {
        let inside = ((x - first) / wide).min((last - x) / wide);
        -0.6 * inside.clamp(0.0, 1.0)
    };
    let of_trench = [
        DVec2::new(first, 0.0),
        DVec2::new(first + wide, -0.6),
        DVec2::new(last - wide, -0.6),
        DVec2::new(last, 0.0),
    ];
    let tip = 0.5 * step;
    let of_groove = [
        DVec2::new(tip, -tip),
        DVec2::new(0.5 - tip, tip - 0.5),
        DVec2::new(0.5 + tip, tip - 0.5),
        DVec2::new(1.0 - tip, -tip),
    ];
    for (name, height, corners) in [
        ("groove", &groove as &dyn Fn(f64) -> f64, &of_groove[..]),
        ("trench", &trench, &of_trench[..]),
    ] {
        for (rho, k) in [(0.2_f32, 16), (0.8, 64)] {
            let mut build = corrugated(rho, TEXELS, height);
            build.scene.lights.sky = Some(Sky {
                up: DVec3::Y,
                north: DVec3::Z,
                scale: [1.0; 3],
                dome: Dome::Uniform,
            });
            let solved = build.solve(&settings(k));
            let all = 0..solved.area.len();
            let received = solved.mean(&solved.irradiance, all.clone()) / PI;
            let sent = solved.mean(&solved.radiosity, all) / PI;
            let expected = sent_by_profile(rho.into(), corners);
            println!(
                "{name}, reflectance {rho}, K = {k}: receives {received:.5}, sends {sent:.5}, right {expected:.5}: {:+.2} %",
                100.0 * (sent / expected - 1.0)
            );
            worst = worst.max((sent / expected - 1.0).abs());
        }
    }
    assert!(worst < MOST);
}

/// Bricks with round edges and grain, one repeat a unit.
fn bricks(x: f64, y: f64) -> f64 {
    let row = (4.0 * y).floor();
    let (u, v) = (
        (2.0 * x + 0.5 * (row % 2.0)).rem_euclid(1.0),
        (4.0 * y).rem_euclid(1.0),
    );
    let edge = |a: f64, wide: f64| {
        let t = (a.min(1.0 - a) / wide).min(1.0);
        t * t * (3.0 - 2.0 * t)
    };
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.03 * edge(u, 0.12) * edge(v, 0.24) + 0.003 * wave(3.0 * x) * wave(5.0 * y)
}

const TEXELS: u32 = 64;

/// The height map of [`bricks`] between its texels, as the renderer reads it.
fn between_texels(x: f64, y: f64) -> f64 {
    let n = f64::from(TEXELS);
    let (u, v) = (x * n - 0.5, y * n - 0.5);
    let (i, j) = (u.floor(), v.floor());
    let at = |i: f64, j: f64| {
        bricks(
            ((i + 0.5) / n).rem_euclid(1.0),
            ((j + 0.5) / n).rem_euclid(1.0),
        )
    };
    let row = |j: f64| at(i, j) + (u - i) * (at(i + 1.0, j) - at(i, j));
    row(j) + (v - j) * (row(j + 1.0) - row(j))
}

/// A wall of bricks under a sun, its relief in texels `finer` than those of the renderer's.
fn wall(elevation: f64, finer: u32) -> (Scene, Camera) {
    let mut build = Build::new();
    let brick = build.material(0.5, 0.0);
    build.relief(brick, finer * TEXELS, between_texels);
    let low = DVec3::new(-1.0, 0.0, -1.0);
    let all = build.quad(low, DVec3::Z * 4.0, DVec3::X * 4.0, (8, 8), brick);
    build.uv(all, DVec3::X, -DVec3::Z);
    let (sin, cos) = elevation.to_radians().sin_cos();
    build.scene.lights.suns.push(Sun {
        name: "sun".into(),
        towards: DVec3::new(cos * 0.8, sin, -cos * 0.6),
        irradiance: [3.0; 3],
        angle: 0.53,
    });
    let camera = Camera {
        name: "test".into(),
        position: DVec3::new(1.0, 1.6, 2.2),
        look_at: DVec3::new(1.0, 0.0, 1.0),
        up: DVec3::Y,
        fov_y: 35.0,
    };
    (build.0.scene, camera)
}

/// Pixels of a picture a side, and pixels that are drawn for each.
const SIDE: u32 = 96;
const FINER: u32 = 4;

/// A picture each of whose pixels is the mean of a block of [`FINER`] pixels a side.
fn averaged(picture: &Picture) -> Picture {
    let pixel = |i: u32| {
        let (x, y) = (i % SIDE * FINER, i / SIDE * FINER);
        let block = (0..FINER * FINER).map(|k| (y + k / FINER) * picture.width + x + k % FINER);
        let radiance = block.map(|at| DVec3::from(picture.radiance[at as usize].map(f64::from)));
        let mean = radiance.sum::<DVec3>() / f64::from(FINER * FINER);
        mean.as_vec3().to_array()
    };
    let pixels: Vec<_> = (0..SIDE * SIDE).map(pixel).collect();
    let metered = vec![true; pixels.len()];
    Picture::new((SIDE, SIDE), pixels, &metered)
}

#[test]
fn the_sun_on_relief_is_drawn_as_on_its_geometry() {
    // relMSE at 10°, 30° and 60°; measured 2.0e-3, 1.7e-4 and 9.1e-6, and a bias of 0.03 %. At 10°
    // most of the picture is dark and the rest is edges of shadows, of which 16 samples a pixel are
    // as unsure as 96 paths are: with both it is 1.2e-2.
    const MOST_REL_MSE: [f64; 3] = [4e-3, 3.5e-4, 2e-5];
    const MOST_BIAS: f64 = 6e-4;
    let mut good = true;
    for (elevation, most) in [10.0, 30.0, 60.0].into_iter().zip(MOST_REL_MSE) {
        let (scene, camera) = wall(elevation, 1);
        let solution = bake(&device(), &scene, &settings(64), |_| true).expect("it is solved");
        let fine = displace(&wall(elevation, 5).0).unwrap();
        let tracer = PathTracer::new(&fine).expect("the scene is good");
        // At 10° the few bounces in the dark are the reference's noise.
        let (parts, paths) = match elevation > 10.0 {
            true => (&[Light::Direct, Light::Global][..], 256),
            false => (&[Light::Direct][..], 1024),
        };
        for &part in parts {
            let lighting = Lighting {
                part,
                ..Lighting::from(&solution)
            };
            let view = |side| View {
                camera: &camera,
                width: side,
                height: side,
            };
            let drawn = render(&device(), &scene, lighting, &view(SIDE * FINER));
            let picture = averaged(&drawn.expect("a picture"));
            let reference =
                Reference::new(&tracer, &view(SIDE), part, paths, |_| true).expect("a picture");
            let noise = reference.noise();
            let reference = reference.picture;
            common::show(&format!("sun {elevation} {part:?}"), &picture, &reference);
            let found = Comparison::new(&picture, &reference).expect("alike in size");
            let rel_mse = found.rel_mse - noise;
            println!(
                "sun at {elevation}° {part:?}: relMSE {rel_mse:.2e} (and noise {noise:.2e}), bias {:+.2} %, rms {:.2} %",
                100.0 * found.bias,
                100.0 * found.rms
            );
            good &= rel_mse < most && found.bias.abs() < MOST_BIAS;
        }
        assert_silent();
    }
    assert!(good);
}
