//! What a relief does to light: its visibility on the device against the CPU twin, effective
//! albedos against closed forms.

mod common;

use std::sync::Arc;

use common::{assert_silent, device};
use glam::{DVec2, DVec3, Vec3};
use mesolux::constants::{AZIMUTHS, RAY_STRATA};
use mesolux::math::directions::Directions;
use mesolux::meso::{HeightField, Response};
use mesolux::passes::relief_visibility::ReliefVisibility;
use mesolux::reference::relief_visibility::{exchange, horizon};
use mesolux::scene::{HeightMap, Material};

/// A tile, one unit wide and high, of heights given over 0..1 × 0..1.
fn field(size: u32, height: impl Fn(f64, f64) -> f64) -> HeightField {
    let centre = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    let values = (0..size)
        .flat_map(|row| (0..size).map(move |column| (column, size - 1 - row)))
        .map(|(i, j)| height(centre(i), centre(j)) as f32)
        .collect();
    let material = Material {
        map_height: Some(Arc::new(HeightMap {
            path: "test".into(),
            width: size,
            height: size,
            values,
        })),
        ..Material::default()
    };
    HeightField::new(&material, DVec2::ONE).expect("it is not flat")
}

fn bumps(x: f64, y: f64) -> f64 {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.06 * wave(x) * wave(2.0 * y) + 0.03 * wave(3.0 * x + y)
}

fn normals(field: &HeightField) -> Vec<DVec3> {
    (0..field.facet_count())
        .map(|q| field.facet(q).normal)
        .collect()
}

#[test]
fn visibility_is_its_twins() {
    let device = device();
    let field = field(24, bumps);
    let found = ReliefVisibility::new(&device)
        .and_then(|pass| pass.run(&field))
        .expect("the device marches");
    // Slopes are of the order of 1; rounding of positions up to 100 cells leaves 1e-5 of a cell.
    const SLOPE_TOLERANCE: f64 = 1e-4;
    let mut other_hits = 0;
    let rays = RAY_STRATA * RAY_STRATA;
    for q in 0..field.facet_count() {
        for a in 0..AZIMUTHS {
            let gpu = f64::from(found.horizons[q * AZIMUTHS as usize + a as usize]);
            let cpu = horizon(&field, q, a);
            assert!(
                (gpu - cpu).abs() < SLOPE_TOLERANCE * (1.0 + cpu.abs()),
                "{q} {a}: {gpu} {cpu}"
            );
        }
        for r in 0..rays {
            let gpu = found.hits[q * rays as usize + r as usize];
            other_hits += u32::from(gpu != exchange(&field, q, r));
        }
    }
    // A ray through an edge may land on either side of it.
    let share = f64::from(other_hits) / (field.facet_count() as f64 * f64::from(rays));
    println!("rays that land elsewhere: {share:.2e}");
    assert!(share < 1e-3);
    assert_silent();
}

/// A spherical cap below a plane: albedo of its opening is ρF / (1 − ρ(1 − F)), F = opening / cap,
/// at every angle.
#[test]
fn spherical_dimples() {
    let device = device();
    const RADIUS: f64 = 0.46;
    for share in [0.5_f64, 0.75] {
        // F = 1 − h / 2R and a² = 2Rh − h² for a cap of depth h and opening radius a of a sphere of
        // radius R.
        let depth = 2.0 * (1.0 - share);
        let sphere = RADIUS / (2.0 * depth - depth * depth).sqrt();
        let field = field(128, |x, y| {
            let r = (x - 0.5).hypot(y - 0.5);
            if r >= RADIUS {
                0.0
            } else {
                sphere * (1.0 - depth) - (sphere * sphere - r * r).sqrt()
            }
        });
        let visibility = ReliefVisibility::new(&device)
            .and_then(|pass| pass.run(&field))
            .expect("the device marches");
        let opening = std::f64::consts::PI * RADIUS * RADIUS;
        for rho in [0.5, 0.8] {
            let exact = rho * share / (1.0 - rho * (1.0 - share));
            for slots in [16, 32, 64] {
                let directions = Directions::new(slots).expect("a number of the paper");
                let response = Response::physical(
                    &directions,
                    &field,
                    &visibility,
                    &normals(&field),
                    &vec![Vec3::splat(rho as f32); field.facet_count()],
                );
                let albedo: Vec<f64> = [0.0_f64, 45.0, 75.0]
                    .iter()
                    .map(|degrees| {
                        let angle = degrees.to_radians();
                        let turns = 36;
                        // All azimuths: a square grid has no reason to prefer one.
                        (0..turns)
                            .map(|i| {
                                let (s, c) = (std::f64::consts::TAU * f64::from(i)
                                    / f64::from(turns))
                                .sin_cos();
                                let from =
                                    DVec3::new(angle.sin() * c, angle.sin() * s, angle.cos());
                                let tile = f64::from(response.directional_albedo(from).x);
                                (tile - (1.0 - opening) * rho) / opening
                            })
                            .sum::<f64>()
                            / f64::from(turns)
                    })
                    .collect();
                let worst = albedo
                    .iter()
                    .map(|a| (a / exact - 1.0).abs())
                    .fold(0.0, f64::max);
                let highest = albedo.iter().copied().fold(f64::MIN, f64::max);
                let lowest = albedo.iter().copied().fold(f64::MAX, f64::min);
                let spread = (highest - lowest) / exact;
                println!(
                    "F {share} rho {rho} K {slots}: exact {exact:.4}, 0/45/75 deg {albedo:.4?}: error {:.2} %, spread {:.2} %",
                    100.0 * worst,
                    100.0 * spread
                );
                // Measured: 0.28 and 0.19 %.
                assert!(worst <= 0.006 && spread <= 0.004);
            }
        }
    }
    assert_silent();
}
