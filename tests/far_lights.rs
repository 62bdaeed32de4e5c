//! Suns, skies and beams in the solver.

mod common;

use std::f64::consts::PI;

use common::Build;
use glam::DVec3;
use mesolux::scene::sky::{Dome, Sky};
use mesolux::scene::{Beam, Lights, PointLight, Sun, Web};
use mesolux::solver::Settings;

fn uniform(radiance: f32) -> Sky {
    Sky {
        up: DVec3::Y,
        north: DVec3::Z,
        scale: [radiance; 3],
        dome: Dome::Uniform,
    }
}

fn settings() -> Settings {
    Settings::default()
}

/// A plane at every tilt θ receives π L (1 + cos θ)/2 of an even sky.
#[test]
fn a_plane_receives_what_it_sees_of_an_even_sky() {
    for degrees in [0.0_f64, 30.0, 60.0, 90.0, 135.0, 180.0] {
        let tilt = degrees.to_radians();
        let mut build = Build::new();
        let black = build.material(0.0, 0.0);
        let y = DVec3::new(0.0, tilt.sin(), tilt.cos());
        let along = build.quad(DVec3::ZERO, y, DVec3::X, (4, 4), black);
        build.scene.lights.sky = Some(uniform(2.0));
        let solved = build.solve(&settings());
        let expected = 2.0 * PI * (1.0 + tilt.cos()) / 2.0;
        let found = solved.mean(&solved.irradiance, along);
        println!("{degrees}: {found} {expected} {:?}", solved.report.seconds.stages);
    }
}
