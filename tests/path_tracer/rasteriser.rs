//! Against the rasteriser's view of a scene.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec3, Vec3};
use mesolux::render::{Light, render};
use mesolux::scene::{Camera, Texture};

use crate::common::{Build, assert_silent, device};
use crate::{FAR, ROUNDING, camera, draw, settings, view};

/// Emitters of three colours and a back, none symmetric, seen from 10⁶ units off the origin by an
/// eye outside of them and by one with an oblique up: what the rasteriser shows, but for the edges,
/// where both have samples of their own.
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
        let raster = render(&device(), &build.scene, &dark, &view).expect("a picture");
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
        assert_silent();
    }
}

/// A texture of four colours, upright and mirrored as the rasteriser has it, under light from so
/// far that it is even.
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
    let raster = render(&device(), &build.scene, &lit, &view).expect("a picture");
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
    assert_silent();
}
