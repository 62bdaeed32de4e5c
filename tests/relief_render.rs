//! Pictures of relief: against the path tracer on the displaced mesh, against the rasterised displaced mesh, against
//! themselves.

mod common;

use std::f64::consts::PI;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use common::{Build, assert_silent, device, show};
use glam::{DVec3, Vec3};
use mesolux::bake::bake;
use mesolux::bench::pictures::{self, Reference};
use mesolux::bench::relief_room::{CASES, REPEAT, TEXELS, bumps, camera, noise, room, smooth_step};
use mesolux::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::path_tracer::PathTracer;
use mesolux::render::{
    Comparison, Light, Lighting, Picture, ReliefShading, SAMPLES, Show, View, render, side_by_side,
};
use mesolux::scene::{Camera, Scene, Texture, displace};
use mesolux::solution::{Bake, Origin, Solution};
use mesolux::solver::Settings;

/// Pixels a side of the pictures.
const SIDE: u32 = 48;

/// Paths of each pixel. Their noise is known and taken off; what is left of it is a fiftieth of it, for the pixels are many.
const DIRECT_PATHS: u32 = 64;
const INDIRECT_PATHS: u32 = 96;

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

/// What is held of it in the parts of the light. Of the indirect light the elements alone take 1.2 % where the red wall is
/// near, as on the flat floor.
const LIMITS: [(Light, Limits); 3] = [
    (Light::Global, PROMISED),
    (Light::Direct, PROMISED),
    (
        Light::Indirect,
        Limits {
            bias: 0.015,
            ..PROMISED
        },
    ),
];

/// Bias of a relief's picture beyond that of the flat floor's: thrice the paths' error of the mean, 0.3 % of indirect light.
const RELIEF_BIAS: f64 = 0.01;

/// Shares of samples and of heights' ranges by which silhouettes and heights differ from the displaced mesh's: one sample of
/// sixteen in every other pixel of the outline, and what triangles of a texel leave of the bumps.
const MOST_UNCOVERED: f64 = 0.03;
const MOST_HEIGHT: f64 = 0.015;

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

/// Samples, of 147 456, that may be seen through between prisms.
const MOST_CRACKS: f32 = 0.0;

/// Gives triangles a material and texture coordinates, one repeat each [`REPEAT`] along two directions.
///
/// Corners of the texture's repeats lie in the middle of texels, so that `displace` cuts along the cells of the bilinear map.
fn cover(
    build: &mut Build,
    triangles: std::ops::Range<usize>,
    material: u32,
    (u, v): (DVec3, DVec3),
) {
    build.uv(triangles.clone(), u * REPEAT, v * REPEAT);
    for t in &mut build.scene.triangles[triangles] {
        t.material = material;
        for uv in &mut t.uv {
            *uv = uv.map(|x| x + 0.5 / TEXELS as f32);
        }
    }
}

#[test]
fn pictures_are_those_of_the_displaced_scene() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let mut flat_bias = [[0.0; 3]; 3];
    let mut failures = Vec::new();
    for case in &CASES {
        let scene = room(case);
        let start = Instant::now();
        let solution = baked(&scene, &settings(64, 1e-3, Some(folder.path().to_owned())));
        let bake_time = start.elapsed();
        let fine = displace(&scene);
        let tracer = PathTracer::new(&fine).expect("the scene is good");
        println!(
            "{}: {} elements in {:.1} s; reference: {} triangles",
            case.name,
            scene.triangles.len(),
            bake_time.as_secs_f64(),
            fine.triangles.len()
        );
        for (camera, flat_bias) in scene.cameras.iter().zip(&mut flat_bias) {
            let start = Instant::now();
            let trace = |light, paths| {
                Reference::new(&tracer, &view(camera), light, paths).expect("a picture")
            };
            let direct = trace(Light::Direct, DIRECT_PATHS);
            let indirect = trace(Light::Indirect, INDIRECT_PATHS);
            let global = direct.plus(&indirect);
            let trace_time = start.elapsed();
            let start = Instant::now();
            let references = [&global, &direct, &indirect];
            let limits = LIMITS.iter().zip(references).zip(flat_bias);
            for (((part, limits), reference), flat_bias) in limits {
                let lighting = Lighting {
                    part: *part,
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
                if case.name == "flat" {
                    *flat_bias = found.bias;
                }
                let beyond_flat = (found.bias - *flat_bias).abs();
                if rel_mse > limits.rel_mse
                    || found.bias.abs() > limits.bias
                    || beyond_flat > RELIEF_BIAS
                {
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
    cover(&mut build, sides[0].clone(), floor, (DVec3::Z, DVec3::X));
    for t in &mut build.scene.triangles[sides[4].clone()] {
        t.material = lamp;
    }
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

/// From the front nothing is seen through a relief, from behind nothing of it. Lamps are beyond. Straight above and below,
/// rays pass along diagonals and sides of the prisms.
#[test]
fn prisms_have_no_cracks() {
    let mut failures = Vec::new();
    for cells in [4, 20] {
        let mut build = Build::new();
        let lamp = build.material(0.0, 1.0);
        let plate = build.material(0.0, 0.0);
        build.relief(plate, TEXELS / 2, |x, y| REPEAT * 0.15 * noise(x, y));
        let sides = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (cells, cells), plate);
        cover(&mut build, sides, plate, (DVec3::Z, DVec3::X));
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
        patches: None,
        statue: None,
        hash: scene.hash(),
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
    cover(&mut build, sides, plate, (DVec3::Z, DVec3::X));
    // A ball made of a cube, one repeat a side.
    let centre = DVec3::new(0.55, 0.45, 0.5);
    let first = build.scene.vertices.len();
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    for [u, v] in [[x, y], [y, x], [y, z], [z, y], [z, x], [x, z]] {
        let side = build.quad(0.5 * (u.cross(v) - u - v), u, v, (4, 4), skin);
        build.uv(side.clone(), u, v);
        for t in &mut build.scene.triangles[side] {
            t.uv = t.uv.map(|uv| uv.map(|a| a + 0.5));
        }
    }
    for place in &mut build.scene.vertices[first..] {
        let even = place.to_array().map(|a| (0.5 * PI * a).tan());
        *place = centre + 0.25 * DVec3::from_array(even).normalize();
    }
    build.weld();
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
    let fine = displace(&scene);
    let dark = vec![Vec3::ZERO; fine.triangles.len()];
    // Its heights as a texture, lit by an irradiance of π.
    let mut painted = fine.clone();
    for (painted, material) in painted.materials.iter_mut().zip(&scene.materials) {
        painted.ke = [0.0; 3];
        let Some(map) = &material.map_height else {
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

/// A picture of so many pixels a side, all alike.
fn even(side: u32, value: [f32; 3]) -> Picture {
    let scene = small(None);
    let dark = vec![Vec3::ZERO; scene.triangles.len()];
    let camera = small_camera();
    let view = View {
        camera: &camera,
        width: side,
        height: side,
    };
    let mut picture = render(&device(), &scene, &dark, &view).expect("a picture");
    picture.radiance.fill(value);
    picture
}

#[test]
fn comparisons_have_closed_forms() {
    // f32 holds these to 2⁻²⁴.
    const ROUNDING: f64 = 1e-6;
    let close = |a: f64, b: f64| assert!((a - b).abs() < ROUNDING, "{a} for {b}");
    let reference = even(2, [1.0, 2.0, 3.0]);
    let same = Comparison::new(&reference, &reference).expect("alike in size");
    assert_eq!((same.rel_mse, same.bias, same.rms), (0.0, 0.0, 0.0));
    // A tenth brighter everywhere.
    let mut brighter = reference.clone();
    for value in brighter.radiance.as_flattened_mut() {
        *value *= 1.1;
    }
    let found = Comparison::new(&brighter, &reference).expect("alike in size");
    let dark = 0.02_f64.powi(2);
    let expected = [1.0_f64, 2.0, 3.0].map(|b| (0.1 * b).powi(2) / (b * b + dark));
    close(found.rel_mse, expected.iter().sum::<f64>() / 3.0);
    close(found.bias, 0.1);
    close(found.rms, (0.01_f64 * 14.0 / 3.0).sqrt() / 2.0);
    // One red value of twelve is off by 1; a black reference pixel counts by the hundredth of the mean.
    let mut spot = reference.clone();
    spot.radiance[3][0] = 0.0;
    let found = Comparison::new(&spot, &reference).expect("alike in size");
    close(found.rel_mse, 1.0 / (1.0 + dark) / 12.0);
    close(found.bias, -1.0 / 24.0);
    close(found.rms, (1.0_f64 / 12.0).sqrt() / 2.0);
    let back = Comparison::new(&reference, &spot).expect("alike in size");
    let mean = 23.0 / 12.0;
    close(back.rel_mse, 1.0 / (0.01_f64 * mean).powi(2) / 12.0);

    let wide = side_by_side(&spot, &brighter).expect("alike in size");
    assert_eq!((wide.width, wide.height, wide.radiance.len()), (6, 2, 12));
    assert_eq!(wide.radiance[6..8], spot.radiance[2..4]);
    assert_eq!(wide.radiance[8..10], brighter.radiance[2..4]);
    // Darker is blue.
    assert!(wide.radiance[11][2] > wide.radiance[11][0]);
    let other = even(3, [1.0; 3]);
    for error in [
        Comparison::new(&reference, &other).err(),
        side_by_side(&reference, &other).err(),
    ] {
        let message = error.expect("sizes differ").to_string();
        assert!(
            message.contains("2x2") && message.contains("3x3"),
            "{message}"
        );
    }
}

/// A row and a picture for each view and part of the light, and the same rows in both files; no row for what is not there.
#[test]
fn bench_writes_rows_and_pictures() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let run = |material| {
        let options = pictures::Options {
            side: 8,
            paths: 4,
            material: Some(material),
            lighting: Lighting {
                cache: Some(folder.path()),
                ..Lighting::from(&[][..])
            },
        };
        pictures::run(&device(), &options, folder.path(), || true)
    };
    let rows = run("bumps").expect("rows");
    assert_eq!(rows.len(), 9);
    for row in &rows {
        let name = format!("{}-{}-{}.png", row.material, row.angle, row.light);
        let picture = image::open(folder.path().join(&name)).expect("a picture");
        assert_eq!((picture.width(), picture.height()), (24, 8), "{name}");
        assert!(row.noise > 0.0 && (0.0..1.0).contains(&row.flip), "{row:?}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("read");
    assert_eq!(read("pictures.csv").lines().count(), 10);
    let json: serde_json::Value = serde_json::from_str(&read("pictures.json")).expect("JSON");
    assert_eq!(json[8]["light"], "global");
    // A number read may differ from the one written in its last bit.
    let read_back = json[8]["rel_mse"].as_f64().expect("a number");
    assert!((read_back - rows[8].rel_mse).abs() <= 1e-15 * read_back.abs());
    let error = run("nosuch").expect_err("no such material").to_string();
    assert!(
        error.contains("nosuch") && error.contains("bricks"),
        "{error}"
    );
    assert_silent();
}
