//! Sources that are drawn once and replayed give what sources drawn for every shot give.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::solver::{Light, Report, Settings, Solver};

/// Unshot light that each solution leaves, as a share of all. It lands on elements as large as any other, and half of it and
/// the rounding of sums in another order are what two solutions differ by.
const RESIDUAL: f64 = 5e-7;
/// Largest difference of two solutions, of the mean.
const TOLERANCE: f32 = 1e-6;

/// A closed room with a lamp and a ball, of which floor and ball have a relief or not.
fn scene(relief: bool) -> Build {
    let mut build = Build::new();
    let material = build.material(0.7, 0.0);
    let lamp = build.material(0.2, 3.0);
    if relief {
        let wave = |a: f64| (std::f64::consts::TAU * a).sin();
        build.relief(material, 8, |x, y| 0.03 * wave(x) * wave(y));
    }
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 4, 0);
    for t in &mut build.scene.triangles[sides[0].clone()] {
        t.material = material;
    }
    build.uv(sides[0].clone(), 0.25 * DVec3::X, 0.25 * DVec3::Z);
    let ball = build.sphere(DVec3::new(0.5, 0.4, 0.5), 0.2, 2, true, material);
    build.uv(ball, DVec3::new(0.2, 0.05, 0.0), DVec3::new(0.0, 0.1, 0.2));
    let [x, z] = [0.4 * DVec3::X, 0.4 * DVec3::Z];
    build.quad(DVec3::new(0.3, 0.95, 0.3), x, z, (2, 2), lamp);
    build.point_light(DVec3::new(0.2, 0.7, 0.8), 0.3);
    build
}

fn solve(relief: bool, visibility_memory: Option<u64>) -> (Light, Report) {
    let build = scene(relief);
    let settings = Settings {
        hemicube: 32,
        batch: 6,
        residual: RESIDUAL,
        visibility_memory,
        relief: Options {
            transport: Transport::Physical,
            directions: Directions::new(32).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    };
    let device = device();
    let elements = mesolux::bake::elements(&device, &build.scene, &settings)
        .expect("the relief fits the device");
    let mut solver = Solver::new(&device, elements, &build.scene.point_lights, &settings)
        .expect("the scene fits the device");
    solver.run(|_| true).expect("it runs");
    let light = solver.light().expect("the light comes back");
    (light, solver.report().clone())
}

fn largest_difference(a: &[Vec3], b: &[Vec3]) -> f32 {
    let mean = a.iter().map(|v| v.element_sum()).sum::<f32>() / (3 * a.len()) as f32;
    let differences = a.iter().zip(b).map(|(a, b)| (a - b).abs().max_element());
    differences.fold(0.0, f32::max) / mean
}

#[test]
fn replayed_sources_light_as_drawn_ones_do() {
    for relief in [false, true] {
        let (drawn, every) = solve(relief, Some(0));
        assert_eq!((every.kept_sources, every.replayed), (0, 0));
        assert_eq!(every.hemicubes, u64::from(every.shots));
        // All; and so little that the rest is drawn for every shot.
        for memory in [None, Some(40 << 10)] {
            let (replayed, once) = solve(relief, memory);
            let difference = largest_difference(&drawn.irradiance, &replayed.irradiance)
                .max(largest_difference(&drawn.radiosity, &replayed.radiosity));
            println!(
                "relief {relief}, memory {memory:?}: {} of {} sources kept, {} drawn, {} replayed ({} drawn without): largest difference {difference:.1e}",
                once.kept_sources, once.sources, once.hemicubes, once.replayed, every.hemicubes
            );
            assert!(difference <= TOLERANCE);
            assert_eq!(u64::from(once.shots), once.hemicubes + once.replayed);
            assert!(once.replayed > 0 && once.hemicubes < every.hemicubes);
            match memory {
                None => assert_eq!(once.kept_sources, once.hemicubes, "each is drawn once"),
                Some(_) => assert!(0 < once.kept_sources && once.kept_sources < once.sources),
            }
            if let (Some(a), Some(b)) = (&drawn.relief, &replayed.relief) {
                let moments = |light: &mesolux::solver::ReliefLight| -> Vec<Vec3> {
                    light.moments.iter().flatten().copied().collect()
                };
                // Plain sums in f32: the strongest slot's rounding counts.
                let (a, b) = (moments(a), moments(b));
                let largest = a.iter().map(|v| v.abs().max_element()).fold(0.0, f32::max);
                let apart = a.iter().zip(&b).map(|(a, b)| (a - b).abs().max_element());
                let difference = apart.fold(0.0, f32::max) / largest;
                println!("moments: {difference:.1e} of the largest");
                assert!(difference <= TOLERANCE);
            }
        }
    }
    assert_silent();
}

/// The count of shots and the order of sources repeat, whatever is kept.
#[test]
fn a_run_with_kept_sources_repeats_to_the_bit() {
    let runs = [(); 2].map(|()| solve(true, Some(100 << 10)));
    let [(a, first), (b, second)] = &runs;
    assert_eq!(first.shots, second.shots);
    assert_eq!(a.irradiance, b.irradiance);
    assert_eq!(a.radiosity, b.radiosity);
    assert_silent();
}
