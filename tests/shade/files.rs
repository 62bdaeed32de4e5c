//! The files that a picture is written to, and the ones that it is not.

use glam::{DVec3, Vec3};
use mesolux::render::{Codes, Development, MOST_PIXELS, Picture, render, tone};
use mesolux::scene::Scene;

use super::{
    add_square, asymmetric, camera, device, draw, irradiance, material, no_messages, view,
};

#[test]
fn written_files_hold_the_picture() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let view = view(&camera, 61, 47);
    let picture = draw(&scene, &view);
    let dir = tempfile::tempdir().expect("a folder");
    let exr = dir.path().join("picture.EXR");
    picture.write(&exr, Some(3.0)).expect("written");
    let read = image::open(&exr).expect("an EXR").into_rgb32f();
    assert_eq!(read.dimensions(), (61, 47));
    assert!(
        read.pixels().zip(&picture.radiance).all(|(a, b)| a.0 == *b),
        "linear and whole"
    );

    let png = dir.path().join("picture.png");
    picture.write(&png, None).expect("written");
    let bytes = std::fs::read(&png).expect("a PNG");
    let automatic = image::open(&png).expect("a PNG").into_rgb8();
    assert_eq!(automatic.dimensions(), (61, 47));
    picture
        .write(&png, Some(picture.automatic_exposure))
        .expect("written");
    assert_eq!(
        std::fs::read(&png).expect("a PNG"),
        bytes,
        "the same picture is the same file"
    );
    picture
        .write(&png, Some(picture.automatic_exposure - 2.0))
        .expect("written");
    let darker = image::open(&png).expect("a PNG").into_rgb8();
    let sum = |p: &image::RgbImage| p.pixels().map(|p| u64::from(p.0[0])).sum::<u64>();
    assert!(sum(&darker) < sum(&automatic));
    assert_eq!(darker.get_pixel(30, 46).0, [0; 3], "nothing is black");
    no_messages();
}

/// A grey card of radiance 0.5: by the curve 0.5 − 0.04, of which the sRGB code lies between two.
#[test]
fn a_grey_card_has_the_code_of_the_formulas() {
    let mut scene = Scene {
        materials: vec![material([1.0; 3])],
        ..Scene::default()
    };
    add_square(&mut scene, [0.0; 3], 4.0, true, 0);
    let camera = camera(DVec3::ZERO);
    let view = view(&camera, 32, 32);
    let e = Vec3::splat(0.5 * std::f32::consts::PI);
    let picture = render(&device(), &scene, &[e; 2], &view).expect("a picture");
    assert!((picture.automatic_exposure - (0.6_f32 / 0.5).log2()).abs() < 1e-5);
    let dir = tempfile::tempdir().expect("a folder");
    let png = dir.path().join("card.png");
    picture.write(&png, Some(0.0)).expect("written");
    let read = image::open(&png).expect("a PNG").into_rgb8();
    let mean = read.pixels().map(|p| f64::from(p.0[1])).sum::<f64>() / 1024.0;
    let exact = 255.0 * (1.055 * 0.46_f64.powf(1.0 / 2.4) - 0.055);
    // Over whole 8 × 8 blocks the mean of a dithered code is the exact one to the dither's step.
    assert!(
        (mean - exact).abs() < 1.0 / 64.0 + 1e-3,
        "{mean} instead of {exact}"
    );
    no_messages();
}

/// 16 bits hold what 8 bits round, linear codes are those before sRGB and say so, and Radiance's
/// RGBE holds the radiance to a part in 256.
#[test]
fn deep_and_linear_files_hold_the_same_picture() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    let picture = draw(&scene, &view(&camera, 61, 47));
    let dir = tempfile::tempdir().expect("a folder");
    let written = |name: &str, codes: Codes| {
        let path = dir.path().join(name);
        let development = Development {
            codes,
            ..Development::default()
        };
        picture.write(&path, development).expect("written");
        path
    };
    let shallow = written("8.png", Codes::Srgb8);
    let shallow = image::open(&shallow).expect("a PNG").into_rgb8();
    let open = |name: &str, codes: Codes| match image::open(written(name, codes)) {
        Ok(image::DynamicImage::ImageRgb16(deep)) => deep,
        other => panic!("{other:?}"),
    };
    let deep = open("16.png", Codes::Srgb16);
    let linear = open("linear.png", Codes::Linear16);
    for ((one, two), three) in shallow.pixels().zip(deep.pixels()).zip(linear.pixels()) {
        for c in 0..3 {
            let wide = f32::from(two.0[c]);
            // With half a code of dither.
            assert!((f32::from(one.0[c]) - wide / 257.0).abs() <= 1.0);
            let coded = tone::coded(f32::from(three.0[c]) / 65535.0);
            assert!((65535.0 * coded - wide).abs() <= 8.0, "{coded} {wide}");
        }
    }
    let info = |name: &str| {
        let file = std::fs::File::open(dir.path().join(name)).expect("a PNG");
        let reader = png::Decoder::new(std::io::BufReader::new(file)).read_info();
        let reader = reader.expect("a PNG");
        (
            reader.info().gamma().map(|g| g.into_value()),
            reader.info().srgb,
        )
    };
    assert_eq!(info("linear.png"), (Some(1.0), None));
    assert!(info("16.png").1.is_some());

    let hdr = written("picture.hdr", Codes::Srgb8);
    let read = Picture::read(&hdr).expect("an HDR");
    for (one, other) in picture.radiance.iter().zip(&read.radiance) {
        let most = one.iter().fold(0.0_f32, |most, &c| most.max(c));
        for c in 0..3 {
            assert!((one[c] - other[c]).abs() <= most / 128.0);
        }
    }
    no_messages();
}

#[test]
fn sizes_names_and_places_that_cannot_be_are_refused() {
    let (scene, camera) = (asymmetric(), camera(DVec3::ZERO));
    for (width, height) in [(0, 5), (5, 0), (MOST_PIXELS + 1, 5), (5, u32::MAX)] {
        let view = view(&camera, width, height);
        let error =
            render(&device(), &scene, &irradiance(&scene), &view).expect_err("no such size");
        assert!(
            matches!(&error, mesolux::error::Error::Usage(m) if m.contains("16384")),
            "{error}"
        );
    }
    let picture = draw(&scene, &view(&camera, 3, 1));
    let dir = tempfile::tempdir().expect("a folder");
    for name in ["picture.jpg", "picture", ".png"] {
        let error = picture
            .write(&dir.path().join(name), None)
            .expect_err("no such kind");
        assert!(
            matches!(&error, mesolux::error::Error::Usage(m) if m.contains(".png") && m.contains(".exr"))
        );
    }
    for name in ["missing/picture.png", "missing/picture.exr"] {
        let error = picture
            .write(&dir.path().join(name), None)
            .expect_err("no such folder");
        assert!(matches!(error, mesolux::error::Error::Write { .. }));
    }
    no_messages();
}
