//! Daylight in rooms with unglazed openings, after CIE 171:2006, 5.9, 5.11, 5.13 and 5.14: what
//! places receive of CIE skies through a hole in the roof or the façade, with and without masks
//! before it, against a quadrature over the hole.

mod common;

use common::{Build, assert_silent, device};
use glam::DVec3;
use mesolux::mesh::elements::Elements;
use mesolux::scene::sky::{Dome, Gradation, Sky};
use mesolux::solver::{Place, Settings, Solver};
use rayon::prelude::*;

/// Of each place's light, or of a hundredth of the brightest where less is left: measured 0.16 % at
/// most, of a place that sees 0.05° beside a mask too.
const MOST: f64 = 4e-3;

/// A parallelogram.
#[derive(Clone, Copy)]
struct Side {
    corner: DVec3,
    u: DVec3,
    v: DVec3,
}

impl Side {
    fn new(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> Self {
        let [corner, u, v] = [corner, u, v].map(DVec3::from);
        Self { corner, u, v }
    }

    /// Whether a ray meets it.
    fn hides(&self, from: DVec3, direction: DVec3) -> bool {
        let normal = self.u.cross(self.v);
        let along = normal.dot(self.corner - from) / normal.dot(direction);
        let at = from + along * direction - self.corner;
        let (u, v) = (
            at.dot(self.u) / self.u.length_squared(),
            at.dot(self.v) / self.v.length_squared(),
        );
        along > 0.0 && (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)
    }
}

struct Case {
    name: &'static str,
    hole: Side,
    /// Wall or roof that the hole is in.
    around: Side,
    masks: Vec<Side>,
}

/// Rooms of 4 by 4 by 3; the façade is z = 4.
fn cases() -> Vec<Case> {
    let roof = Side::new([0.0, 3.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]);
    let facade = Side::new([0.0, 0.0, 4.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]);
    let window = Side::new([1.0, 1.0, 4.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let case = |name, hole, around, masks| Case {
        name,
        hole,
        around,
        masks,
    };
    vec![
        case(
            "5.9 roof",
            Side::new([1.5, 3.0, 1.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
            roof,
            vec![],
        ),
        case("5.11 façade", window, facade, vec![]),
        case(
            "5.13 horizontal mask",
            window,
            facade,
            vec![Side::new([0.5, 2.0, 4.0], [3.0, 0.0, 0.0], [0.0, 0.0, 1.0])],
        ),
        case(
            "5.14 vertical mask",
            window,
            facade,
            vec![Side::new(
                [-1.0, 0.0, 7.0],
                [6.0, 0.0, 0.0],
                [0.0, 3.5, 0.0],
            )],
        ),
    ]
}

fn skies() -> [(&'static str, Sky); 2] {
    let sun = DVec3::new(0.5, 0.6, 0.62).normalize();
    let sky = |number: u32| Sky {
        up: DVec3::Y,
        north: DVec3::NEG_Z,
        scale: [10.0; 3],
        dome: Dome::Gradation(
            Gradation::cie(number, DVec3::Y, sun).expect("a sky of the standard"),
        ),
    };
    [("overcast", sky(1)), ("clear", sky(12))]
}

/// Irradiance through the hole: Lambert's integral by places of the sequence R2, which finds narrow
/// strips of it whatever way they run.
fn expected(case: &Case, sky: &Sky, place: &Place) -> f64 {
    const PLACES: usize = 400_000;
    let Side { corner, u, v } = case.hole;
    let normal = u.cross(v).normalize();
    let area = u.cross(v).length() / PLACES as f64;
    let mut sum = 0.0;
    for k in 0..PLACES {
        let share = |step: f64| (0.5 + step * k as f64).fract();
        let (a, b) = (share(0.754_877_666_246_693), share(0.569_840_290_998_053));
        let way = corner + a * u + b * v - place.position;
        let square = way.length_squared();
        let towards = way / square.sqrt();
        let cosine = towards.dot(place.normal);
        let hidden = |mask: &Side| mask.hides(place.position, towards);
        if cosine > 0.0 && !case.masks.iter().any(hidden) {
            let facing = towards.dot(normal).abs();
            sum += sky.radiance(towards).x * cosine * facing / square * area;
        }
    }
    sum
}

#[test]
fn places_receive_daylight_through_openings() {
    for case in cases() {
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let mut side = |s: &Side| {
            build.quad(s.corner, s.u, s.v, (2, 2), black);
        };
        let box_sides = [
            Side::new([0.0; 3], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]),
            Side::new([0.0, 3.0, 0.0], [4.0, 0.0, 0.0], [0.0, 0.0, 4.0]),
            Side::new([0.0; 3], [0.0, 3.0, 0.0], [0.0, 0.0, 4.0]),
            Side::new([4.0, 0.0, 0.0], [0.0, 0.0, 4.0], [0.0, 3.0, 0.0]),
            Side::new([0.0; 3], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
            Side::new([0.0, 0.0, 4.0], [4.0, 0.0, 0.0], [0.0, 3.0, 0.0]),
        ];
        let with_hole = |s: &Side| {
            s.corner == case.around.corner && s.u == case.around.u && s.v == case.around.v
        };
        box_sides
            .iter()
            .filter(|s| !with_hole(s))
            .for_each(&mut side);
        case.masks.iter().for_each(&mut side);
        // Four strips about the hole.
        let Side { corner, u, v } = case.around;
        let (across, up) = (u.normalize(), v.normalize());
        let from = case.hole.corner - corner;
        let (left, below) = (from.dot(across), from.dot(up));
        let (wide, high) = (case.hole.u.length(), case.hole.v.length());
        for (corner, u, v) in [
            (corner, u, below * up),
            (corner + (below + high) * up, u, v - (below + high) * up),
            (corner + below * up, left * across, high * up),
            (
                corner + below * up + (left + wide) * across,
                u - (left + wide) * across,
                high * up,
            ),
        ] {
            side(&Side { corner, u, v });
        }
        let places: Vec<Place> = (0..12)
            .flat_map(|i| {
                let at = 0.25 + 3.5 * f64::from(i) / 11.0;
                [
                    (DVec3::new(2.0, 0.0, at), DVec3::Y),
                    (DVec3::new(0.7, 0.0, at), DVec3::Y),
                    (DVec3::new(at, 0.9, 0.0), DVec3::Z),
                    (DVec3::new(0.0, 1.3, at), DVec3::X),
                ]
            })
            .map(|(position, normal)| Place { position, normal })
            .collect();
        for (name, sky) in skies() {
            build.scene.lights.sky = Some(sky.clone());
            let elements = Elements::new(&build.scene);
            let lights = &build.scene.lights;
            let mut solver = Solver::new(&device(), elements, lights, &Settings::default())
                .expect("the scene fits the device");
            solver.run(|_| true).expect("it is solved");
            let found = solver.light_at(&places).expect("the places are good");
            let right: Vec<f64> = places
                .par_iter()
                .map(|place| expected(&case, &sky, place))
                .collect();
            let brightest = right.iter().copied().fold(0.0, f64::max);
            let off = |(light, right): (&mesolux::solver::LightAt, &f64)| {
                (f64::from(light.indirect.x) - right).abs() / right.max(0.01 * brightest)
            };
            let errors: Vec<f64> = found.iter().zip(&right).map(off).collect();
            let worst = errors.iter().copied().fold(0.0, f64::max);
            println!(
                "{}, {name}: worst of {} places {:.2} %",
                case.name,
                places.len(),
                100.0 * worst
            );
            assert!(worst < MOST, "{}, {name}: {worst}", case.name);
        }
        assert_silent();
    }
}
