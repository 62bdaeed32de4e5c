//! Against closed forms: pictures and irradiance within their own standard errors.

use std::f64::consts::PI;

use glam::{DVec3, Vec3};
use mesolux::math::form_factor::to_polygon;
use mesolux::path_tracer::PathTracer;
use mesolux::render::Light;

use crate::common::Build;
use crate::{FAR, ROUNDING, SIGMAS, camera, draw, settings, tracer, view};

/// Radiosity in the middle of the floor, the ceiling and a wall of the unit cube of `cube`.
const CENTRES: [f64; 3] = [1.09180515, 0.19760441, 0.17764761];
/// Ke for an emitted radiosity of 1.
const UNIT: f32 = 1.0 / std::f32::consts::PI;

/// A unit cube with ρ = 0.5 whose floor emits 1.
fn lit_cube() -> Build {
    let mut build = Build::new();
    let light = build.material(0.5, UNIT);
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 1, 0);
    build.paint(sides[0].clone(), light);
    build
}

/// Red irradiance at a place, within so many of its standard errors of `exact`, themselves at most
/// a share of it.
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

/// A room whose sides reflect and emit one half: L = 1/2 + 1/2 L everywhere, at the origin and far
/// from it.
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

/// A share of 95 % of the intervals of ±1.96 standard errors hold the truth: of 400, the share's
/// own error is 1.1 %.
#[test]
fn tells_its_own_error() {
    let build = lit_cube();
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

/// E = π Le F by Lambert's formula, from afar, from so near that light samples alone would be all
/// noise, and from behind.
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

/// Unit cube, ρ = 0.5, the floor emits 1: radiosity of the continuous solution in the middle of
/// each side, from a fine quadrature of the integral equation, and the light straight from the
/// floor.
#[test]
fn cube() {
    let build = lit_cube();
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

/// Not one of 10⁵ rays in a closed ball with lamps outside finds a gap, nor a lit place behind a
/// sheet with two fronts.
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
