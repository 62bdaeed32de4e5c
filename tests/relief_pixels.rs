//! The pixel estimator on surfaces with relief against closed forms and against the other
//! estimator.

mod common;

use common::{Build, Solved};
use glam::{DVec3, Vec3};
use mesolux::math::directions::Directions;
use mesolux::meso::{Options, Transport};
use mesolux::solver::{Estimator, Settings};

fn settings(estimator: Estimator, transport: Transport) -> Settings {
    Settings {
        estimator,
        residual: 1e-3,
        relief: Options {
            transport,
            directions: Directions::new(32).expect("a number of the paper"),
            cache: None,
        },
        ..Settings::default()
    }
}

fn bumps(x: f64, y: f64) -> f64 {
    let wave = |a: f64| (std::f64::consts::TAU * a).sin();
    0.05 * wave(x) * wave(2.0 * y) + 0.025 * wave(3.0 * x + y)
}

/// Root mean square difference of two lists as a share of the mean of the second, and their bias.
fn compare(found: &[Vec3], expected: &[Vec3]) -> (f64, f64) {
    let (mut squares, mut bias, mut sum) = (0.0, 0.0, 0.0);
    for (a, b) in found.iter().zip(expected) {
        let apart = (a.as_dvec3() - b.as_dvec3()).element_sum();
        squares += apart * apart;
        bias += apart;
        sum += b.as_dvec3().element_sum();
    }
    let n = found.len() as f64;
    ((squares / n).sqrt() / (sum / n), bias / sum)
}

/// A plate under a point light: I cos θ / r² arrives, and each element sends what it sends by the
/// other estimator, with the same light in the same slots. With `paper` the pixels' normals and
/// albedos stand for those of the footprint.
#[test]
fn a_plate_under_a_point_light() {
    let mut build = Build::new();
    let plate = build.material(0.7, 0.0);
    build.scene.materials[plate as usize].kd = [0.9, 0.6, 0.2];
    build.relief(plate, 16, bumps);
    let all = build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (4, 4), plate);
    build.uv(all.clone(), DVec3::X, DVec3::Y);
    let lamp = DVec3::new(0.45, 0.4, 0.9);
    build.point_light(lamp, 1.0);
    // An element of 1/32 at a distance of 0.9 is seen by some 157 pixels of 128² a face, of which
    // some 54 lie on its rim and may be in or out: 54^½ / 2 of 157 are 2.3 %, and twice that where
    // a seam of two faces crosses the plate.
    const PIXELS: f64 = 0.05;
    for transport in [Transport::Physical, Transport::Paper] {
        let [receiver, pixel] = [Estimator::Receiver, Estimator::Pixel]
            .map(|estimator| build.solve(&settings(estimator, transport)));
        let exact: Vec<Vec3> = build.scene.triangles[all.clone()]
            .iter()
            .map(|t| {
                let [a, b, c] = t.vertices.map(|v| build.scene.vertices[v as usize]);
                // Over the middles of 64 equal parts.
                let parts = 8;
                let mut sum = 0.0;
                for i in 0..parts {
                    for j in 0..parts - i {
                        for third in [1.0 / 3.0, 2.0 / 3.0] {
                            if third > 0.5 && i + j + 1 == parts {
                                continue;
                            }
                            let at = |i: i32| (f64::from(i) + third) / f64::from(parts);
                            let d = lamp - (a + (b - a) * at(i) + (c - a) * at(j));
                            sum += d.z / d.length().powi(3);
                        }
                    }
                }
                Vec3::splat((sum / f64::from(parts * parts)) as f32)
            })
            .collect();
        let (rms, bias) = compare(&pixel.irradiance[all.clone()], &exact);
        let relief = |solved: &Solved| solved.relief.as_ref().expect("it has one").exitant.clone();
        let (sent_rms, sent_bias) = compare(&relief(&pixel), &relief(&receiver));
        println!(
            "{transport:?}: irradiance rms {:.2} %, bias {:+.3} %; sent by element and slot, against receivers: rms {:.2} %, bias {:+.2} %",
            100.0 * rms,
            100.0 * bias,
            100.0 * sent_rms,
            100.0 * sent_bias
        );
        assert!(rms <= PIXELS && bias.abs() <= 0.01);
        assert!(sent_rms <= PIXELS && sent_bias.abs() <= 0.01);
    }
}
