//! Names of meshes, and what scenes say of what is in them.

use std::fs;
use std::path::Path;

use mesolux::scene::contents::Contents;
use mesolux::scene::{LoadOptions, Refinement, Scene, load, write_scene};

const ROOM: &str = "mtllib room.mtl\nv 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0 1 0\nv 1 1 0\nv 1 1 1\nv 0 1 1\n\
    o floor\nusemtl paint\nf 1 4 3\ng ignored\no lamp\nusemtl light\nf 5 6 7 8\no floor\nusemtl paint\nf 1 3 2\n";
const MATERIALS: &str = "newmtl paint\nKd 0.5 0.5 0.5\nnewmtl light\nKd 0 0 0\nKe 1 1 1\n";

fn read(folder: &Path, name: &str, text: &str) -> Scene {
    fs::write(folder.join("room.mtl"), MATERIALS).unwrap();
    fs::write(folder.join(name), text).unwrap();
    load(folder.join(name).to_str().unwrap(), &LoadOptions::default()).unwrap()
}

fn runs(scene: &Scene) -> Vec<(&str, u32, u32)> {
    let of = |mesh: &'_ mesolux::scene::MeshRange| (mesh.first, mesh.count);
    (scene.meshes.iter())
        .map(|mesh| (mesh.name.as_str(), of(mesh).0, of(mesh).1))
        .collect()
}

#[test]
fn triangles_keep_the_names_of_their_meshes() {
    let dir = tempfile::tempdir().unwrap();
    let objects = read(dir.path(), "room.obj", ROOM);
    let expected = [("floor", 0, 1), ("lamp", 1, 2), ("floor", 3, 1)];
    assert_eq!(runs(&objects), expected);
    // Groups where there are no objects; faces before the first are the file's.
    let groups = ROOM
        .replace("o floor\nusemtl paint\nf 1 4", "usemtl paint\nf 1 4")
        .replace("g ignored\no lamp", "g a lamp")
        .replace("o floor", "g ");
    let groups = read(dir.path(), "groups.obj", &groups);
    let expected = [("groups", 0, 1), ("a lamp", 1, 2), ("groups", 3, 1)];
    assert_eq!(runs(&groups), expected);
    // A file that is placed twice is two meshes; backs follow their fronts.
    let twice = "[[mesh]]\nfile = 'room.obj'\n[[mesh]]\nfile = 'room.obj'\n\
        translate = [3, 0, 0]\nsides = 'both'\n";
    let expected = [
        ("floor", 0, 1),
        ("lamp", 1, 2),
        ("floor", 3, 1),
        ("floor.2", 4, 1),
        ("lamp.2", 5, 2),
        ("floor.2", 7, 2),
        ("lamp.2", 9, 2),
        ("floor.2", 11, 1),
    ];
    assert_eq!(runs(&read(dir.path(), "twice.toml", twice)), expected);
}

#[test]
fn written_scenes_keep_names() {
    let dir = tempfile::tempdir().unwrap();
    let options = LoadOptions {
        patches: Some(7000),
        ..LoadOptions::default()
    };
    let scene = load("cornell", &options).unwrap();
    let names: Vec<_> = scene.meshes.iter().map(|mesh| &mesh.name).collect();
    assert_eq!(names, ["room", "statue"]);
    let path = write_scene(&scene, dir.path()).unwrap();
    let again = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(again.meshes, scene.meshes);
}

#[test]
fn contents_are_those_of_the_input() {
    let dir = tempfile::tempdir().unwrap();
    let scene = read(dir.path(), "room.obj", ROOM);
    let contents = Contents::of(&scene);
    assert_eq!((contents.vertices, contents.triangles), (8, 4));
    assert_eq!(contents.bounds, [[0.0; 3], [1.0; 3]]);
    let meshes: Vec<_> = (contents.meshes.iter())
        .map(|mesh| (mesh.name.as_str(), &mesh.ranges[..], mesh.area))
        .collect();
    let expected = [
        ("floor", &[[0, 1], [3, 1]][..], 1.0),
        ("lamp", &[[1, 2]][..], 1.0),
    ];
    assert_eq!(meshes, expected);
    let light = &contents.materials[1];
    assert_eq!((light.triangles, light.area, light.ke), (2, 1.0, [1.0; 3]));

    let fine = scene.refined(&Refinement::default());
    assert!(fine.triangles.len() > 1000);
    let of_fine = Contents::of(&fine);
    // The areas of the pieces are summed in another order.
    for (fine, coarse) in of_fine.meshes.iter().zip(&contents.meshes) {
        assert_eq!((&fine.name, &fine.ranges), (&coarse.name, &coarse.ranges));
        assert!((fine.area - coarse.area).abs() < 1e-9);
    }
    assert_eq!((of_fine.vertices, of_fine.triangles), (8, 4));
    let on_input = fine.on_input();
    let of = on_input.iter().zip(&fine.triangles);
    let elements = || of.clone().map(|(on, t)| (on.triangle, t.material));
    let counts = of_fine.count(elements()).unwrap();
    assert_eq!(counts.elements, fine.triangles.len());
    // The floor is of paint and the lamp of light.
    assert_eq!(counts.of_meshes, counts.of_materials);
    assert_eq!(counts.of_meshes.iter().sum::<usize>(), counts.elements);
    assert!(of_fine.count([(4, 0)].into_iter()).is_err());
    assert!(of_fine.count([(0, 2)].into_iter()).is_err());
}

/// Triangles that are cut by a mask stay in their meshes.
#[test]
fn meshes_keep_what_masks_leave() {
    let dir = tempfile::tempdir().unwrap();
    let mask = image::GrayImage::from_fn(8, 8, |x, y| {
        image::Luma([if (2..6).contains(&x) && (2..6).contains(&y) {
            0
        } else {
            255
        }])
    });
    mask.save(dir.path().join("mask.png")).unwrap();
    let masked = MATERIALS.replace("newmtl light", "map_d mask.png\nnewmtl light");
    fs::write(dir.path().join("mask.mtl"), masked).unwrap();
    let scene = read(
        dir.path(),
        "mask.obj",
        &ROOM.replace("room.mtl", "mask.mtl"),
    );
    assert!(scene.triangles.len() > 10, "{}", scene.triangles.len());
    for mesh in &scene.meshes {
        let own = mesh.first as usize..(mesh.first + mesh.count) as usize;
        let materials = scene.triangles[own].iter().map(|t| t.material as usize);
        let names: Vec<_> = materials.map(|m| &scene.materials[m].name).collect();
        let expected = if mesh.name == "lamp" {
            "light"
        } else {
            "paint"
        };
        assert!(names.iter().all(|name| *name == expected), "{names:?}");
    }
}
