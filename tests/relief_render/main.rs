//! Pictures of relief: against the path tracer on the displaced mesh, against the rasterised
//! displaced mesh, against themselves.

#[path = "../common/mod.rs"]
mod common;
mod comparison;
mod displaced;

use std::path::PathBuf;

use common::{Build, assert_silent, device};
use glam::DVec3;
use mesolux::bake::bake;
use mesolux::bake::solution::{Bake, Origin, Solution};
use mesolux::bench::relief_room::{REPEAT, TEXELS, bumps, camera, noise};
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::render::{
    Comparison, Light, Lighting, Picture, ReliefShading, Renderer, SAMPLES, Show, View, render,
};
use mesolux::scene::sky::{Dome, Sky};
use mesolux::scene::{Camera, Scene};
use mesolux::solver::Settings;

/// Pixels a side of the pictures.
const SIDE: u32 = 48;

fn settings(directions: u32, residual: f64, cache: Option<PathBuf>) -> Settings {
    Settings {
        hemicube: 64,
        residual,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(directions).expect("a number of the paper"),
            cache,
        },
        ..Settings::default()
    }
}

fn baked(scene: &Scene, settings: &Settings) -> Solution {
    bake(&device(), scene, settings, |_| true).expect("the device solves the scene")
}

fn draw<'a>(scene: &'a Scene, lighting: impl Into<Lighting<'a>>, camera: &'a Camera) -> Picture {
    render(&device(), scene, lighting, &view(camera)).expect("a picture")
}

fn view(camera: &Camera) -> View<'_> {
    View {
        camera,
        width: SIDE,
        height: SIDE,
    }
}

/// A small room, its floor with a relief, a wall a lamp. Quickly baked.
fn small(height: Option<fn(f64, f64) -> f64>) -> Scene {
    let mut build = Build::new();
    let white = build.material(0.6, 0.0);
    let lamp = build.material(0.2, 3.0);
    let floor = build.material(0.7, 0.0);
    if let Some(height) = height {
        build.relief(floor, TEXELS / 2, |x, y| REPEAT * height(x, y));
    }
    let sides = build.room(DVec3::ZERO, DVec3::splat(1.0), 3, white);
    build.cover(sides[0].clone(), floor, (DVec3::Z, DVec3::X));
    build.paint(sides[4].clone(), lamp);
    build.0.scene
}

fn quick() -> Settings {
    settings(16, 1e-2, None)
}

/// Of the floor of `small`.
fn small_camera() -> Camera {
    camera(DVec3::new(0.5, 0.0, 0.5), 40.0, 0.6, 25.0)
}

#[test]
fn constant_heights_are_none() {
    let [plain, constant] = [None, Some((|_, _| 0.3) as fn(f64, f64) -> f64)].map(small);
    let lit = [&plain, &constant].map(|scene| baked(scene, &quick()));
    assert!(constant.materials.iter().any(|m| m.map_height.is_some()));
    let camera = small_camera();
    for part in [Light::Global, Light::Direct, Light::Indirect] {
        let [a, b] = [(&plain, &lit[0]), (&constant, &lit[1])].map(|(scene, solution)| {
            let lighting = Lighting {
                part,
                ..Lighting::from(solution)
            };
            draw(scene, lighting, &camera)
        });
        assert!(a.radiance.iter().flatten().any(|&v| v > 0.0));
        assert_eq!(a.radiance, b.radiance);
    }
    assert_silent();
}

/// Root of the mean square of a − b over the mean of b.
fn rms(a: &Picture, b: &Picture) -> f64 {
    Comparison::new(a, b).expect("alike in size").rms
}

/// Of pictures without displacement from one with it, rms over the mean.
const MOST_APART: f64 = 0.3;

#[test]
fn shadings_differ_and_pictures_are_repeated() {
    let scene = small(Some(|x, y| 0.15 * noise(x, y)));
    let solution = baked(&scene, &quick());
    let camera = small_camera();
    let draw = |shading, show| {
        let lighting = Lighting {
            shading,
            show,
            ..Lighting::from(&solution)
        };
        draw(&scene, lighting, &camera)
    };
    let shadings = [
        ReliefShading::Factored,
        ReliefShading::Normal,
        ReliefShading::Parallax,
        ReliefShading::None,
    ];
    let pictures = shadings.map(|shading| draw(shading, Show::Shaded));
    for (shading, picture) in shadings.iter().zip(&pictures) {
        let again = draw(*shading, Show::Shaded);
        assert!(picture.radiance == again.radiance, "{shading:?}");
        assert!(picture.radiance.iter().flatten().all(|v| v.is_finite()));
        let apart = rms(picture, &pictures[0]);
        println!("{shading:?} is {:.2} % from Factored", 100.0 * apart);
        // Each is another rendering of the same light: neither alike nor strange.
        assert!(*shading == ReliefShading::Factored || (0.005..MOST_APART).contains(&apart));
    }
    assert!(rms(&pictures[1], &pictures[2]) > 0.005);
    // Every view of the relief shows another thing, and reflectance is that of the floor.
    let shows = [Show::Albedo, Show::Normal, Show::Height, Show::Irradiance];
    let views = shows.map(|show| draw(ReliefShading::Factored, show));
    for (i, view) in views.iter().enumerate() {
        assert!(views[..i].iter().all(|other| rms(view, other) > 0.005));
    }
    assert!(
        views[0]
            .radiance
            .iter()
            .flatten()
            .all(|v| (v - 0.7).abs() < 1e-3)
    );
    assert_silent();
}

/// Samples, of 147 456, that may be seen through between prisms.
const MOST_CRACKS: f32 = 0.0;

/// A picture of 64 samples a pixel is one of 16 with pixels half as wide, four to a pixel; with
/// relief, a lamp's edge, and a sky behind them.
#[test]
fn more_samples_are_those_of_a_larger_picture() {
    let mut build = Build::new();
    let floor = build.material(0.7, 0.0);
    let lamp = build.material(0.2, 30.0);
    build.relief(floor, TEXELS / 2, |x, y| REPEAT * 0.15 * noise(x, y));
    let cells = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (3, 3), floor);
    build.cover(cells, floor, (DVec3::Z, DVec3::X));
    build.quad(
        DVec3::new(0.3, 0.2, 0.2),
        0.3 * DVec3::Z,
        0.3 * DVec3::Y,
        (1, 1),
        lamp,
    );
    let mut scene = build.0.scene;
    scene.lights.sky = Some(Sky {
        up: DVec3::Y,
        north: DVec3::Z,
        scale: [0.2, 0.3, 0.5],
        dome: Dome::TraditionalOvercast,
    });
    let solution = baked(&scene, &quick());
    let camera = Camera {
        name: "beside".into(),
        position: DVec3::new(1.6, 0.5, 0.45),
        look_at: DVec3::new(0.4, 0.15, 0.5),
        up: DVec3::Y,
        fov_y: 45.0,
    };
    let device = device();
    let draw = |side, samples| {
        let view = View {
            camera: &camera,
            width: side,
            height: side,
        };
        let lighting = Lighting::from(&solution);
        let renderer = Renderer::new(&device, &scene, lighting, &view, samples);
        renderer.expect("a view").picture().expect("a picture")
    };
    let [fine, large] = [draw(SIDE, 2 * SAMPLES), draw(2 * SIDE, SAMPLES)];
    let at = |x: u32, y: u32| large.radiance[(y * 2 * SIDE + x) as usize];
    let (mut most, mut contrasts) = (0.0_f32, 0);
    for (place, pixel) in (0..).zip(&fine.radiance) {
        let (x, y) = (2 * (place % SIDE), 2 * (place / SIDE));
        let four = [at(x, y), at(x + 1, y), at(x, y + 1), at(x + 1, y + 1)];
        for c in 0..3 {
            let mean = four.iter().map(|p| p[c]).sum::<f32>() / 4.0;
            most = most.max((pixel[c] - mean).abs() / (mean + 0.01));
            let [low, high] =
                [f32::min, f32::max].map(|of| four.map(|p| p[c]).into_iter().fold(mean, of));
            contrasts += u32::from(low < 0.5 * high);
        }
    }
    println!("{most:e} apart at most, {contrasts} channels of pixels with edges");
    assert!(most < 1e-5, "{most}");
    assert!(contrasts > 300, "{contrasts}");
    let top = &fine.radiance[..SIDE as usize];
    assert!(top.iter().all(|p| p[2] > 0.0), "the sky is above");
    assert_silent();
}

/// From the front nothing is seen through a relief, from behind nothing of it. Lamps are beyond.
/// Straight above and below, rays pass along diagonals and sides of the prisms.
#[test]
fn prisms_have_no_cracks() {
    let mut failures = Vec::new();
    for cells in [4, 20] {
        let mut build = Build::new();
        let lamp = build.material(0.0, 1.0);
        let plate = build.material(0.0, 0.0);
        build.relief(plate, TEXELS / 2, |x, y| REPEAT * 0.15 * noise(x, y));
        let sides = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (cells, cells), plate);
        build.cover(sides, plate, (DVec3::Z, DVec3::X));
        for (y, u, v) in [(-9.0, DVec3::Z, DVec3::X), (9.0, DVec3::X, DVec3::Z)] {
            let corner = DVec3::new(-20.0, y, -20.0);
            build.quad(corner, 40.0 * u, 40.0 * v, (1, 1), lamp);
        }
        let scene = build.0.scene;
        let solution = baked(
            &scene,
            &Settings {
                shots: Some(1),
                ..quick()
            },
        );
        let middle = DVec3::new(0.5, 0.0, 0.5);
        let straight = |side: f64| Camera {
            up: DVec3::Z,
            position: middle + side * DVec3::Y,
            ..camera(middle, 0.0, 1.0, 25.0)
        };
        let mut cameras = vec![straight(0.6), straight(-0.6)];
        cameras.extend([25.0, 55.0, 125.0, 155.0].map(|angle| camera(middle, angle, 0.6, 25.0)));
        let mut samples = Vec::new();
        for camera in &cameras {
            let view = View {
                width: 2 * SIDE,
                height: 2 * SIDE,
                ..view(camera)
            };
            let picture = render(&device(), &scene, &solution, &view).expect("a picture");
            // The lamps alone have a radiance, of 1.
            let lit: f32 = picture.radiance.iter().map(|p| p[0]).sum();
            samples.push(lit * (SAMPLES * SAMPLES) as f32);
        }
        println!("{cells} cells: samples through cracks {samples:?}");
        failures.extend(
            samples
                .iter()
                .filter(|s| **s > MOST_CRACKS)
                .map(|s| (cells, *s)),
        );
    }
    assert!(failures.is_empty(), "{failures:?}");
    assert_silent();
}

#[test]
fn saved_bakes_give_the_same_pictures() {
    let scene = small(Some(|x, y| 0.12 * bumps(x, y)));
    let solution = baked(&scene, &quick());
    let folder = tempfile::tempdir().expect("a folder for the test");
    let path = folder.path().join("bake.safetensors");
    let origin = Origin {
        scene: "test".into(),
        hash: scene.hash(),
        ..Origin::default()
    };
    solution.save(&path, &origin, &"none").expect("a file");
    let bake = Bake::load(&path).expect("what was saved");
    let camera = small_camera();
    for part in [Light::Global, Light::Direct, Light::Indirect] {
        let [a, b] = [Lighting::from(&solution), Lighting::from(&bake)]
            .map(|lighting| draw(&scene, Lighting { part, ..lighting }, &camera));
        assert!(a.radiance == b.radiance, "{part:?}");
    }
    assert_silent();
}
