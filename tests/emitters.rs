//! Strong emitters: shadow rays, or finer hemicubes than those of all others.

mod common;

use std::ops::Range;

use common::{Build, Solved, assert_silent, device};
use glam::DVec3;
use mesolux::bake;
use mesolux::mesh::sources::Grouping;
use mesolux::solver::{Estimator, Report, Settings, Solver, StopReason};

/// Pixels a side of the ordinary hemicubes.
const FACE: u32 = 32;
/// The error of the finer faces over that of the ordinary ones, at most. Whether an element is in
/// shadow is wrong along the shadows' edges, over a width that shrinks as the pixels do: four times
/// finer ones leave a quarter of the squares. They leave some hundred wrong elements, a number that
/// scatters by a tenth; three such steps are allowed. √(1.3 / 4)
const SHARPER: f64 = 0.57;

fn settings(emitter_hemicube: Option<u32>) -> Settings {
    Settings {
        hemicube: FACE,
        emitter_hemicube,
        ..Settings::default()
    }
}

/// Form factors are kept in 11 binary digits.
const KEPT: f64 = 1.0 / 2048.0;

/// A point light above a floor, nine square plates between them.
fn plates() -> (Build, Range<usize>) {
    let mut build = Build::new();
    let black = build.material(0.0, 0.0);
    let (x, z) = (DVec3::X, DVec3::Z);
    let floor = build.quad(-x - z - DVec3::Y, z * 2.0, x * 2.0, (96, 96), black);
    for i in 0..9 {
        let middle = PLATES[i % 3] * x + PLATES[i / 3] * z - 0.5 * DVec3::Y;
        let corner = middle - HALF * (x + z);
        build.quad(corner, z * 2.0 * HALF, x * 2.0 * HALF, (1, 1), black);
    }
    build.point_light(DVec3::ZERO, 3.0);
    (build, floor)
}

/// Middles of the plates along x and along z, and half a side of each.
const PLATES: [f64; 3] = [-0.27, 0.01, 0.26];
const HALF: f64 = 0.06;

/// Root mean square of the error of the floor's light, against I cos θ / d² where no plate stands
/// in between.
fn floor_error(build: &Build, floor: &Range<usize>, solved: &Solved) -> f64 {
    let squares = floor.clone().map(|e| {
        let corners = build.scene.corners(&build.scene.triangles[e]);
        let at = corners.into_iter().sum::<DVec3>() / 3.0;
        // Plates hang half-way.
        let under = |a: f64| PLATES.iter().any(|p| (0.5 * a - p).abs() < HALF);
        let exact = match under(at.x) && under(at.z) {
            true => 0.0,
            false => 3.0 / at.length().powi(3),
        };
        (f64::from(solved.irradiance[e].x) - exact).powi(2)
    });
    (squares.sum::<f64>() / floor.len() as f64).sqrt()
}

#[test]
fn finer_faces_sharpen_shadows() {
    let (build, floor) = plates();
    for estimator in [Estimator::Receiver, Estimator::Pixel] {
        // The pixel estimator draws emitters finely unless told otherwise.
        let finer = match estimator {
            Estimator::Receiver => Some(4 * FACE),
            Estimator::Pixel | Estimator::Paper => None,
        };
        let [plain, fine] = [Some(FACE), finer].map(|emitter_hemicube| {
            let solved = build.solve(&Settings {
                estimator,
                ..settings(emitter_hemicube)
            });
            (floor_error(&build, &floor, &solved), solved.report)
        });
        println!("{estimator:?}: error {:.4}, finer {:.4}", plain.0, fine.0);
        assert!(fine.0 <= SHARPER * plain.0);
        assert_eq!(
            (plain.1.emitter_hemicube, plain.1.emitter_hemicubes),
            (FACE, 0)
        );
        // A point light's two halves.
        assert_eq!(
            (fine.1.emitter_hemicube, fine.1.emitter_hemicubes),
            (4 * FACE, 2)
        );
    }
    assert_silent();
}

/// Rays find the shadows' edges: an element is lit if its centroid is.
#[test]
fn rays_tell_light_from_shadow() {
    let (build, floor) = plates();
    let solved = build.solve(&settings(None));
    assert_eq!(
        (solved.report.hemicubes, solved.report.emitters_by_rays),
        (0, 2)
    );
    let mut sides = [0; 2];
    for e in floor.clone() {
        let at = middle(&build, e);
        // How far within the square that a plate shadows, on the floor; plates hang half-way.
        let within = |a: f64| {
            let off = PLATES.iter().map(|p| (a - 2.0 * p).abs());
            2.0 * HALF - off.fold(f64::INFINITY, f64::min)
        };
        let inside = within(at.x).min(within(at.z));
        let lit = 3.0 / at.length().powi(3);
        let got = f64::from(solved.irradiance[e].x);
        if inside.abs() > 1e-5 {
            let exact = if inside > 0.0 { 0.0 } else { lit };
            assert!((got - exact).abs() <= KEPT * lit, "{at}: {got} for {exact}");
            sides[usize::from(inside > 0.0)] += 1;
        }
    }
    assert!(sides.iter().all(|&n| n > 1000), "{sides:?}");
    assert_silent();
}

fn middle(build: &Build, element: usize) -> DVec3 {
    let corners = build.scene.corners(&build.scene.triangles[element]);
    corners.into_iter().sum::<DVec3>() / 3.0
}

/// A plate a thousandth of an element above a floor shadows it, and not itself; nor does the floor
/// shadow what stands on it. Neither winding nor what lies behind the eye or beyond the place
/// matters.
#[test]
fn rays_tell_sheets_a_thin_gap_apart() {
    let mut build = Build::new();
    let black = build.material(0.0, 0.0);
    let (x, z) = (DVec3::X, DVec3::Z);
    let cell = 2.0 / 16.0;
    let floor = build.quad(-x - z, z * 2.0, x * 2.0, (16, 16), black);
    let gap = 1e-3 * cell * DVec3::Y;
    // Over a quarter of the floor; one facing upward, one showing the light its back.
    let plate = build.quad(gap, z, x, (8, 8), black);
    let back = build.quad(gap - x - z, x, z, (8, 8), black);
    // Above the light and below the floor.
    build.quad(-x - z + 2.0 * DVec3::Y, z * 2.0, x * 2.0, (1, 1), black);
    build.quad(-x - z - DVec3::Y, z * 2.0, x * 2.0, (1, 1), black);
    build.point_light(DVec3::Y, 3.0);
    let solved = build.solve(&settings(None));
    let light = |e: usize| f64::from(solved.irradiance[e].x);
    for e in floor {
        let at = middle(&build, e);
        let exact = match at.x * at.z > 0.0 {
            true => 0.0,
            false => 3.0 / (at - DVec3::Y).length().powi(3),
        };
        assert!(
            (light(e) - exact).abs() <= KEPT * exact,
            "{at}: {} for {exact}",
            light(e)
        );
    }
    assert!(plate.clone().all(|e| light(e) > 0.5));
    assert!(back.clone().all(|e| light(e) == 0.0));
    assert_silent();
}

/// A room with a lamp of several sources.
fn room() -> Build {
    let mut build = Build::new();
    let (white, lamp) = (build.material(0.6, 0.0), build.material(0.2, 5.0));
    build.room(DVec3::ZERO, DVec3::ONE, 4, white);
    let corner = DVec3::new(0.3, 0.9, 0.3);
    build.quad(corner, 0.4 * DVec3::X, 0.4 * DVec3::Z, (4, 4), lamp);
    build
}

/// The limit of shots holds in either loop; a bake that is stopped within the first and goes on is
/// the same to the bit.
#[test]
fn stops_and_goes_on_in_either_loop() {
    let build = room();
    // By rays, and by hemicubes.
    for emitters in [None, Some(4 * FACE)] {
        let settings = Settings {
            grouping: Grouping {
                max_power: 1.0 / 128.0,
                ..Grouping::default()
            },
            ..settings(emitters)
        };
        let of_emitters = |report: &Report| report.emitter_hemicubes + report.emitters_by_rays;
        let whole = build.solve(&settings);
        let fine = of_emitters(&whole.report);
        assert!(
            fine > 16 && fine < whole.report.hemicubes,
            "{fine} finer ones"
        );
        assert_eq!(whole.report.emitters_by_rays > 0, emitters.is_none());
        for shots in [3, fine as u32 + 5] {
            let some = Settings {
                shots: Some(shots),
                ..settings.clone()
            };
            let report = build.solve(&some).report;
            assert_eq!((report.shots, report.stop), (shots, StopReason::Shots));
        }
        let device = device();
        let elements = mesolux::bake::elements(&device, &build.scene, &settings).expect("plain");
        let mut solver = Solver::new(&device, elements, &mesolux::scene::Lights::NONE, &settings)
            .expect("it fits");
        solver.run(|_| false).expect("it is stopped");
        let report = solver.report();
        assert_eq!(report.stop, StopReason::Interrupted);
        assert!(u64::from(report.shots) < fine && of_emitters(report) == u64::from(report.shots));
        solver.run(|_| true).expect("it goes on");
        let report = solver.report();
        assert_eq!(
            (of_emitters(report), report.stop),
            (fine, StopReason::Residual)
        );
        assert_eq!(report.shots, whole.report.shots);
        let light = solver.light().expect("the light comes back").irradiance;
        let light = solver.problem.elements.to_input_order(&light);
        // The sums have another order.
        let apart = light
            .iter()
            .zip(&whole.irradiance)
            .map(|(a, b)| (a - b).abs().max_element());
        let largest = light.iter().map(|e| e.max_element()).fold(0.0, f32::max);
        assert!(apart.fold(0.0, f32::max) <= 1e-5 * largest);
    }
    assert_silent();
}

/// Where everything glows, nothing is strong: there is no second loop, and the result is that of
/// the option switched off.
#[test]
fn weak_emitters_are_drawn_as_all_others() {
    let mut build = Build::new();
    let glowing = build.material(0.5, 0.5);
    build.room(DVec3::ZERO, DVec3::ONE, 6, glowing);
    let [none, off] = [None, Some(FACE)].map(|emitter_hemicube| {
        build.solve(&Settings {
            grouping: Grouping {
                max_area: 1.0 / 2048.0,
                ..Grouping::default()
            },
            ..settings(emitter_hemicube)
        })
    });
    for report in [&none.report, &off.report] {
        assert_eq!(
            (report.emitter_hemicube, report.emitter_hemicubes),
            (FACE, 0)
        );
        assert_eq!(report.emitters_by_rays, 0);
    }
    assert_eq!(none.irradiance, off.irradiance);
    assert_silent();
}

/// A scene whose only hemicubes are those of its lamp is as if all were drawn as finely, whatever
/// the size of the others.
#[test]
fn form_factors_are_those_of_the_finer_size() {
    let (build, _) = plates();
    let fine = build.solve(&settings(Some(4 * FACE)));
    let all = build.solve(&Settings {
        hemicube: 4 * FACE,
        ..settings(Some(4 * FACE))
    });
    assert!(fine.irradiance == all.irradiance);
    assert_silent();
}

/// The widest image holds fewer slots of faces so large than a batch of other sources has.
#[test]
fn emitters_may_have_fewer_slots_than_others() {
    let mut build = Build::new();
    let (wall, lamp) = (build.material(0.5, 0.0), build.material(0.2, 3.0));
    let sides = build.room(DVec3::ZERO, DVec3::ONE, 3, wall);
    build.paint(sides[1].clone(), lamp);
    let light = |batch: u32| {
        let settings = Settings {
            batch,
            residual: 1e-7,
            grouping: Grouping {
                max_area: 1.0 / 60.0,
                max_power: 0.1,
                ..Grouping::default()
            },
            ..settings(Some(2048))
        };
        let solved = build.solve(&settings);
        let sources = solved.report.emitter_hemicubes;
        assert!((9..32).contains(&sources), "{sources} emitters");
        solved.irradiance
    };
    let (many, few) = (light(16), light(3));
    let apart = many.iter().zip(&few).map(|(a, b)| a.distance(*b));
    let mean = few.iter().map(|e| e.length()).sum::<f32>() / few.len() as f32;
    let apart = apart.fold(0.0, f32::max) / mean;
    println!("batches of 16 and of 3: {apart:.1e} apart");
    assert!(apart <= 1e-6);
}

/// Common sources keep the places from which rays ask whether a silhouette cuts them, strong
/// emitters all. One that becomes strong as the light changes has all from then on.
#[test]
fn sources_keep_the_places_that_are_asked() {
    let mut scene = Build::room_with_ball(false).0.scene;
    let settings = Settings {
        shots: Some(4),
        ..Settings::default()
    };
    let lamp = scene.materials.len() - 1;
    let mut solver =
        bake::solve(&device(), &scene, &settings, None, |_| true).expect("it is solved");
    let check = |solver: &Solver, strong: &[usize]| {
        let elements = &solver.problem.elements;
        let (mut all, mut some) = (0, 0);
        for source in solver
            .problem
            .sources
            .list
            .iter()
            .filter(|s| s.is_surface())
        {
            let material = elements.material[source.first_element as usize] as usize;
            if strong.contains(&material) {
                assert_eq!(source.places.len(), settings.emitter_places as usize);
                all += 1;
            } else {
                assert!(
                    [settings.places, settings.emitter_places]
                        .contains(&(source.places.len() as u32))
                );
                some += u32::from(source.places.len() as u32 == settings.places);
            }
        }
        println!("{all} strong emitters, {some} common sources");
        assert!(all > 0 && some > 0);
    };
    check(&solver, &[lamp]);
    let ball = lamp - 1;
    scene.materials[ball].ke = [9.0; 3];
    solver.relight(&scene).expect("it is lit again");
    check(&solver, &[ball]);
    solver.run(|_| true).expect("it is solved");
    assert_silent();
}
