//! The reference path tracer against closed forms, against the rasteriser's view of a scene, and against itself.

mod common;

use std::f64::consts::PI;
use std::sync::Arc;
use std::time::Duration;

use common::Build;
use glam::{DVec3, Vec3};
use mesolux::form_factor::to_polygon;
use mesolux::path_tracer::{Film, PathTracer, Settings};
use mesolux::render::{Light, View, render};
use mesolux::scene::{Camera, Scene, Texture};

/// Standard errors that an estimate may lie from the truth: one normal variable in 15 000 does, and every seed is fixed.
const SIGMAS: f64 = 4.0;
/// What f32 leaves of a value.
const ROUNDING: f64 = 1e-6;
/// Where scenes far from the origin stand; f64 keeps 1e-10 of a unit there.
const FAR: DVec3 = DVec3::new(1e6, -1e6, 1e6);
/// Radiosity in the middle of the floor, the ceiling and a wall of the unit cube of `cube`.
const CENTRES: [f64; 3] = [1.09180515, 0.19760441, 0.17764761];
/// Ke for an emitted radiosity of 1.
const UNIT: f32 = 1.0 / std::f32::consts::PI;

fn tracer(scene: &Scene) -> PathTracer<'_> {
    PathTracer::new(scene).expect("the scene is good")
}

fn camera(position: DVec3, look_at: DVec3) -> Camera {
    Camera {
        name: "test".into(),
        position,
        look_at,
        up: DVec3::Y,
        fov_y: 60.0,
    }
}

fn view(camera: &Camera, width: u32, height: u32) -> View<'_> {
    View {
        camera,
        width,
        height,
    }
}

fn settings(paths: u32, light: Light) -> Settings {
    Settings {
        paths,
        light,
        ..Settings::default()
    }
}

fn draw(scene: &Scene, view: &View<'_>, settings: &Settings) -> Film {
    tracer(scene)
        .render(view, settings, |_| true)
        .expect("a picture")
}

/// Red irradiance at a place, within so many of its standard errors of `exact`, themselves at most a share of it.
fn assert_irradiance(
    tracer: &PathTracer,
    (at, normal): (DVec3, DVec3),
    (paths, light): (u32, Light),
    exact: f64,
    most_noise: f64,
) {
    let (mean, error) = tracer.irradiance(at, normal, paths, 1, light);
    let (mean, error) = (f64::from(mean.x), f64::from(error.x));
    println!("{light:?} at {at}: {mean:.6} ± {error:.6} for {exact:.6}");
    assert!((mean - exact).abs() <= SIGMAS * error + ROUNDING * exact);
    assert!(error <= most_noise * exact);
}

/// A room whose sides reflect and emit one half: L = 1/2 + 1/2 L everywhere, at the origin and far from it.
#[test]
fn furnace() {
    for offset in [DVec3::ZERO, FAR] {
        let mut build = Build::new();
        let side = build.material(0.5, 0.5);
        build.room(offset, DVec3::new(1.0, 1.0, 2.0), 2, side);
        let eye = camera(offset + DVec3::new(0.3, 0.4, 1.7), offset + 0.3);
        let film = draw(
            &build.scene,
            &view(&eye, 24, 16),
            &settings(128, Light::Global),
        );
        let (mean, half) = film.mean();
        println!("mean {mean} ± {half}");
        assert!((mean - 1.0).abs().cmple(half * (SIGMAS / 1.96)).all());
        assert!(half.max_element() < 2e-3);
        // The same error in every pixel, but for its own uncertainty.
        let typical = film.relative_error();
        assert!(typical < 0.05);
        for radiance in film.radiance() {
            assert!((radiance.x - 1.0).abs() <= 6.0 * typical, "{radiance}");
        }
        // Also in a corner, from which rays meet the sides at once.
        let tracer = tracer(&build.scene);
        for near in [1e-2, 1e-6] {
            let corner = offset + DVec3::new(1.0, near, 2.0 - near);
            let paths = (100_000, Light::Global);
            assert_irradiance(&tracer, (corner, -DVec3::X), paths, PI, 2e-3);
        }
    }
}

/// A share of 95 % of the intervals of ±1.96 standard errors hold the truth: of 400, the share's own error is 1.1 %.
#[test]
fn tells_its_own_error() {
    let mut build = Build::new();
    let light = build.material(0.5, UNIT);
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 1, 0);
    for t in &mut build.scene.triangles[sides[0].clone()] {
        t.material = light;
    }
    let tracer = tracer(&build.scene);
    let at = |paths, seed| {
        let middle = DVec3::new(0.5, 1.0, 0.5);
        tracer.irradiance(middle, -DVec3::Y, paths, seed, Light::Global)
    };
    let (truth, _) = at(400_000, u64::MAX);
    let held = (0..400)
        .filter(|&seed| {
            let (mean, error) = at(500, seed);
            (mean.x - truth.x).abs() <= 1.96 * error.x
        })
        .count();
    println!("{held} of 400 intervals hold the truth");
    assert!((360..=396).contains(&held));
}

/// I cos θ / d² in any scale, nothing behind a screen or below the surface.
#[test]
fn point_light() {
    for (offset, scale) in [(DVec3::ZERO, 1.0), (FAR, 1.0), (DVec3::ZERO, 1e-3)] {
        let mut build = Build::new();
        build.quad(
            offset,
            DVec3::Z * 4.0 * scale,
            DVec3::X * 4.0 * scale,
            (2, 2),
            0,
        );
        let screen = offset + DVec3::new(1.7, 1.0, -1.0) * scale;
        build.quad(screen, DVec3::Z * 9.0 * scale, DVec3::X * scale, (1, 1), 0);
        let lamp = offset + DVec3::new(1.0, 2.0, 1.0) * scale;
        build.point_light(lamp, 3.0);
        let tracer = tracer(&build.scene);
        for (x, z, lit) in [
            (1.0, 1.0, true),
            (0.2, 3.1, true),
            (2.0, 2.0, true),
            (3.9, 2.5, false),
        ] {
            let at = offset + DVec3::new(x, 0.0, z) * scale;
            let to = lamp - at;
            let exact = 3.0 * to.y / to.length().powi(3);
            let (mean, error) = tracer.irradiance(at, DVec3::Y, 8, 0, Light::Direct);
            let exact = if lit { exact } else { 0.0 };
            println!("{at}: {} for {exact}", mean.x);
            // A position 10⁶ units away is known to 1e-10 of a unit; the rest is f32's.
            assert!((f64::from(mean.x) - exact).abs() <= 2.0 * ROUNDING * exact);
            assert!(f64::from(error.x) <= ROUNDING * exact);
        }
        let below = tracer.irradiance(offset, -DVec3::Y, 8, 0, Light::Direct);
        assert_eq!(below.0, Vec3::ZERO);
    }
}

/// E = π Le F by Lambert's formula, from afar, from so near that light samples alone would be all noise, and from behind.
#[test]
fn area_light() {
    let mut build = Build::new();
    let lamp = build.material(0.0, 10.0);
    build.quad(
        DVec3::new(-4.0, 0.0, -4.0),
        DVec3::Z * 8.0,
        DVec3::X * 8.0,
        (2, 2),
        0,
    );
    let contour = [
        DVec3::new(-0.1, 2.0, -0.1),
        DVec3::new(0.1, 2.0, -0.1),
        DVec3::new(0.1, 2.0, 0.1),
        DVec3::new(-0.1, 2.0, 0.1),
    ];
    build.quad(contour[0], DVec3::X * 0.2, DVec3::Z * 0.2, (1, 1), lamp);
    let tracer = tracer(&build.scene);
    for (at, normal, noise) in [
        (DVec3::ZERO, DVec3::Y, 1e-3),
        (DVec3::new(1.5, 0.0, 0.7), DVec3::Y, 1e-3),
        (DVec3::new(0.05, 1.999, 0.0), DVec3::Y, 1e-2),
        (DVec3::new(0.11, 1.99, 0.0), -DVec3::X, 1e-2),
    ] {
        let exact = PI * 10.0 * to_polygon(at, normal, &contour);
        assert_irradiance(&tracer, (at, normal), (20_000, Light::Direct), exact, noise);
    }
    let above = DVec3::new(0.0, 2.5, 0.0);
    let (dark, _) = tracer.irradiance(above, -DVec3::Y, 1000, 0, Light::Direct);
    assert_eq!(dark, Vec3::ZERO, "a lamp's back is black");
}

/// Unit cube, ρ = 0.5, the floor emits 1: radiosity of the continuous solution in the middle of each side, from a fine
/// quadrature of the integral equation, and the light straight from the floor.
#[test]
fn cube() {
    let mut build = Build::new();
    let light = build.material(0.5, UNIT);
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 1, 0);
    for t in &mut build.scene.triangles[sides[0].clone()] {
        t.material = light;
    }
    let tracer = tracer(&build.scene);
    let middle = |normal: DVec3| (DVec3::splat(0.5) - 0.5 * normal, normal);
    const PATHS: u32 = 200_000;
    const NOISE: f64 = 5e-3;
    for (normal, radiosity, emitted) in [
        (DVec3::Y, CENTRES[0], 1.0),
        (-DVec3::Y, CENTRES[1], 0.0),
        (DVec3::X, CENTRES[2], 0.0),
        (-DVec3::Z, CENTRES[2], 0.0),
    ] {
        let exact = (radiosity - emitted) / 0.5;
        assert_irradiance(
            &tracer,
            middle(normal),
            (PATHS, Light::Global),
            exact,
            NOISE,
        );
        let floor = [DVec3::ZERO, DVec3::Z, DVec3::X + DVec3::Z, DVec3::X];
        let (at, _) = middle(normal);
        let straight = if normal == DVec3::Y {
            0.0
        } else {
            to_polygon(at, normal, &floor)
        };
        let rest = exact - straight;
        assert_irradiance(
            &tracer,
            middle(normal),
            (PATHS, Light::Direct),
            straight,
            NOISE,
        );
        assert_irradiance(
            &tracer,
            middle(normal),
            (PATHS, Light::Indirect),
            rest,
            NOISE,
        );
    }
}

/// Not one of 10⁵ rays in a closed ball with lamps outside finds a gap, nor a lit place behind a sheet with two fronts.
#[test]
fn nothing_leaks() {
    for offset in [DVec3::ZERO, FAR] {
        let mut build = Build::new();
        let lamp = build.material(0.5, 1.0);
        build.sphere(offset, 1.0, 3, false, 0);
        build.sphere(offset, 3.0, 1, false, lamp);
        let tracer = tracer(&build.scene);
        let (inside, _) = tracer.irradiance(offset + 0.1, DVec3::Y, 100_000, 0, Light::Global);
        assert_eq!(inside, Vec3::ZERO);
    }
    // Front and back in one place: each side shows its front.
    let mut build = Build::new();
    let (red, blue) = (build.material(0.0, 2.0), build.material(0.0, 3.0));
    build.quad(
        DVec3::new(-1.0, -1.0, 0.0),
        DVec3::X * 2.0,
        DVec3::Y * 2.0,
        (1, 1),
        red,
    );
    build.quad(
        DVec3::new(-1.0, -1.0, 0.0),
        DVec3::Y * 2.0,
        DVec3::X * 2.0,
        (1, 1),
        blue,
    );
    for (side, radiance) in [(1.0, 2.0), (-1.0, 3.0)] {
        let eye = camera(DVec3::new(0.1, 0.2, side), DVec3::ZERO);
        let film = draw(&build.scene, &view(&eye, 8, 8), &settings(8, Light::Global));
        assert_eq!(film.radiance(), vec![DVec3::splat(radiance); 64]);
    }
}

/// A box with a lamp, a screen and a point light.
fn lit_room() -> Build {
    let mut build = Build::new();
    let (lamp, white) = (build.material(0.3, 4.0), build.material(0.8, 0.0));
    build.room(DVec3::ZERO, DVec3::ONE, 1, white);
    build.quad(
        DVec3::new(0.4, 0.9, 0.4),
        DVec3::X * 0.2,
        DVec3::Z * 0.2,
        (1, 1),
        lamp,
    );
    build.quad(
        DVec3::new(0.2, 0.3, 0.2),
        DVec3::Z * 0.4,
        DVec3::X * 0.4,
        (1, 1),
        0,
    );
    build.point_light(DVec3::new(0.8, 0.5, 0.3), 0.1);
    build
}

fn lit_room_camera() -> Camera {
    camera(DVec3::new(0.5, 0.6, 0.98), DVec3::new(0.45, 0.45, 0.0))
}

#[test]
fn the_same_bytes_whatever_the_threads() {
    let build = lit_room();
    let eye = lit_room_camera();
    let traced = |threads, seed| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .expect("threads");
        pool.install(|| {
            let settings = Settings {
                seed,
                ..settings(32, Light::Global)
            };
            let film = draw(&build.scene, &view(&eye, 33, 21), &settings);
            let tracer = tracer(&build.scene);
            let lit = tracer.irradiance(DVec3::splat(0.5), DVec3::Y, 5000, seed, Light::Global);
            (film.radiance(), film.standard_error(), lit)
        })
    };
    let one = traced(1, 7);
    assert_eq!(one, traced(2, 7));
    assert_ne!(one.0, traced(2, 8).0);
}

#[test]
fn all_light_is_direct_and_indirect() {
    let build = lit_room();
    let eye = lit_room_camera();
    let [all, direct, indirect] = [Light::Global, Light::Direct, Light::Indirect].map(|light| {
        let settings = Settings {
            seed: light as u64,
            ..settings(64, light)
        };
        let (mean, half) = draw(&build.scene, &view(&eye, 40, 40), &settings).mean();
        println!("{light:?}: {} ± {}", mean.x, half.x);
        (mean.x, half.x / 1.96)
    });
    let error = all.1.hypot(direct.1).hypot(indirect.1);
    assert!((all.0 - direct.0 - indirect.0).abs() <= SIGMAS * error);
    assert!(error < 0.01 * all.0 && direct.0 > 0.1 * all.0 && indirect.0 > 0.1 * all.0);
}

/// Emitters of three colours and a back, none symmetric, seen from 10⁶ units off the origin by an eye outside of them and by
/// one with an oblique up: what the rasteriser shows, but for the edges, where both have samples of their own.
#[test]
fn sees_what_the_rasteriser_sees() {
    let mut build = Build::new();
    let mut add = |corners: [[f64; 3]; 3], ke: [f32; 3]| {
        let material = build.material(0.0, 0.0);
        build.scene.materials[material as usize].ke = ke;
        let corners = corners.map(|c| build.vertex(FAR + DVec3::from_array(c)));
        build.triangle(corners, material);
    };
    add(
        [[-1.2, -0.8, 0.0], [-0.2, -0.7, 0.3], [-0.9, 0.5, -0.2]],
        [0.8, 0.1, 0.05],
    );
    add(
        [[0.1, -0.9, -0.4], [1.2, -0.6, 0.2], [0.8, 0.6, 0.0]],
        [0.1, 0.7, 0.05],
    );
    add(
        [[-0.5, 0.7, 0.0], [0.6, 0.8, 0.0], [-0.4, 1.2, 0.1]],
        [0.05, 0.1, 0.9],
    );
    add(
        [[0.5, -0.5, 0.5], [0.6, 0.0, 0.5], [0.9, -0.4, 0.5]],
        [1.0, 1.0, 1.0],
    );
    for (distance, up) in [(4.0, DVec3::Y), (400.0, DVec3::new(0.5, 1.0, 0.0))] {
        let eye = Camera {
            up,
            fov_y: 2.0 * (1.3_f64 / distance).atan().to_degrees(),
            ..camera(FAR + DVec3::new(0.0, 0.0, distance), FAR)
        };
        let view = view(&eye, 96, 64);
        let dark = vec![Vec3::ZERO; build.scene.triangles.len()];
        let raster = render(&common::device(), &build.scene, &dark, &view).expect("a picture");
        let film = draw(&build.scene, &view, &settings(128, Light::Direct));
        let (mut compared, mut lit) = (0, 0);
        let errors = film.standard_error();
        for ((ours, error), theirs) in film.radiance().iter().zip(errors).zip(&raster.radiance) {
            let theirs = Vec3::from_array(*theirs).as_dvec3();
            // 16 samples of theirs in the pixel against 128: at an edge they may differ by 1/4.
            assert!(
                (*ours - theirs).abs().max_element()
                    <= if error == DVec3::ZERO { 0.07 } else { 0.25 }
            );
            if error == DVec3::ZERO && (*ours - theirs).abs().max_element() < ROUNDING {
                compared += 1;
                lit += usize::from(*ours != DVec3::ZERO);
            }
        }
        println!(
            "{compared} of {} pixels the same, {lit} of them lit",
            96 * 64
        );
        assert!(compared > 96 * 64 * 8 / 10 && lit > 600);
        common::assert_silent();
    }
}

/// A texture of four colours, upright and mirrored as the rasteriser has it, under light from so far that it is even.
#[test]
fn looks_textures_up_as_the_rasteriser_does() {
    let mut build = Build::new();
    build.scene.materials[0].kd = [0.5, 0.8, 1.0];
    build.scene.materials[0].map_kd = Some(Arc::new(Texture {
        path: "test".into(),
        width: 2,
        height: 2,
        texels: vec![
            [0.9, 0.1, 0.1],
            [0.1, 0.9, 0.1],
            [0.1, 0.1, 0.9],
            [0.5, 0.5, 0.5],
        ],
    }));
    let low = DVec3::new(-1.0, -1.0, 0.0);
    let square = build.quad(low, DVec3::X * 2.0, DVec3::Y * 2.0, (1, 1), 0);
    build.uv(square, DVec3::X * 1.7, DVec3::Y * 2.3);
    const AWAY: f64 = 1e4;
    build.point_light(DVec3::Z * AWAY, (AWAY * AWAY) as f32);
    let eye = camera(DVec3::new(0.2, 0.1, 1.2), DVec3::new(0.1, 0.0, 0.0));
    let view = view(&eye, 64, 64);
    let lit = vec![Vec3::ONE; build.scene.triangles.len()];
    let raster = render(&common::device(), &build.scene, &lit, &view).expect("a picture");
    let film = draw(&build.scene, &view, &settings(128, Light::Global));
    for (ours, theirs) in film.radiance().iter().zip(&raster.radiance) {
        let theirs = Vec3::from_array(*theirs).as_dvec3();
        // Jitter, and the device's weights in steps of 1/256, leave 2 % of the brightest.
        assert!(
            (*ours - theirs).abs().max_element() <= 0.02 / PI,
            "{ours} for {theirs}"
        );
        assert!(theirs.min_element() > 0.0, "the square fills the picture");
    }
    common::assert_silent();
}

#[test]
fn stops_when_told_and_keeps_what_there_is() {
    let build = lit_room();
    let eye = lit_room_camera();
    let (view, tracer) = (view(&eye, 16, 16), tracer(&build.scene));
    let settings = settings(100, Light::Global);
    let whole = tracer
        .render(&view, &settings, |_| true)
        .expect("a picture");
    assert!((100..=108).contains(&whole.paths) && whole.passes >= 8);
    let mut asked = 0;
    let cut = |p: &mesolux::path_tracer::Progress| {
        asked += 1;
        assert_eq!(p.of, whole.paths);
        asked < 3
    };
    let cut = tracer.render(&view, &settings, cut).expect("a picture");
    assert_eq!((cut.passes, asked), (4, 3));
    let none = Settings {
        budget: Some(Duration::ZERO),
        ..settings
    };
    let cut = tracer.render(&view, &none, |_| true).expect("a picture");
    assert_eq!(cut.passes, 2);
    assert!(cut.relative_error().is_finite() && cut.relative_error() > whole.relative_error());
}

#[test]
fn refuses_what_cannot_be_traced() {
    let said = |result: Result<Film, mesolux::error::Error>| {
        result.map(|_| ()).expect_err("refused").to_string()
    };
    let build = lit_room();
    let tracer = tracer(&build.scene);
    let eye = lit_room_camera();
    let go = |view: &View<'_>, paths| {
        said(tracer.render(view, &settings(paths, Light::Global), |_| true))
    };
    assert!(go(&view(&eye, 8, 8), 1).contains("paths 1"));
    assert!(go(&view(&eye, 8, 8), u32::MAX).contains("paths 4294967295"));
    assert!(go(&view(&eye, 0, 8), 8).contains("width 0"));
    assert!(go(&view(&eye, 16384, 16384), 8).contains("16384x16384"));
    let blind = camera(DVec3::ONE, DVec3::ONE);
    assert!(go(&view(&blind, 8, 8), 8).contains("camera \"test\""));
    // No direction, no place: no light, and no panic.
    for (at, normal) in [
        (DVec3::ONE * 0.5, DVec3::ZERO),
        (DVec3::NAN, DVec3::Y),
        (DVec3::INFINITY, DVec3::Y),
    ] {
        let (mean, _) = tracer.irradiance(at, normal, 0, 0, Light::Global);
        assert_eq!(mean, Vec3::ZERO);
    }
    let empty = Scene::default();
    assert!(PathTracer::new(&empty).is_err());
    let mut broken = lit_room().0.scene;
    broken.triangles[3].vertices[1] = 9999;
    assert!(PathTracer::new(&broken).is_err());
    let mut broken = lit_room().0.scene;
    broken.vertices[2].y = f64::NAN;
    assert!(PathTracer::new(&broken).is_err());
}
