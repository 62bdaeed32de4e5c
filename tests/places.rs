//! Light at places that are no elements.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::math::form_factor::to_triangle;
use mesolux::mesh::elements::Elements;
use mesolux::solver::{Place, Settings, Solver};

fn solved(build: &Build) -> Solver {
    let elements = Elements::new(&build.scene);
    let lights = &build.scene.lights;
    let mut solver = Solver::new(&device(), elements, lights, &Settings::default())
        .expect("the scene fits the device");
    solver.run(|_| true).expect("it is solved");
    solver
}

/// A place in each of some triangles (R₂ sequence), a little away from their borders.
fn places(build: &Build, every: usize) -> Vec<(usize, Place)> {
    let triangles = build.scene.triangles.iter().enumerate().step_by(every);
    triangles
        .map(|(e, t)| {
            let [a, b, c] = build.scene.corners(t);
            let step = |by: f64| (0.5 + by * e as f64).fract();
            let (u, v) = (step(0.754_877_666), step(0.569_840_291));
            let (u, v) = if u + v > 1.0 {
                (1.0 - u, 1.0 - v)
            } else {
                (u, v)
            };
            let position = a + u * (b - a) + v * (c - a);
            let normal = (b - a).cross(c - a).normalize();
            (e, Place { position, normal })
        })
        .collect()
}

/// In a closed room whose surfaces emit what they absorb, every place receives 1.
#[test]
fn a_furnace_is_even_at_every_place() {
    let mut build = Build::new();
    let grey = build.material(0.5, 0.5);
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 10, grey);
    assert_eq!(sides.len(), 6);
    build.sphere(DVec3::new(0.5, 0.3, 0.5), 0.29, 3, true, grey);
    build.weld();
    for material in &mut build.scene.materials {
        // Emitted radiosity 1 − ρ.
        material.kd = [0.5; 3];
        material.ke = [0.5 / std::f32::consts::PI; 3];
    }
    let solver = solved(&build);
    let places = places(&build, 5);
    let at: Vec<Place> = places.iter().map(|(_, place)| *place).collect();
    let found = solver.light_at(&at).expect("the places are good");
    let errors: Vec<f64> = (found.iter())
        .map(|light| f64::from((light.direct + light.indirect).x) - 1.0)
        .collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let most = errors.iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    println!("{} places: rms {rms:.1e}, most {most:.1e}", errors.len());
    assert!(rms <= FURNACE[0] && most <= FURNACE[1]);
    assert_silent();
}

/// Measured: rms 2.4e-3, at most 1.3e-2, on a ball of 1,280 triangles and the walls about it.
const FURNACE: [f64; 2] = [5e-3, 2.6e-2];

/// Light that nothing stands before against Lambert's formula and the inverse square; and places
/// that cannot be are refused.
#[test]
fn open_light_is_that_of_closed_forms() {
    let mut build = Build::new();
    let black = build.material(0.0, 0.0);
    let lamp = build.material(0.0, 2.0);
    let floor = build.quad(DVec3::ZERO, DVec3::Z, DVec3::X, (4, 4), black);
    let lamp = build.quad(DVec3::new(0.2, 0.7, 0.1), DVec3::X, DVec3::Z, (3, 3), lamp);
    build.point_light(DVec3::new(0.2, 0.4, 0.8), 0.3);
    build.weld();
    let solver = solved(&build);
    let places: Vec<Place> = (places(&build, 1).into_iter())
        .filter(|(e, _)| floor.contains(e))
        .map(|(_, place)| place)
        .collect();
    let found = solver.light_at(&places).expect("the places are good");
    let emitted = 2.0 * std::f64::consts::PI;
    let mut worst = 0.0_f64;
    for (place, light) in places.iter().zip(&found) {
        let of_lamp: f64 = (build.scene.triangles[lamp.clone()].iter())
            .map(|t| to_triangle(place.position, place.normal, &build.scene.corners(t)).max(0.0))
            .sum();
        let way = DVec3::new(0.2, 0.4, 0.8) - place.position;
        let of_point = 0.3 * way.dot(place.normal) / way.length().powi(3);
        let expected = emitted * of_lamp + of_point;
        worst = worst.max((f64::from(light.direct.x) / expected - 1.0).abs());
        assert_eq!(light.indirect, Vec3::ZERO);
    }
    println!("{} places: {worst:.1e} off at most", places.len());
    assert!(places.len() == 32 && worst <= OPEN);
    let bad = Place {
        position: DVec3::NAN,
        normal: DVec3::Y,
    };
    assert!(solver.light_at(&[bad]).is_err());
    assert_silent();
}

/// Measured: 1.3e-7.
const OPEN: f64 = 3e-7;
