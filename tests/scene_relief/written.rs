//! Maps that are written and read back.

use std::fs;
use std::sync::Arc;

use mesolux::scene::{HeightMap, Scene, write_scene};

use super::{folder, ramp, read, square, waves};

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
