//! Height and normal maps: what is read, what is refused, what is told, and that they are written out the same.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageBuffer, Luma, Rgb};
use mesolux::error::Result;
use mesolux::scene::{BuiltinOptions, HeightMap, NormalMap, Scene, load, write_scene};
use tempfile::TempDir;

fn read(path: &Path) -> Result<Scene> {
    load(path.to_str().unwrap(), &BuiltinOptions::default())
}

fn grey16(width: u32, height: u32, code: impl Fn(u32, u32) -> u16) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Luma([code(x, y)])).into()
}

fn rgb8(width: u32, height: u32, texel: impl Fn(u32, u32) -> [u8; 3]) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Rgb(texel(x, y))).into()
}

fn rgb_float(width: u32, height: u32, texel: impl Fn(u32, u32) -> [f32; 3]) -> DynamicImage {
    ImageBuffer::from_fn(width, height, |x, y| Rgb(texel(x, y))).into()
}

/// A folder with images.
fn folder(images: &[(&str, &DynamicImage)]) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for (name, image) in images {
        image.save(dir.path().join(name)).unwrap();
    }
    dir
}

fn heights(name: &str, image: &DynamicImage) -> (HeightMap, Option<String>) {
    let dir = folder(&[(name, image)]);
    HeightMap::load(&dir.path().join(name)).unwrap()
}

fn normals(name: &str, image: &DynamicImage) -> Result<NormalMap> {
    let dir = folder(&[(name, image)]);
    NormalMap::load(&dir.path().join(name))
}

const SQUARE: &str = "mtllib a.mtl\nv 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n";

/// A square of 2 by 2 units under one tile, with a material of these lines.
fn square(dir: &TempDir, lines: &str) -> Result<Scene> {
    fs::write(dir.path().join("a.obj"), SQUARE).unwrap();
    let mtl = format!("newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n{lines}\n");
    fs::write(dir.path().join("a.mtl"), mtl).unwrap();
    read(&dir.path().join("a.obj"))
}

/// The same with a table of a scene file.
fn square_toml(dir: &TempDir, lines: &str) -> Result<Scene> {
    square(dir, "").unwrap();
    let toml = format!("[[mesh]]\nfile = 'a.obj'\n[material.m]\n{lines}\n");
    fs::write(dir.path().join("a.toml"), toml).unwrap();
    read(&dir.path().join("a.toml"))
}

fn refused(scene: Result<Scene>, words: &[&str]) {
    let error = scene.unwrap_err().to_string();
    assert!(!error.contains('\n'), "{error}");
    for word in words {
        assert!(error.contains(word), "\"{word}\" is not in: {error}");
    }
}

fn ramp() -> DynamicImage {
    grey16(4, 2, |x, y| (x * 9_000 + y * 500) as u16)
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
        mtl("map_Bump -clamp on ok.png"),
        &["a.mtl:4", "-clamp", "not known"],
    );
    refused(
        mtl("norm -bm 2 ok.png"),
        &["a.mtl:4", "norm", "-bm", "not known"],
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

#[test]
fn the_mtl_statements_and_their_factors() {
    let dir = folder(&[
        ("my height.png", &ramp()),
        ("other.png", &grey16(1, 1, |_, _| 7)),
        ("n.png", &rgb8(1, 1, |_, _| [128, 128, 255])),
    ]);
    for (lines, scale) in [
        ("map_Disp my height.png", 1.0),
        ("disp -bm -0.25 my height.png", -0.25),
        ("map_disp -mm 0.3 2 -bm 3 my height.png", 6.0),
        ("map_Bump -bm 0.5 my height.png", 0.5),
        ("bump my height.png", 1.0),
        ("map_bump other.png\nbump -mm 1 4 my height.png", 4.0),
    ] {
        let scene = square(&dir, lines).unwrap();
        let material = &scene.materials[0];
        assert_eq!(material.height_scale, scale, "{lines}");
        assert_eq!(material.map_height.as_ref().unwrap().width, 4, "{lines}");
        assert!(
            material.has_relief() && scene.notes.len() == 1,
            "{:?}",
            scene.notes
        );
    }
    let scene = square(&dir, "bump -bm 9 other.png\ndisp -bm 2 my height.png").unwrap();
    assert_eq!(scene.materials[0].height_scale, 2.0);
    assert_eq!(scene.materials[0].map_height.as_ref().unwrap().width, 4);
    assert!(scene.notes.iter().any(|n| n.contains("disp and bump")));

    let scene = square(&dir, "map_Norm n.png").unwrap();
    assert!(scene.materials[0].map_normal.is_some() && !scene.materials[0].has_relief());
    assert!(
        scene
            .notes
            .iter()
            .any(|n| n.contains("n.png") && n.contains("height map"))
    );

    let lines = "height_map = 'my height.png'\nheight_scale = 0.125\nnormal_map = 'n.png'";
    let material = square_toml(&dir, lines).unwrap().materials.remove(0);
    assert_eq!(material.height_scale, 0.125);
    assert!(material.has_relief() && material.map_normal.is_some());
}

#[test]
fn a_map_without_effect_is_told() {
    let dir = folder(&[("one.png", &grey16(1, 1, |_, _| 9)), ("a.png", &ramp())]);
    for (lines, words) in [
        ("disp one.png", "one.png is flat"),
        ("disp -bm 0 a.png", "scale is 0"),
    ] {
        let scene = square(&dir, lines).unwrap();
        assert!(!scene.materials[0].has_relief());
        assert!(
            scene.notes.iter().any(|n| n.contains(words)),
            "{:?}",
            scene.notes
        );
    }
}

/// A product of waves, and its normals for a tile of 2 by 2 units; signs turn the normals over.
fn waves(scale: f64, signs: [f64; 2]) -> (DynamicImage, DynamicImage) {
    let size = 64;
    let place = |x: u32, y: u32| {
        [
            (f64::from(x) + 0.5) / 64.0,
            1.0 - (f64::from(y) + 0.5) / 64.0,
        ]
    };
    let wave = |c: f64| (TAU * c + 0.3).sin();
    let slope = |c: f64| TAU * (TAU * c + 0.3).cos();
    let height = grey16(size, size, |x, y| {
        let [u, v] = place(x, y);
        ((0.5 + 0.25 * (wave(u) + wave(v))) * 65_535.0).round() as u16
    });
    let normal = rgb_float(size, size, |x, y| {
        let [u, v] = place(x, y);
        let n = glam::DVec3::new(
            -signs[0] * slope(u) * 0.25 * scale / 2.0,
            -signs[1] * slope(v) * 0.25 * scale / 2.0,
            1.0,
        )
        .normalize();
        ((n + 1.0) / 2.0).as_vec3().to_array()
    });
    (height, normal)
}

#[test]
fn maps_that_contradict_each_other_are_told_with_the_cure() {
    for (signs, cure) in [
        ([1.0, 1.0], None),
        ([1.0, -1.0], Some("green")),
        ([-1.0, -1.0], Some("sign of the heights")),
        ([-1.0, 1.0], Some("red")),
    ] {
        let (height, normal) = waves(1.0, signs);
        let dir = folder(&[("h.png", &height), ("n.exr", &normal)]);
        let scene = square(&dir, "disp h.png\nnorm n.exr").unwrap();
        let note = scene.notes.iter().find(|n| n.contains("contradict"));
        match cure {
            None => assert_eq!(note, None),
            Some(cure) => {
                let note = note.unwrap();
                assert!(note.contains("h.png") && note.contains("n.exr"), "{note}");
                assert!(note.contains(cure) && note.contains("degrees"), "{note}");
            }
        }
    }
    // Another scale is another strength, no contradiction; a flat normal map is one, which no sign mends.
    let (height, normal) = waves(0.2, [1.0, 1.0]);
    let flat = rgb_float(4, 4, |_, _| [0.5, 0.5, 1.0]);
    let dir = folder(&[("h.png", &height), ("n.exr", &normal), ("flat.exr", &flat)]);
    let scene = square(&dir, "disp -bm 3 h.png\nnorm n.exr").unwrap();
    assert!(!scene.notes.iter().any(|n| n.contains("contradict")));
    let scene = square(&dir, "disp h.png\nnorm flat.exr").unwrap();
    let note = scene
        .notes
        .iter()
        .find(|n| n.contains("contradict"))
        .unwrap();
    assert!(!note.contains("they agree"), "{note}");
}

#[test]
fn the_mean_angle_is_in_scene_units() {
    // A tile of 2 by 2 units: the slopes are half of those in texture space.
    let (height, normal) = waves(1.0, [0.0, 0.0]);
    let dir = folder(&[("h.png", &height), ("n.exr", &normal)]);
    let scene = square(&dir, "disp h.png\nnorm n.exr").unwrap();
    let note = scene
        .notes
        .iter()
        .find(|n| n.contains("contradict"))
        .unwrap();
    let mut sum = 0.0;
    for x in 0..64 {
        for y in 0..64 {
            let slope = |c: f64| TAU * 0.25 / 2.0 * (TAU * (c + 0.5) / 64.0).cos();
            sum += slope(f64::from(x)).hypot(slope(f64::from(y))).atan();
        }
    }
    let angle = (sum / 4096.0).to_degrees();
    assert!(
        note.contains(&format!("{angle:.0} degrees")),
        "{note} {angle}"
    );
}

/// What is written and read back, compared by the hash.
fn comes_back(scene: &Scene, files: &[&str]) {
    let out = tempfile::tempdir().unwrap();
    let path = write_scene(scene, out.path()).unwrap();
    let again = read(&path).unwrap();
    assert_eq!(scene.hash(), again.hash());
    assert_eq!(
        again.materials[0].height_scale,
        scene.materials[0].height_scale
    );
    let mut names: Vec<_> = fs::read_dir(out.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| !name.starts_with("scene."))
        .collect();
    names.sort();
    assert_eq!(names, files);
    // Over itself.
    write_scene(&again, out.path()).unwrap();
    assert_eq!(read(&path).unwrap().hash(), scene.hash());
}

#[test]
fn relief_reads_back_the_same() {
    let (height, normal) = waves(1.0, [1.0, -1.0]);
    let dir = folder(&[("my h.png", &height), ("n.exr", &normal)]);
    let mut scene = square(&dir, "disp -bm -0.1 my h.png\nnorm n.exr").unwrap();
    comes_back(&scene, &["height-0.png", "normal-1.exr"]);

    let made = |values: Vec<f32>| HeightMap {
        path: "made.png".into(),
        width: 3,
        height: 2,
        values,
    };
    let codes = [0_u16, 1, 77, 32_768, 65_534, 65_535].map(|c| f32::from(c) / 65_535.0);
    scene.materials[0].map_normal = None;
    scene.materials[0].map_height = Some(Arc::new(made(codes.to_vec())));
    comes_back(&scene, &["height-0.png"]);
    let awkward = vec![0.1, -3.0, 1e-30, 7e20, 0.0, 1.0];
    scene.materials[0].height_scale = 1e-3;
    scene.materials[0].map_height = Some(Arc::new(made(awkward)));
    comes_back(&scene, &["height-0.exr"]);

    // A file that changed since must not take the place of what is in the scene.
    let mut scene = square(&dir, "disp my h.png").unwrap();
    ramp().save(dir.path().join("my h.png")).unwrap();
    comes_back(&scene, &["height-0.png"]);
    scene.materials.push(scene.materials[0].clone());
    scene.materials[1].name = "twin".into();
    comes_back(&scene, &["height-0.png"]);
}
