//! Direct light on relief and on plain triangles in the shadow of other parts of the scene, against the path tracer on the
//! displaced mesh.

mod common;

use std::f64::consts::PI;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::bake::bake;
use mesolux::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::path_tracer::{PathTracer, Settings as Paths};
use mesolux::render::{Comparison, Direct, Light, Lighting, Picture, View, render, side_by_side};
use mesolux::scene::{Camera, PointLight, Scene, displace};
use mesolux::solution::Solution;
use mesolux::solver::Settings;

/// Pixels a side of the pictures.
const SIDE: u32 = 64;
/// Scene units of a repeat of the reliefs, and its texels.
const REPEAT: f64 = 0.25;
const TEXELS: u32 = 32;
const PATHS: u32 = 96;

fn view(camera: &Camera) -> View<'_> {
    View {
        camera,
        width: SIDE,
        height: SIDE,
    }
}

fn camera(position: DVec3, look_at: DVec3, fov_y: f64) -> Camera {
    Camera {
        name: "test".into(),
        position,
        look_at,
        up: DVec3::Y,
        fov_y,
    }
}

fn baked(scene: &Scene) -> Solution {
    let settings = Settings {
        hemicube: 64,
        residual: 1e-2,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(32).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    };
    bake(&device(), scene, &settings, |_| true).expect("the device solves the scene")
}

/// Two bumps a repeat, in repeats.
fn bumps(x: f64, y: f64) -> f64 {
    let apart = |a: f64, c: f64| a - c - (a - c).round();
    let bump = |cx: f64, cy: f64, r: f64| {
        let q = apart(x, cx).hypot(apart(y, cy)) / r;
        (1.0 - q * q).max(0.0).powi(2)
    };
    0.12 * (1.2 * bump(0.3, 0.3, 0.3) + bump(0.8, 0.7, 0.22))
}

/// A room whose floor has triangles of half its width, with a relief or none, a small lamp and a block on the floor.
fn room(relief: bool, lamp_side: f64) -> Scene {
    let mut build = Build::new();
    let white = build.material(0.3, 0.0);
    let lamp = build.material(0.0, (4.0 / (lamp_side * lamp_side)) as f32);
    let floor = build.material(0.6, 0.0);
    if relief {
        build.relief(floor, TEXELS, |x, y| REPEAT * bumps(x, y));
    }
    let sides = build.room(DVec3::ZERO, DVec3::splat(2.0), 4, white);
    // Corners of repeats in the middle of texels: `displace` cuts along the cells of the bilinear map.
    build.uv(sides[0].clone(), DVec3::Z * REPEAT, DVec3::X * REPEAT);
    for t in &mut build.scene.triangles[sides[0].clone()] {
        t.material = floor;
        for uv in &mut t.uv {
            *uv = uv.map(|x| x + 0.5 / TEXELS as f32);
        }
    }
    build.quad(
        DVec3::new(0.3, 1.98, 0.6),
        DVec3::X * lamp_side,
        DVec3::Z * lamp_side,
        (2, 2),
        lamp,
    );
    // Turned, so that no edge lies along the floor's triangles.
    let (x, z) = (DVec3::new(0.28, 0.0, 0.1), DVec3::new(-0.1, 0.0, 0.28));
    let (low, y) = (DVec3::new(0.9, 0.0, 0.7), DVec3::Y * 0.4);
    for (corner, u, v) in [
        (low + y, z, x),
        (low, y, z),
        (low, x, y),
        (low + x, z, y),
        (low + z, y, x),
    ] {
        build.quad(corner, u, v, (2, 2), white);
    }
    build.weld();
    build.scene
}

struct Found {
    rel_mse: f64,
    bias: f64,
}

/// Of the picture of the scene's direct light, less the paths' noise.
fn compare(
    name: &str,
    scene: &Scene,
    solution: &Solution,
    direct: Direct,
    camera: &Camera,
) -> Found {
    let lighting = Lighting {
        part: Light::Direct,
        direct,
        ..Lighting::from(solution)
    };
    let picture = render(&device(), scene, lighting, &view(camera)).expect("a picture");
    let fine = displace(scene);
    let tracer = PathTracer::new(&fine).expect("the scene is good");
    let paths = Paths {
        paths: PATHS,
        light: Light::Direct,
        ..Paths::default()
    };
    let film = tracer
        .render(&view(camera), &paths, |_| true)
        .expect("a picture");
    let reference = film.picture();
    let found = Comparison::new(&picture, &reference).expect("alike in size");
    let values = reference.radiance.as_flattened();
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
    let errors = film.standard_error();
    let variance = errors.iter().flat_map(|e| (*e * *e).to_array());
    let noise = variance
        .zip(values)
        .map(|(variance, &b)| variance / (f64::from(b).powi(2) + (0.01 * mean).powi(2)))
        .sum::<f64>()
        / values.len() as f64;
    show(&format!("{name} {direct:?}"), &picture, &reference);
    let rel_mse = found.rel_mse - noise;
    println!(
        "{name} {direct:?}: relMSE {rel_mse:.2e} (and noise {noise:.2e}), bias {:+.2} %, rms {:.2} %",
        100.0 * found.bias,
        100.0 * found.rms
    );
    Found {
        rel_mse,
        bias: found.bias,
    }
}

/// Where pictures are written to be looked at, if anywhere.
fn show(name: &str, ours: &Picture, reference: &Picture) {
    if let Some(folder) = std::env::var_os("MESOLUX_TEST_PICTURES") {
        let path = std::path::Path::new(&folder).join(format!("{name}.png"));
        side_by_side(ours, reference)
            .and_then(|picture| picture.write(&path, None))
            .expect("a picture file");
    }
}

#[test]
fn shadows_of_the_scene_are_sharp() {
    let camera = camera(DVec3::new(1.9, 1.2, 1.9), DVec3::new(1.25, 0.0, 1.0), 40.0);
    for relief in [false, true] {
        let scene = room(relief, 0.3);
        let solution = baked(&scene);
        let name = if relief {
            "relief floor"
        } else {
            "plain floor"
        };
        for direct in [Direct::Slots, Direct::Sharp] {
            compare(name, &scene, &solution, direct, &camera);
        }
    }
    assert_silent();
}
