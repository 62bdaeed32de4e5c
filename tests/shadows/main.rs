//! Direct light on relief and on plain triangles in the shadow of other parts of the scene, against
//! the path tracer on the displaced mesh.

#[path = "../common/mod.rs"]
mod common;
mod skipped;
mod walk;

use std::path::Path;
use std::sync::OnceLock;

use common::{Build, assert_silent, device, show};
use glam::DVec3;
use mesolux::bake::bake;
use mesolux::bake::solution::Solution;
use mesolux::bench::pictures::Reference;
use mesolux::bench::relief_room::{REPEAT, TEXELS, bumps, smooth_step};
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::path_tracer::{PathTracer, Settings as Paths};
use mesolux::render::{Comparison, Direct, Light, Lighting, View, render};
use mesolux::scene::{Camera, Material, PointLight, Scene, displace};
use mesolux::solver::Settings;

/// Pixels a side of the pictures.
const SIDE: u32 = 64;
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

/// Where visibilities of the reliefs are kept while the tests run.
fn cache() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    FOLDER
        .get_or_init(|| tempfile::tempdir().expect("a folder for the test"))
        .path()
}

fn baked(scene: &Scene) -> Solution {
    let settings = Settings {
        hemicube: 64,
        // Direct light is all that is looked at: it is there before anything is reflected.
        residual: 0.9,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(16).expect("a number of the paper"),
            cache: Some(cache().to_owned()),
        },
        ..Settings::default()
    };
    bake(&device(), scene, &settings, |_| true).expect("the device solves the scene")
}

/// A room whose floor has triangles of half its width, with a relief or none, a small lamp and a
/// block on the floor.
fn room(relief: bool, lamp_side: f64) -> Scene {
    let mut build = Build::new();
    let white = build.material(0.3, 0.0);
    let lamp = build.material(0.0, (4.0 / (lamp_side * lamp_side)) as f32);
    let floor = build.material(0.6, 0.0);
    if relief {
        build.relief(floor, TEXELS, |x, y| 0.12 * REPEAT * bumps(x, y));
    }
    let sides = build.room(DVec3::ZERO, DVec3::splat(2.0), 4, white);
    build.cover(sides[0].clone(), floor, (DVec3::Z, DVec3::X));
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
    build.0.scene
}

struct Found {
    bias: f64,
    rms: f64,
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
        cache: Some(cache()),
        ..Lighting::from(solution)
    };
    let picture = render(&device(), scene, lighting, &view(camera)).expect("a picture");
    let fine = displace(scene).unwrap();
    let tracer = PathTracer::new(&fine).expect("the scene is good");
    let reference = Reference::new(&tracer, &view(camera), Light::Direct, PATHS, |_| true);
    let reference = reference.expect("a picture");
    let noise = reference.noise();
    let reference = reference.picture;
    let found = Comparison::new(&picture, &reference).expect("alike in size");
    show(&format!("{name} {direct:?}"), &picture, &reference);
    let rel_mse = found.rel_mse - noise;
    println!(
        "{name} {direct:?}: relMSE {rel_mse:.2e} (and noise {noise:.2e}), bias {:+.2} %, rms {:.2} %",
        100.0 * found.bias,
        100.0 * found.rms
    );
    Found {
        bias: found.bias,
        rms: found.rms,
    }
}

/// Root of the mean square over the mean. A pixel of a penumbra sees a share p of a lamp by 64
/// points, within √(p(1 − p)/64) ≤ 6 % of the whole if they were thrown at random; a tenth of the
/// pixels are such: 2 %. With the paths' own 1 % and a half as much again for what the 64 points
/// leave of the relief's shadows.
const MOST_RMS: f64 = 0.035;
/// What was promised of the program's pictures of relief.
const MOST_BIAS: f64 = 0.01;

#[test]
fn shadows_of_the_scene_are_sharp() {
    let camera = camera(DVec3::new(1.9, 1.2, 1.9), DVec3::new(1.25, 0.0, 1.0), 40.0);
    let mut failures = Vec::new();
    for relief in [false, true] {
        let scene = room(relief, 0.3);
        let solution = baked(&scene);
        let name = if relief {
            "relief floor"
        } else {
            "plain floor"
        };
        // As it was baked, a shadow is as soft as the mesh.
        let slots = compare(name, &scene, &solution, Direct::Slots, &camera);
        let sharp = compare(name, &scene, &solution, Direct::Sharp, &camera);
        if sharp.rms > MOST_RMS || sharp.bias.abs() > MOST_BIAS || slots.rms < 4.0 * MOST_RMS {
            failures.push(name);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
    assert_silent();
}

/// A ball with bumps in the middle of a dark room, lit from its side by a small lamp.
fn ball(cells: u32) -> Scene {
    let mut build = Build::new();
    let dark = build.material(0.0, 0.0);
    let lamp = build.material(0.0, 100.0);
    let skin = build.material(0.7, 0.0);
    // Even at its edges, where the texture meets itself turned.
    let edge = |a: f64| smooth_step(8.0 * (0.5 - (a - 0.5).abs()) - 0.5);
    build.relief(skin, 2 * TEXELS, |x, y| {
        0.06 * edge(x) * edge(y) * bumps(2.0 * x, 2.0 * y) * REPEAT
    });
    build.room(DVec3::ZERO, DVec3::splat(2.0), 2, dark);
    build.quad(
        DVec3::new(1.9, 0.9, 0.9),
        DVec3::Z * 0.2,
        DVec3::Y * 0.2,
        (2, 2),
        lamp,
    );
    build.cube_sphere(DVec3::ONE, 0.25, cells, skin);
    build.0.scene
}

/// A fifteenth of the pixels are lit. Among them penumbrae are everywhere: 6 % of the lit pixels'
/// mean, as above, is √15 times as much of the picture's, 0.23; the triangles' parabolas may add
/// half as much again.
const MOST_BALL_RMS: f64 = 0.35;

/// The dark half of the ball is seen, and the rim that its bumps rise from into the light.
#[test]
fn bumps_beyond_the_horizon_rise_into_the_light() {
    let camera = camera(DVec3::new(0.7, 1.2, 1.9), DVec3::ONE, 36.0);
    let mut failures = Vec::new();
    for cells in [6, 16] {
        let scene = ball(cells);
        let solution = baked(&scene);
        let name = format!("ball {cells}");
        let found = compare(&name, &scene, &solution, Direct::Sharp, &camera);
        if found.rms > MOST_BALL_RMS || found.bias.abs() > MOST_BIAS {
            failures.push(cells);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
    assert_silent();
}

/// Bumps that would go on past the border of their plate shadow nothing: ways to a lamp that stands
/// low beside it leave the relief there, also by way of other triangles.
#[test]
fn relief_ends_with_its_surface() {
    for cells in [2, 9] {
        let mut build = Build::new();
        let lamp = build.material(0.0, 30.0);
        let plate = build.material(0.6, 0.0);
        build.relief(plate, TEXELS, |x, y| 0.2 * REPEAT * bumps(x, y));
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| REPEAT * axis);
        // Less than a repeat, so that all of it is near the border.
        let all = build.quad(DVec3::ZERO, 0.9 * z, 0.9 * x, (cells, cells), plate);
        build.cover(all, plate, (DVec3::Z, DVec3::X));
        let corner = 2.0 * x + 0.5 * y + 0.3 * z;
        build.quad(corner, 0.2 * z, 0.2 * y, (1, 1), lamp);
        build.weld();
        let scene = build.0.scene;
        let middle = 0.45 * (x + z);
        let camera = camera(middle + 0.1 * x + 1.6 * y + 0.3 * z, middle, 45.0);
        let (name, solution) = (format!("plate {cells}"), baked(&scene));
        let found = compare(&name, &scene, &solution, Direct::Sharp, &camera);
        assert!(found.bias.abs() < MOST_BORDER_BIAS && found.rms < MOST_BORDER_RMS);
    }
    assert_silent();
}

/// Measured: +0.01 %; where the relief went on, −3.84 %.
const MOST_BORDER_BIAS: f64 = 0.001;
/// Measured: 3.1 %, of which paths are most; where the relief went on, 28.7 %.
const MOST_BORDER_RMS: f64 = 0.06;

/// A lit pixel by its middle and by the mean of the paths through it, which jitter: what E changes
/// by over half a pixel.
const EVEN: f64 = 0.02;

/// In the light of a point nothing is half in shadow but at edges: neither acne nor light under
/// what touches the floor.
#[test]
fn contacts_leak_no_light_and_surfaces_do_not_shadow_themselves() {
    let mut scene = room(false, 0.3);
    let lamp = scene
        .materials
        .iter()
        .position(Material::emits)
        .expect("a lamp");
    scene.materials[lamp].ke = [0.0; 3];
    scene.lights.points.push(PointLight {
        name: "test".into(),
        position: DVec3::new(0.4, 1.5, 0.5),
        intensity: [1.0; 3],
        beam: None,
    });
    // A card a millimetre above the floor, a hundredth of a pixel.
    let mut build = Build::new();
    build.scene = scene;
    build.quad(
        DVec3::new(1.3, 1e-3, 1.3),
        DVec3::Z * 0.3,
        DVec3::X * 0.3,
        (1, 1),
        0,
    );
    let scene = build.0.scene;
    let camera = camera(DVec3::new(1.9, 0.9, 1.9), DVec3::new(1.2, 0.0, 1.0), 45.0);
    let solution = baked(&scene);
    let lighting = Lighting {
        part: Light::Direct,
        ..Lighting::from(&solution)
    };
    let picture = render(&device(), &scene, lighting, &view(&camera)).expect("a picture");
    let tracer = PathTracer::new(&scene).expect("the scene is good");
    let paths = Paths {
        paths: 16,
        light: Light::Direct,
        ..Paths::default()
    };
    let film = tracer
        .render(&view(&camera), &paths, |_, _| true)
        .expect("a picture");
    let truth = film.picture();
    show("point light", &picture, &truth);
    let side = SIDE as usize;
    let (mut dark, mut lit) = (0, 0);
    for row in 1..side - 1 {
        for column in 1..side - 1 {
            let about =
                (0..9).map(|i| truth.radiance[(row + i / 3 - 1) * side + column + i % 3 - 1][0]);
            let (low, high) = about.fold((f32::MAX, 0.0_f32), |(l, h), v| (l.min(v), h.max(v)));
            let found = picture.radiance[row * side + column][0];
            if high == 0.0 {
                dark += 1;
                assert_eq!(found, 0.0, "light leaks at ({column}, {row})");
            } else if low > 0.85 * high {
                lit += 1;
                let truth = truth.radiance[row * side + column][0];
                let off = f64::from(found / truth - 1.0).abs();
                assert!(off < EVEN, "({column}, {row}) is off by {off}");
            }
        }
    }
    println!("{dark} dark and {lit} lit pixels");
    assert!(dark > 100 && lit > 1000);
    assert_silent();
}
