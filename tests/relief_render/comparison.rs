//! The numbers that two pictures are compared by, and the bench that tells them.

use glam::Vec3;
use mesolux::bench::pictures;
use mesolux::render::{Comparison, Picture, View, render, side_by_side};

use crate::common::{assert_silent, device};
use crate::{settings, small, small_camera};

/// A picture of so many pixels a side, all alike.
fn even(side: u32, value: [f32; 3]) -> Picture {
    let scene = small(None);
    let dark = vec![Vec3::ZERO; scene.triangles.len()];
    let camera = small_camera();
    let view = View {
        camera: &camera,
        width: side,
        height: side,
    };
    let mut picture = render(&device(), &scene, &dark, &view).expect("a picture");
    picture.radiance.fill(value);
    picture
}

#[test]
fn comparisons_have_closed_forms() {
    // f32 holds these to 2⁻²⁴.
    const ROUNDING: f64 = 1e-6;
    let close = |a: f64, b: f64| assert!((a - b).abs() < ROUNDING, "{a} for {b}");
    let reference = even(2, [1.0, 2.0, 3.0]);
    let same = Comparison::new(&reference, &reference).expect("alike in size");
    assert_eq!((same.rel_mse, same.bias, same.rms), (0.0, 0.0, 0.0));
    // A tenth brighter everywhere.
    let mut brighter = reference.clone();
    for value in brighter.radiance.as_flattened_mut() {
        *value *= 1.1;
    }
    let found = Comparison::new(&brighter, &reference).expect("alike in size");
    let dark = 0.02_f64.powi(2);
    let expected = [1.0_f64, 2.0, 3.0].map(|b| (0.1 * b).powi(2) / (b * b + dark));
    close(found.rel_mse, expected.iter().sum::<f64>() / 3.0);
    close(found.bias, 0.1);
    close(found.rms, (0.01_f64 * 14.0 / 3.0).sqrt() / 2.0);
    // One red value of twelve is off by 1; a black reference pixel counts by the hundredth of the
    // mean.
    let mut spot = reference.clone();
    spot.radiance[3][0] = 0.0;
    let found = Comparison::new(&spot, &reference).expect("alike in size");
    close(found.rel_mse, 1.0 / (1.0 + dark) / 12.0);
    close(found.bias, -1.0 / 24.0);
    close(found.rms, (1.0_f64 / 12.0).sqrt() / 2.0);
    let back = Comparison::new(&reference, &spot).expect("alike in size");
    let mean = 23.0 / 12.0;
    close(back.rel_mse, 1.0 / (0.01_f64 * mean).powi(2) / 12.0);

    let wide = side_by_side(&spot, &brighter).expect("alike in size");
    assert_eq!((wide.width, wide.height, wide.radiance.len()), (6, 2, 12));
    assert_eq!(wide.radiance[6..8], spot.radiance[2..4]);
    assert_eq!(wide.radiance[8..10], brighter.radiance[2..4]);
    // Darker is blue.
    assert!(wide.radiance[11][2] > wide.radiance[11][0]);
    let other = even(3, [1.0; 3]);
    for error in [
        Comparison::new(&reference, &other).err(),
        side_by_side(&reference, &other).err(),
    ] {
        let message = error.expect("sizes differ").to_string();
        assert!(
            message.contains("2x2") && message.contains("3x3"),
            "{message}"
        );
    }
}

/// A row and a picture for each view and part of the light, and the same rows in both files; no row
/// for what is not there.
#[test]
fn bench_writes_rows_and_pictures() {
    let folder = tempfile::tempdir().expect("a folder for the test");
    let settings = settings(64, 1e-2, Some(folder.path().to_owned()));
    let options = pictures::Options {
        side: 8,
        paths: 4,
        samples: 8,
        settings: &settings,
    };
    let scenes = pictures::rooms(Some("bumps")).expect("it is there");
    let rows = pictures::run(&device(), &scenes, &options, folder.path(), |_| true).expect("rows");
    assert_eq!(rows.len(), 9);
    for row in &rows {
        let name = pictures::file_name(row);
        let picture = image::open(folder.path().join(&name)).expect("a picture");
        assert_eq!((picture.width(), picture.height()), (24, 8), "{name}");
        assert!(row.noise > 0.0 && (0.0..1.0).contains(&row.flip), "{row:?}");
    }
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).expect("read");
    assert_eq!(read("pictures.csv").lines().count(), 10);
    let json: serde_json::Value = serde_json::from_str(&read("pictures.json")).expect("JSON");
    assert_eq!(json[8]["light"], "global");
    // A number read may differ from the one written in its last bit.
    let read_back = json[8]["rel_mse"].as_f64().expect("a number");
    assert!((read_back - rows[8].rel_mse).abs() <= 1e-15 * read_back.abs());
    let error = pictures::rooms(Some("nosuch"))
        .expect_err("no such material")
        .to_string();
    assert!(
        error.contains("nosuch") && error.contains("bricks"),
        "{error}"
    );
    assert_silent();
}
