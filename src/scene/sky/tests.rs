use super::*;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

fn sky(dome: Dome) -> Sky {
    Sky {
        up: DVec3::Y,
        north: -DVec3::Z,
        scale: [1.0; 3],
        dome,
    }
}

fn sun(height: f64) -> DVec3 {
    sky(Dome::Uniform).direction(SunAngles {
        height,
        azimuth: 125.0,
    })
}

/// The horizontal irradiance in other coordinates: polar ones about the sun, in which its peak is
/// smooth.
fn about_the_sun(gradation: &Gradation) -> f64 {
    let sun = gradation.sun();
    let x = sun.any_orthonormal_vector();
    let y = sun.cross(x);
    let (across, around) = (1000, 500);
    let mut sum = 0.0;
    for i in 0..across {
        let chi = PI * (f64::from(i) + 0.5) / f64::from(across);
        let (sin, cos) = chi.sin_cos();
        for j in 0..around {
            let (s, c) = (TAU * (f64::from(j) + 0.5) / f64::from(around)).sin_cos();
            let towards = cos * sun + sin * (c * x + s * y);
            if towards.y > 0.0 {
                sum += gradation.relative(towards.y, towards) * towards.y * sin;
            }
        }
    }
    sum * PI * TAU / (f64::from(across) * f64::from(around))
}

#[test]
fn all_skies_are_normalised() {
    let mut worst = 0.0_f64;
    for number in 1..=15 {
        for height in [3.0, 20.0, 60.0, 90.0] {
            let gradation = Gradation::cie(number, DVec3::Y, sun(height)).unwrap();
            let found = sky(Dome::Gradation(gradation.clone())).horizontal()[0];
            worst = worst.max((found / about_the_sun(&gradation) - 1.0).abs());
        }
    }
    for (direct_normal, diffuse_horizontal) in [(0.0, 200.0), (150.0, 250.0), (900.0, 80.0)] {
        for sun_height in [8.0, 45.0, 80.0] {
            let measured = Perez {
                direct_normal,
                diffuse_horizontal,
                sun_height,
            };
            let coefficients = measured.coefficients();
            let gradation =
                Gradation::new(Form::Perez, coefficients, DVec3::Y, sun(sun_height)).unwrap();
            let found = sky(Dome::Gradation(gradation.clone())).horizontal()[0];
            worst = worst.max((found / about_the_sun(&gradation) - 1.0).abs());
        }
    }
    println!("normalisation of skies: {worst:.1e}");
    // Measured: 5.9e-5.
    assert!(worst < 1.2e-4, "{worst}");
}

#[test]
fn skies_have_their_known_values() {
    // A sky without gradation or indicatrix is uniform; the traditional one has 7π/9.
    let uniform = sky(Dome::Gradation(
        Gradation::cie(5, DVec3::Y, sun(30.0)).unwrap(),
    ));
    assert!((uniform.horizontal()[0] - PI).abs() < 1e-12);
    let overcast = sky(Dome::TraditionalOvercast);
    assert!((overcast.radiance(DVec3::Y).x - 1.0).abs() < 1e-12);
    assert!((overcast.radiance(DVec3::X).x - 1.0 / 3.0).abs() < 1e-12);
    // Type 1 is near the traditional overcast sky: a third at the horizon, 1 + 4 exp(−0.7) at the
    // zenith over 1.
    let steep = sky(Dome::Gradation(
        Gradation::cie(1, DVec3::Y, sun(30.0)).unwrap(),
    ));
    let horizon = steep.radiance(DVec3::X).x;
    assert!((horizon - 1.0 / (1.0 + 4.0 * (-0.7_f64).exp())).abs() < 1e-12);
    assert_eq!(steep.radiance(-DVec3::Y), DVec3::ZERO);
    // The clear sky at the sun, sun at 60°: f(0) φ(30°) / (f(30°) φ(0)).
    let clear = sky(Dome::Gradation(
        Gradation::cie(12, DVec3::Y, sun(60.0)).unwrap(),
    ));
    let f = |chi: f64| {
        1.0 + 10.0 * ((-3.0 * chi).exp() - (-3.0 * FRAC_PI_2).exp()) + 0.45 * chi.cos().powi(2)
    };
    let phi = |z: f64| 1.0 - (-0.32 / z.cos()).exp();
    let z = 30_f64.to_radians();
    let exact = f(0.0) * phi(z) / (f(z) * phi(0.0));
    assert!((clear.radiance(sun(60.0)).x / exact - 1.0).abs() < 1e-9);
}

#[test]
fn perez_is_usable_for_every_weather() {
    let mut found = 0;
    for direct_normal in [0.0, 5.0, 50.0, 200.0, 500.0, 900.0, 1100.0] {
        for diffuse_horizontal in [1.0, 10.0, 50.0, 120.0, 300.0, 600.0] {
            for sun_height in [0.5, 3.0, 10.0, 30.0, 60.0, 90.0] {
                let measured = Perez {
                    direct_normal,
                    diffuse_horizontal,
                    sun_height,
                };
                let c = measured.coefficients();
                let gradation = Gradation::new(Form::Perez, c, DVec3::Y, sun(sun_height)).unwrap();
                gradation.check().unwrap();
                let sum = sky(Dome::Gradation(gradation)).horizontal()[0];
                assert!(sum.is_finite(), "{measured:?}: {sum}");
                if sum > 0.0 {
                    found += 1;
                } else {
                    println!("black: {measured:?} {c:?}");
                }
            }
        }
    }
    // Some weathers that do not exist are black: a bright sun in a sky of 1 W/m².
    println!("{found} of 252 skies have light");
    assert!(found > 240, "{found}");
}

#[test]
fn perez_of_an_overcast_day_is_that_of_the_paper() {
    // ε = 1 and its class; Δ at the zenith is nearly the ratio of the irradiances.
    let measured = Perez {
        direct_normal: 0.0,
        diffuse_horizontal: 136.7,
        sun_height: 90.0,
    };
    assert_eq!(measured.clearness(), 1.0);
    assert!((measured.brightness() - 0.1).abs() < 1e-4);
    let [a, b, ..] = measured.coefficients();
    assert!((a - (1.3525 - 0.0269)).abs() < 1e-4);
    assert!((b - (-0.7670 + 0.12734)).abs() < 1e-4);
}

#[test]
fn pictures_are_read_by_azimuth_and_height() {
    let (width, height) = (64, 32);
    let mut texels = vec![[0.0; 3]; width * height];
    // A spot of 1 in the middle of the first quadrant, 45° up.
    let (row, column) = (8, 16);
    texels[row * width + column] = [1.0, 2.0, 4.0];
    let picture = Panorama {
        width: width as u32,
        height: height as u32,
        texels,
    };
    let of = sky(Dome::Picture(Arc::new(picture)));
    let towards = of.direction(SunAngles {
        height: 90.0 - 180.0 * 8.5 / 32.0,
        azimuth: 360.0 * 16.5 / 64.0,
    });
    // Rounding of f64.
    assert!((of.radiance(towards) - DVec3::new(1.0, 2.0, 4.0)).length() < 1e-9);
    // East is x where y is up and −z north.
    assert!(towards.x > 0.5);
    // The irradiance by brute force.
    let mut sum = 0.0;
    let n = 1000;
    for i in 0..n {
        let u = (f64::from(i) + 0.5) / f64::from(n);
        for j in 0..n {
            let (s, c) = (TAU * (f64::from(j) + 0.5) / f64::from(n)).sin_cos();
            let d = DVec3::new(u.sqrt() * s, (1.0 - u).sqrt(), -u.sqrt() * c);
            sum += of.radiance(d).z;
        }
    }
    let brute = PI * sum / f64::from(n * n);
    let exact = of.horizontal()[2];
    // Measured: 1e-4, of the brute force.
    assert!((exact / brute - 1.0).abs() < 5e-4, "{exact} {brute}");
    // A white picture is a uniform sky.
    for (width, height) in [(1, 1), (2, 1), (5, 3), (8, 4)] {
        let white = Panorama {
            width,
            height,
            texels: vec![[1.0; 3]; (width * height) as usize],
        };
        let of = sky(Dome::Picture(Arc::new(white)));
        assert!((of.horizontal()[0] - PI).abs() < 1e-9, "{width} {height}");
    }
}
