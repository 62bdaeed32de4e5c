//! The reference path tracer against closed forms, against the rasteriser's view of a scene, and
//! against itself.

mod closed_forms;
#[path = "../common/mod.rs"]
mod common;
mod rasteriser;

use std::time::Duration;

use common::Build;
use glam::{DVec3, Vec3};
use mesolux::path_tracer::{Film, PathTracer, Settings};
use mesolux::render::{Light, View};
use mesolux::scene::{Camera, Scene};

/// Standard errors that an estimate may lie from the truth: one normal variable in 15 000 does, and
/// every seed is fixed.
const SIGMAS: f64 = 4.0;
/// What f32 leaves of a value.
const ROUNDING: f64 = 1e-6;
/// Where scenes far from the origin stand; f64 keeps 1e-10 of a unit there.
const FAR: DVec3 = DVec3::new(1e6, -1e6, 1e6);

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
        .render(view, settings, |_, _| true)
        .expect("a picture")
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

#[test]
fn stops_when_told_and_keeps_what_there_is() {
    let build = lit_room();
    let eye = lit_room_camera();
    let (view, tracer) = (view(&eye, 16, 16), tracer(&build.scene));
    let settings = settings(100, Light::Global);
    let whole = tracer
        .render(&view, &settings, |_, _| true)
        .expect("a picture");
    assert!((100..=108).contains(&whole.paths) && whole.passes >= 8);
    let mut asked = 0;
    let cut = |p: &mesolux::path_tracer::Progress, _: &mesolux::path_tracer::Film| {
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
    let cut = tracer.render(&view, &none, |_, _| true).expect("a picture");
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
        said(tracer.render(view, &settings(paths, Light::Global), |_, _| true))
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
