//! What an image gives as heights or as normals.

use std::fs;

use image::{DynamicImage, ImageBuffer, Luma};
use mesolux::error::Result;
use mesolux::scene::{HeightMap, NormalMap, Scene};

use super::{folder, grey16, ramp, read, rgb_float, rgb8, square, square_toml};

fn heights(name: &str, image: &DynamicImage) -> (HeightMap, Option<String>) {
    let dir = folder(&[(name, image)]);
    HeightMap::load(&dir.path().join(name)).unwrap()
}

fn normals(name: &str, image: &DynamicImage) -> Result<NormalMap> {
    let dir = folder(&[(name, image)]);
    NormalMap::load(&dir.path().join(name))
}

fn refused(scene: Result<Scene>, words: &[&str]) {
    let error = scene.unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    for word in words {
        assert!(error.contains(word), "\"{word}\" is not in: {error}");
    }
}

#[test]
fn codes_are_heights_without_gamma() {
    let (map, note) = heights("a.png", &ramp());
    assert_eq!((map.width, map.height, note), (4, 2, None));
    let expected: Vec<f32> = [0, 9_000, 18_000, 27_000, 500, 9_500, 18_500, 27_500]
        .map(|code: u16| f32::from(code) / 65_535.0)
        .to_vec();
    assert_eq!(map.values, expected);

    let eight = ImageBuffer::from_fn(256, 1, |x, _| Luma([x as u8]));
    let (map, _) = heights("b.png", &eight.into());
    let expected: Vec<f32> = (0..=255_u8).map(|c| f32::from(c) / 255.0).collect();
    assert_eq!(map.values, expected);

    let (map, note) = heights("c.exr", &rgb_float(2, 1, |x, _| [x as f32 * -7.5; 3]));
    assert_eq!((map.values, note), (vec![0.0, -7.5], None));

    let flat = ImageBuffer::from_pixel(8, 8, Luma([51_u8]));
    let (map, _) = heights("d.jpg", &flat.into());
    assert!(map.values.iter().all(|v| (v - 0.2).abs() < 2.0 / 255.0));
}

#[test]
fn of_a_coloured_height_map_the_luminance_counts_and_the_person_is_told() {
    let (map, note) = heights(
        "a.png",
        &rgb8(2, 1, |x, _| [[255, 0, 0], [0, 255, 255]][x as usize]),
    );
    assert!((map.values[0] - 0.2126).abs() < 1e-6 && (map.values[1] - 0.7874).abs() < 1e-6);
    let note = note.unwrap();
    assert!(
        note.contains("a.png") && note.contains("luminance"),
        "{note}"
    );
    assert!(!note.contains("normal"), "{note}");
    let (_, note) = heights("b.png", &rgb8(4, 4, |x, _| [100 + 10 * x as u8, 128, 250]));
    assert!(note.unwrap().contains("looks like a normal map"));

    let dir = folder(&[("a.png", &rgb8(2, 1, |x, _| [x as u8 * 255, 0, 0]))]);
    for scene in [
        square(&dir, "map_Disp a.png"),
        square_toml(&dir, "height_map = 'a.png'"),
    ] {
        let notes = scene.unwrap().notes;
        assert_eq!(notes.iter().filter(|n| n.contains("luminance")).count(), 1);
    }
}

#[test]
fn texel_centres_lie_at_half_integers_with_v_up() {
    let (map, _) = heights("a.png", &ramp());
    let at = |x: f64, y: f64| map.sample((x + 0.5) / 4.0, 1.0 - (y + 0.5) / 2.0);
    let close = |a: f64, b: f64| assert!((a - b / 65_535.0).abs() < 1e-7, "{a} {b}");
    close(at(0.0, 0.0), 0.0);
    close(at(3.0, 1.0), 27_500.0);
    close(at(1.25, 0.5), 11_500.0);
    // It repeats in both directions.
    close(at(3.5, 0.0), 13_500.0);
    close(at(-4.0 + 2.0, 6.0 + 1.0), 18_500.0);
    let (line, _) = heights("b.png", &grey16(1, 5, |_, y| y as u16 * 100));
    close(line.sample(0.3, 0.9), 0.0);
    close(line.sample(-7.7, 0.8), 50.0);
}

#[test]
fn what_no_height_map_can_be_is_refused() {
    let dir = folder(&[
        (
            "nan.exr",
            &rgb_float(3, 2, |x, y| {
                [if (x, y) == (2, 1) { f32::NAN } else { 0.0 }; 3]
            }),
        ),
        ("inf.exr", &rgb_float(1, 1, |_, _| [f32::INFINITY; 3])),
        ("big.exr", &rgb_float(2, 1, |x, _| [x as f32 * 3e38; 3])),
        ("ok.png", &ramp()),
    ]);
    fs::write(dir.path().join("text.png"), "no picture").unwrap();
    let mtl = |lines| square(&dir, lines);
    refused(
        mtl("map_Disp gone.png"),
        &["a.mtl", "\"m\"", "map_Disp", "gone.png", "cannot be read"],
    );
    refused(
        mtl("bump text.png"),
        &["a.mtl", "bump", "text.png", "cannot be decoded"],
    );
    refused(mtl("disp nan.exr"), &["nan.exr", "(2, 1)", "finite"]);
    refused(mtl("disp inf.exr"), &["inf.exr", "(0, 0)", "finite"]);
    refused(mtl("disp -bm 9 big.exr"), &["a.mtl", "big.exr", "beyond"]);
    refused(
        mtl("disp -bm x ok.png"),
        &["a.mtl:4", "\"m\"", "disp -bm", "\"x\""],
    );
    refused(mtl("disp -bm 1e300 ok.png"), &["a.mtl:4", "too large"]);
    refused(mtl("disp -mm 0 ok.png"), &["a.mtl:4", "ok.png"]);
    refused(mtl("disp -bm 2"), &["a.mtl:4", "names no file"]);
    refused(mtl("norm"), &["a.mtl:4", "names no file"]);
    refused(
        mtl("map_Bump -imfchan x ok.png"),
        &["a.mtl:4", "-imfchan", "\"x\" is none of r, g, b, l"],
    );
    refused(
        mtl("norm -level 2 ok.png"),
        &["a.mtl:4", "norm", "-level", "not known"],
    );

    let toml = |lines| square_toml(&dir, lines);
    refused(
        toml("height_map = 'gone.png'"),
        &["a.toml", "\"m\"", "height_map", "gone.png"],
    );
    refused(
        toml("height_scale = 2.0"),
        &["a.toml", "\"m\"", "height_scale needs a height_map"],
    );
    refused(
        toml("height_map = 'ok.png'\nheight_scale = inf"),
        &["a.toml", "\"m\"", "finite"],
    );
    refused(
        toml("height_map = 'ok.png'\nheight_scale = nan"),
        &["a.toml", "\"m\"", "finite"],
    );
    refused(toml("normal_map = 'gone.png'"), &["normal_map", "gone.png"]);

    fs::write(
        dir.path().join("b.obj"),
        "mtllib b.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
    )
    .unwrap();
    fs::write(dir.path().join("b.mtl"), "disp ok.png\nnewmtl m\n").unwrap();
    refused(
        read(&dir.path().join("b.obj")),
        &["b.mtl:1", "before the first newmtl"],
    );
}

#[test]
fn what_no_normal_map_can_be_is_refused() {
    let refuse = |name: &str, image: DynamicImage, words: &[&str]| {
        let error = normals(name, &image).unwrap_err().to_string();
        for word in words {
            assert!(error.contains(word), "\"{word}\" is not in: {error}");
        }
    };
    let inward = rgb8(2, 2, |x, y| {
        [128, 128, if (x, y) == (1, 0) { 100 } else { 255 }]
    });
    refuse("in.png", inward, &["in.png", "(1, 0)", "into the surface"]);
    refuse(
        "zero.exr",
        rgb_float(1, 1, |_, _| [0.5; 3]),
        &["zero.exr", "(0, 0)", "length 0"],
    );
    refuse(
        "raw.exr",
        rgb_float(1, 1, |_, _| [-0.1, 0.0, 1.0]),
        &["raw.exr", "0..=1"],
    );
    refuse(
        "nan.exr",
        rgb_float(1, 1, |_, _| [f32::NAN; 3]),
        &["nan.exr", "0..=1"],
    );
    let map = normals("a.png", &rgb8(1, 1, |_, _| [255, 0, 255])).unwrap();
    let third = 1.0 / 3.0_f32.sqrt();
    assert_eq!(map.normals, [[third, -third, third]]);
}
