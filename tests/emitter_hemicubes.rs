//! Strong emitters draw finer hemicubes than all others.

mod common;

use std::ops::Range;

use common::{Build, Solved, assert_silent, device};
use glam::DVec3;
use mesolux::solver::{Estimator, Settings, Solver, StopReason};
use mesolux::sources::Grouping;

/// Pixels a side of the ordinary hemicubes.
const FACE: u32 = 32;
/// The error of the finer faces over that of the ordinary ones, at most. Whether an element is in shadow is wrong along the shadows'
/// edges, over a width that shrinks as the pixels do: four times finer ones leave a quarter of the squares. They leave some
/// hundred wrong elements, a number that scatters by a tenth; three such steps are allowed. √(1.3 / 4)
const SHARPER: f64 = 0.57;

fn settings(emitter_hemicube: Option<u32>) -> Settings {
    Settings {
        hemicube: FACE,
        emitter_hemicube,
        ..Settings::default()
    }
}

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

/// Root mean square of the error of the floor's light, against I cos θ / d² where no plate stands in between.
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
        let [plain, fine] = [Some(FACE), None].map(|emitter_hemicube| {
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

/// A room with a lamp of several sources.
fn room() -> Build {
    let mut build = Build::new();
    let (white, lamp) = (build.material(0.6, 0.0), build.material(0.2, 5.0));
    build.room(DVec3::ZERO, DVec3::ONE, 4, white);
    let corner = DVec3::new(0.3, 0.9, 0.3);
    build.quad(corner, 0.4 * DVec3::X, 0.4 * DVec3::Z, (4, 4), lamp);
    build
}

/// The limit of shots holds in either loop; a bake that is stopped within the first and goes on is the same to the bit.
#[test]
fn stops_and_goes_on_in_either_loop() {
    let build = room();
    let whole = build.solve(&settings(None));
    let fine = whole.report.emitter_hemicubes;
    assert!(
        fine > 16 && fine < whole.report.hemicubes,
        "{fine} finer ones"
    );
    for shots in [3, fine as u32 + 5] {
        let some = Settings {
            shots: Some(shots),
            ..settings(None)
        };
        let report = build.solve(&some).report;
        assert_eq!((report.shots, report.stop), (shots, StopReason::Shots));
    }
    let device = device();
    let elements = mesolux::bake::elements(&device, &build.scene, &settings(None)).expect("plain");
    let mut solver = Solver::new(&device, elements, &[], &settings(None)).expect("it fits");
    solver.run(|_| false).expect("it is stopped");
    let report = solver.report();
    assert_eq!(report.stop, StopReason::Interrupted);
    assert!(u64::from(report.shots) < fine && report.emitter_hemicubes == report.hemicubes);
    solver.run(|_| true).expect("it goes on");
    let report = solver.report();
    assert_eq!(
        (report.emitter_hemicubes, report.stop),
        (fine, StopReason::Residual)
    );
    assert_eq!(report.shots, whole.report.shots);
    let light = solver.light().expect("the light comes back").irradiance;
    assert_eq!(solver.elements.to_input_order(&light), whole.irradiance);
    assert_silent();
}

/// Where everything glows, nothing is strong: there is no second loop, and the result is that of the option switched off.
#[test]
fn weak_emitters_are_drawn_as_all_others() {
    let mut build = Build::new();
    let glowing = build.material(0.5, 0.5);
    build.room(DVec3::ZERO, DVec3::ONE, 6, glowing);
    let [none, off] = [None, Some(FACE)].map(|emitter_hemicube| {
        build.solve(&Settings {
            grouping: Grouping {
                max_area: 1.0 / 2048.0,
                max_area_near: 1.0 / 2048.0,
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
    }
    assert_eq!(none.irradiance, off.irradiance);
    assert_silent();
}

/// A scene whose only hemicubes are those of its lamp is as if all were drawn as finely, whatever the size of the others.
#[test]
fn form_factors_are_those_of_the_finer_size() {
    let (build, _) = plates();
    let fine = build.solve(&settings(None));
    let all = build.solve(&Settings {
        hemicube: 4 * FACE,
        ..settings(Some(4 * FACE))
    });
    assert!(fine.irradiance == all.irradiance);
    assert_silent();
}
