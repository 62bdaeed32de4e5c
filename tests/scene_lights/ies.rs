//! Luminaires of IES files against closed forms.

use std::f64::consts::PI;
use std::fs;

use glam::DVec3;
use mesolux::scene::ies::Luminaire;
use mesolux::scene::{Beam, PointLight};
use tempfile::TempDir;

use super::{good_with, near};

/// From the first to the last by steps.
fn angles(first: f64, last: f64, step: f64) -> Vec<f64> {
    let count = ((last - first) / step).round() as usize;
    (0..=count).map(|i| first + step * i as f64).collect()
}

/// A file of a type (1 is C) with intensities by vertical and horizontal angle, degrees.
pub fn file(
    kind: u32,
    verticals: &[f64],
    horizontals: &[f64],
    candela: impl Fn(f64, f64) -> f64,
) -> String {
    let words = |numbers: &[f64]| {
        let words: Vec<_> = numbers.iter().map(|n| format!("{n:.6}")).collect();
        words.join(" ")
    };
    let mut text = format!(
        "IESNA:LM-63-2002\n[TEST] closed form\n[MANUFAC] none\nTILT=NONE\n1 -1 1 {} {} {kind} 2 0 0 \
         0\n1 1 0\n{}\n{}\n",
        verticals.len(),
        horizontals.len(),
        words(verticals),
        words(horizontals),
    );
    for &h in horizontals {
        let column: Vec<f64> = verticals.iter().map(|&v| candela(v, h)).collect();
        text += &format!("{}\n", words(&column));
    }
    text
}

fn read(text: &str) -> Luminaire {
    let dir = TempDir::new().unwrap();
    let path = dir.path().join("a.ies");
    fs::write(&path, text).unwrap();
    Luminaire::read(&path).unwrap()
}

fn rad(degrees: f64) -> f64 {
    degrees.to_radians()
}

/// Measured: 8.1e-4 at most, of a beam 8° wide that is measured at each degree.
const LUMENS: f64 = 1.6e-3;

#[test]
fn lumens_of_powers_of_the_cosine() {
    let mut worst = 0.0_f64;
    for (power, step) in [
        (1, 5.0),
        (1, 10.0),
        (3, 5.0),
        (10, 5.0),
        (40, 2.5),
        (300, 1.0),
    ] {
        let of = |v: f64, _: f64| 1000.0 * rad(v).cos().max(0.0).powi(power);
        let found = read(&file(1, &angles(0.0, 90.0, step), &[0.0], of));
        assert_eq!(found.web.columns, 1);
        let exact = 2.0 * PI * 1000.0 / f64::from(power + 1);
        let error = found.lumens() / exact - 1.0;
        println!("cos^{power} by {step}°: {error:.2e}");
        worst = worst.max(error.abs());
        assert!((found.candela - 1000.0).abs() < 1e-6);
    }
    assert!(worst < LUMENS, "{worst}");
    let all = read(&file(1, &angles(0.0, 180.0, 15.0), &[0.0], |_, _| 50.0));
    near(all.lumens(), 200.0 * PI, 1e-6);
}

#[test]
fn lumens_and_shares_of_every_symmetry() {
    type Form = fn(f64) -> f64;
    let cases: [(&[f64], Form); 5] = [
        (&[0.0, 22.5, 45.0, 67.5, 90.0], |p| {
            1.0 + 0.3 * (2.0 * p).cos()
        }),
        (&[0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0], |p| {
            1.0 + 0.5 * p.cos()
        }),
        (&[90.0, 120.0, 150.0, 180.0, 210.0, 240.0, 270.0], |p| {
            1.0 + 0.4 * p.sin()
        }),
        (
            &[
                0.0, 30.0, 60.0, 90.0, 120.0, 150.0, 180.0, 210.0, 240.0, 270.0, 300.0, 330.0,
                360.0,
            ],
            |p| 1.0 + 0.3 * p.cos() + 0.2 * p.sin(),
        ),
        (&[0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0], |p| {
            1.0 + 0.3 * p.cos() + 0.2 * p.sin()
        }),
    ];
    let (mut worst_lumens, mut worst_share) = (0.0_f64, 0.0_f64);
    for (horizontals, form) in cases {
        let of = |v: f64, h: f64| 100.0 * rad(v).cos().max(0.0) * form(rad(h));
        let found = read(&file(1, &angles(0.0, 90.0, 5.0), horizontals, of));
        worst_lumens = worst_lumens.max((found.lumens() / (100.0 * PI) - 1.0).abs());
        for v in [3.0, 17.0, 44.0, 71.0_f64] {
            for h in 0..73 {
                let phi = rad(5.0 * f64::from(h));
                let share = found.candela * found.web.share(rad(v), phi);
                let error = share / (100.0 * rad(v).cos() * form(phi)) - 1.0;
                worst_share = worst_share.max(error.abs());
            }
        }
    }
    println!("lumens {worst_lumens:.1e}, intensities {worst_share:.1e}");
    // Measured: 1.7e-5.
    assert!(worst_lumens < 3.4e-5, "{worst_lumens}");
    // Measured: 2.5e-2, of the curve between angles 45° apart.
    assert!(worst_share < 5e-2, "{worst_share}");
}

/// z³ (1 + 0.3 x + 0.2 y): right, up and along the axis; π/2 lumens.
fn lopsided(d: DVec3) -> f64 {
    d.z.max(0.0).powi(3) * (1.0 + 0.3 * d.x + 0.2 * d.y)
}

#[test]
fn types_b_and_a_are_turned_into_c() {
    let grid = angles(-90.0, 90.0, 5.0);
    let of_b = |v: f64, h: f64| {
        let ((sv, cv), (sh, ch)) = (rad(v).sin_cos(), rad(h).sin_cos());
        lopsided(DVec3::new(sh, ch * sv, ch * cv))
    };
    let of_a = |v: f64, h: f64| {
        let ((sv, cv), (sh, ch)) = (rad(v).sin_cos(), rad(h).sin_cos());
        lopsided(DVec3::new(cv * sh, sv, cv * ch))
    };
    for text in [file(2, &grid, &grid, of_b), file(3, &grid, &grid, of_a)] {
        let found = read(&text);
        // Measured: 4.0e-5 at most.
        near(found.lumens(), PI / 2.0, 8e-5);
        for (x, y, z) in [
            (0.1, 0.2, 0.9),
            (-0.5, 0.3, 0.6),
            (0.3, -0.7, 0.7),
            (0.0, 0.0, 1.0),
        ] {
            let d = DVec3::new(x, y, z).normalize();
            // φ is 0 to the right and −90° up.
            let phi = f64::atan2(-d.y, d.x).rem_euclid(2.0 * PI);
            let share = found.candela * found.web.share(d.z.acos(), phi);
            // Measured: 4.2e-4 at most.
            assert!(
                (share - lopsided(d)).abs() < 9e-4,
                "{share} {}",
                lopsided(d)
            );
        }
    }
    // Half of a symmetric one.
    let half = angles(0.0, 90.0, 5.0);
    let even = |v: f64, h: f64| (rad(h).cos() * rad(v).cos()).max(0.0).powi(3);
    near(
        read(&file(2, &grid, &half, even)).lumens(),
        PI / 2.0,
        1.3e-4,
    );
}

#[test]
fn factors_multiply_and_tilts_are_a_warning() {
    let text = file(1, &angles(0.0, 90.0, 5.0), &[0.0], |v, _| rad(v).cos());
    let plain = read(&text);
    let of = |from: &str, to: &str| {
        assert!(text.contains(from));
        read(&text.replacen(from, to, 1))
    };
    near(
        of("1 -1 1 19", "2 900 2.5 19").candela,
        2.5 * plain.candela,
        1e-9,
    );
    near(
        of("\n1 1 0\n", "\n0.5 1 60\n").candela,
        0.5 * plain.candela,
        1e-9,
    );
    // The second factor counted until 1991 and means something else today.
    near(of("\n1 1 0\n", "\n1 0.5 60\n").candela, plain.candela, 1e-9);
    let old = text.replacen("\n1 1 0\n", "\n1 0.5 60\n", 1);
    for (version, factor) in [("IESNA91\n", 0.5), ("", 0.5), ("IES:LM-63-2019\n", 1.0)] {
        let found = read(&old.replacen("IESNA:LM-63-2002\n", version, 1));
        near(found.candela, factor * plain.candela, 1e-9);
    }
    let tilted = of("TILT=NONE\n", "TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9\n0.8\n");
    assert_eq!(tilted.web, plain.web);
    assert!(tilted.warnings[0].contains("tilt"));
    let windows = text.replace('\n', "\r\n").replace(' ', ",") + "\u{1a}";
    let windows = windows.replacen("[TEST],closed", "[TEST] closed \u{fc}", 1);
    assert_eq!(read(&windows), plain);
}

#[test]
fn a_luminaire_hangs_and_is_turned() {
    let of = |v: f64, h: f64| 100.0 * rad(v).cos().max(0.0) * (1.0 + 0.5 * rad(h).cos());
    let text = file(1, &angles(0.0, 90.0, 5.0), &angles(0.0, 360.0, 30.0), of);
    let light = |keys: &str| -> PointLight {
        let table = format!("[[point_light]]\nposition = [0, 2, 0]\nies = 'a.ies'\n{keys}");
        good_with(&[("a.ies", &text)], &table)
            .lights
            .points
            .remove(0)
    };
    let hanging = light("");
    near(f64::from(hanging.intensity[0]), 150.0 / 683.0, 1e-3);
    // Down, with φ = 0 along x: more light towards +x than towards −x.
    let axis = |light: &PointLight| {
        light
            .beam
            .as_ref()
            .map(|beam| (beam.axis, beam.zero))
            .unwrap()
    };
    assert_eq!(axis(&hanging), (-DVec3::Y, DVec3::X));
    let (left, right) = (DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, -1.0, 0.0));
    near(hanging.share(right) / hanging.share(left), 3.0, 0.01);
    assert_eq!(hanging.share(DVec3::Y), 0.0);
    // By 90° towards axis × zero, −y × x = z.
    let turned = light("rotation = 90");
    assert!(axis(&turned).1.distance(DVec3::Z) < 1e-12);
    let aside = light("towards = [5, 2, 0]\nzero = [0, 1, 0]\nlumens = 683");
    assert_eq!(axis(&aside), (DVec3::X, DVec3::Y));
    let power = aside.solid_angle() * f64::from(aside.intensity[1]);
    near(power, 1.0, 1e-6);
    let Some(Beam { web, .. }) = aside.beam else {
        panic!("no beam")
    };
    assert_eq!(web.columns, 181);
}
