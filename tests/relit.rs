//! Changed lights step by step: what they emit, what coupling makes of it, all of it.

mod common;

use common::{Build, assert_silent, device};
use glam::{DVec3, Vec3};
use mesolux::bake;
use mesolux::solver::{Light, Settings, Solver, StopReason, Update};

/// Largest difference over the mean of what it is of, RGB.
fn apart(a: &[Vec3], b: &[Vec3]) -> f64 {
    let mean = b.iter().map(|e| e.as_dvec3().length()).sum::<f64>() / b.len() as f64;
    let each = a.iter().zip(b).map(|(a, b)| f64::from(a.distance(*b)));
    each.fold(0.0, f64::max) / mean
}

fn light(solver: &Solver) -> Light {
    solver.light().expect("the light comes back")
}

/// Direct light is the same but for rounding. Coupling alone leaves out what is solved later: light
/// by direction, and the parts of near sources.
#[test]
fn emitted_light_comes_first_then_what_coupling_makes_of_it() {
    for (relief, coupling) in [(false, COUPLED), (true, COUPLED_RELIEF)] {
        let before = Build::room_with_ball(relief).0.scene;
        let settings = Settings::default();
        let mut solver =
            bake::solve(&device(), &before, &settings, None, |_| true).expect("it is solved");
        let mut scene = before;
        scene.lights.points.clear();
        let mut build = Build::of(scene);
        build.point_light(DVec3::new(0.8, 0.3, 0.2), 0.5);
        let lamp = build.scene.materials.len() - 1;
        build.scene.materials[lamp].ke = [0.5, 4.0, 1.0];
        solver.relight(&build.scene).expect("it is lit again");

        solver.gather_emitted().expect("emitted light arrives");
        let emitted = light(&solver);
        assert_eq!(emitted.irradiance, emitted.irradiance_direct);
        // The two halves of the point light.
        assert_eq!(solver.report().shots, 2);
        // Stopped on the way, and gone on with.
        for goes_on in [false, true] {
            let brought = solver.gather_coupled(|| goes_on);
            assert_eq!(brought.expect("reflected light arrives"), goes_on);
        }
        let coupled = light(&solver);
        let mut looks = 0;
        let not_drawing = |update: &Update| {
            looks += u32::from(!update.draws);
            update.draws
        };
        solver.run(not_drawing).expect("it is stopped");
        assert_eq!(solver.report().stop, StopReason::Interrupted);
        solver.run(|_| true).expect("it is solved");
        assert_eq!((looks, solver.report().stop), (1, StopReason::Residual));
        let all = light(&solver);

        let direct = apart(&emitted.irradiance, &all.irradiance_direct);
        let whole = apart(&coupled.irradiance, &all.irradiance);
        println!("relief {relief}: direct light {direct:.1e}, all of it {whole:.1e} apart");
        assert!(direct <= DIRECT && whole <= 2.0 * coupling);
        // Reflected light is no small part.
        assert!(apart(&emitted.irradiance, &all.irradiance) > 5.0 * coupling);
    }
    assert_silent();
}

/// Measured: none.
const DIRECT: f64 = 1e-6;

/// Measured.
const COUPLED: f64 = 1e-3;
const COUPLED_RELIEF: f64 = 1.7e-2;
