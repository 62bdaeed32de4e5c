//! The built-in Cornell box: exactly as many elements as asked for, no T-junction, no gap, fronts
//! inward.

use std::collections::HashMap;
use std::path::PathBuf;

use glam::DVec3;
use mesolux::scene::{LoadOptions, Scene, Triangle, load};

fn cornell(patches: Option<usize>, statue: Option<PathBuf>) -> Scene {
    load(
        "cornell",
        &LoadOptions {
            patches,
            statue,
            ..LoadOptions::default()
        },
    )
    .unwrap()
}

fn triangles_of<'a>(scene: &'a Scene, names: &'a [&str]) -> impl Iterator<Item = &'a Triangle> {
    scene
        .triangles
        .iter()
        .filter(|t| names.contains(&scene.materials[t.material as usize].name.as_str()))
}

const ROOM: [&str; 4] = ["white", "red", "green", "light"];

/// The meshes that tests may use but the project does not hold; said aloud where they are not
/// there.
fn horse() -> Option<PathBuf> {
    let shared = match std::env::var_os("MESOLUX_SHARED") {
        Some(shared) => PathBuf::from(shared),
        None => PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../shared")),
    };
    let path = shared.join("meshes/horse-25780.obj");
    if path.is_file() {
        return Some(path);
    }
    eprintln!(
        "not tested: {} is not there (MESOLUX_SHARED names its folder)",
        path.display()
    );
    None
}

#[test]
fn exactly_as_many_patches_as_asked_for() {
    for patches in (3_200..3_300).chain([4_001, 5_555, 12_000, 12_345, 20_002, 60_001, 83_160]) {
        let scene = cornell(Some(patches), None);
        assert_eq!(scene.triangles.len(), patches);
        assert_eq!(scene.dropped_degenerate, 0, "{patches}");
    }
    let scene = cornell(None, None);
    assert_eq!(scene.triangles.len(), 12_000);
    assert!(scene.notes.is_empty(), "{:?}", scene.notes);
}

#[test]
fn the_least_number_of_patches_is_named_and_works() {
    let options = |patches| LoadOptions {
        patches: Some(patches),
        ..LoadOptions::default()
    };
    let error = load("cornell", &options(1_000)).unwrap_err().to_string();
    let least: usize = error.rsplit(' ').next().unwrap().parse().unwrap();
    assert_eq!(
        load("cornell", &options(least)).unwrap().triangles.len(),
        least
    );
    load("cornell", &options(least - 1)).unwrap_err();
}

#[test]
fn the_horse_keeps_each_triangle() {
    let Some(horse) = horse() else { return };
    for patches in [83_160, 83_161, 30_000] {
        let scene = cornell(Some(patches), Some(horse.clone()));
        assert_eq!(scene.triangles.len(), patches);
        assert_eq!(triangles_of(&scene, &["statue"]).count(), 25_780);
        assert_eq!(scene.dropped_degenerate, 0);
        stands_in_the_room(&scene);
        if patches > 80_000 {
            let light = triangles_of(&scene, &["light"]).count();
            assert!(light >= 32, "{light} triangles of the light");
        }
    }
}

#[test]
fn a_tetrahedron_may_be_the_statue() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("tetrahedron.obj");
    // The last vertex is far away and in no triangle: it must not move the others.
    let text =
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nv 900 900 900\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(&path, text).unwrap();
    for patches in 58..400 {
        let scene = cornell(Some(patches), Some(path.clone()));
        assert_eq!(scene.triangles.len(), patches);
        conforming(&scene);
    }
    let scene = cornell(Some(58), Some(path.clone()));
    stands_in_the_room(&scene);
    let options = LoadOptions {
        patches: Some(57),
        statue: Some(path),
        ..LoadOptions::default()
    };
    let error = load("cornell", &options).unwrap_err().to_string();
    assert!(error.contains("58"), "{error}");
}

fn stands_in_the_room(scene: &Scene) {
    let points: Vec<DVec3> = triangles_of(scene, &["statue"])
        .flat_map(|t| scene.corners(t))
        .collect();
    let low = points.iter().copied().reduce(DVec3::min).unwrap();
    let high = points.iter().copied().reduce(DVec3::max).unwrap();
    assert_eq!(low.y, 0.0, "the statue touches the floor");
    assert!(
        low.x > 0.3 && low.z > 0.3 && high.x < 5.2 && high.z < 5.2,
        "{low} {high}"
    );
    assert!(high.y > 1.5 && high.y < 4.5, "{high}");
}

/// Each edge of the room belongs to two triangles in opposite directions, or to one at the opening;
/// no vertex lies within an edge.
fn conforming(scene: &Scene) {
    let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
    for [a, b, c] in triangles_of(scene, &ROOM).map(|t| t.vertices) {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    for (&[a, b], &count) in &edges {
        assert_eq!(count, 1, "an edge is used twice in one direction");
        let [p, q] = [a, b].map(|v| scene.vertices[v as usize]);
        let at_opening = p.z == 0.0 && q.z == 0.0;
        assert_eq!(!edges.contains_key(&[b, a]), at_opening, "edge {p} {q}");
    }
    let mut used: Vec<u32> = edges.keys().map(|e| e[0]).collect();
    used.sort_unstable();
    used.dedup();
    for [a, b] in edges.keys() {
        let [p, q] = [a, b].map(|v| scene.vertices[*v as usize]);
        let along = q - p;
        for v in used.iter().filter(|v| *v != a && *v != b) {
            let offset = scene.vertices[*v as usize] - p;
            let t = offset.dot(along) / along.length_squared();
            let away = (offset - along * t).length();
            assert!(
                !(0.0..=1.0).contains(&t) || away > 1e-9,
                "vertex {} lies in the edge {p} {q}",
                scene.vertices[*v as usize]
            );
        }
    }
}

#[test]
fn the_room_is_conforming() {
    for patches in [3_300, 3_999, 6_000] {
        conforming(&cornell(Some(patches), None));
    }
}

#[test]
fn the_room_has_its_measured_areas_and_faces_inward() {
    let scene = cornell(Some(7_001), None);
    let middle = DVec3::new(2.78, 2.744, 2.796);
    for triangle in triangles_of(&scene, &ROOM) {
        let [a, b, c] = scene.corners(triangle);
        assert!((b - a).cross(c - a).dot(middle - a) > 0.0, "{a} {b} {c}");
    }
    let area = |name: &str| -> f64 {
        triangles_of(&scene, &[name])
            .map(|t| scene.corners(t))
            .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
            .sum()
    };
    let (x, y, z) = (5.56, 5.488, 5.592);
    let light = (3.43 - 2.13) * (3.32 - 2.27);
    // Sums of some thousand areas, each right to a few 1e-16 of its own.
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert!(close(area("light"), light));
    assert!(close(area("red"), y * z) && close(area("green"), y * z));
    assert!(close(area("white"), 2.0 * x * z + x * y - light));
    for t in triangles_of(&scene, &["light"]) {
        for p in scene.corners(t) {
            assert_eq!(p.y, y);
            assert!((2.13..=3.43).contains(&p.x) && (2.27..=3.32).contains(&p.z));
        }
    }
    for t in triangles_of(&scene, &["red"]) {
        assert!(
            scene.corners(t).iter().all(|p| p.x == x),
            "red is on the left, at +x"
        );
    }
}

#[test]
fn the_statue_made_by_code_is_closed_in_the_scene() {
    for patches in [None, Some(3_500), Some(20_001)] {
        let scene = cornell(patches, None);
        let mut edges: HashMap<[u32; 2], usize> = HashMap::new();
        let mut volume = 0.0;
        for t in triangles_of(&scene, &["statue"]) {
            let [a, b, c] = t.vertices;
            for edge in [[a, b], [b, c], [c, a]] {
                *edges.entry(edge).or_default() += 1;
            }
            let [a, b, c] = scene.corners(t);
            volume += a.dot(b.cross(c)) / 6.0;
        }
        assert!(
            edges
                .iter()
                .all(|(&[a, b], &n)| n == 1 && edges.get(&[b, a]) == Some(&1))
        );
        assert!(volume > 0.0);
        stands_in_the_room(&scene);
    }
}

#[test]
fn the_same_options_give_the_same_scene() {
    assert_eq!(
        cornell(Some(4_321), None).hash(),
        cornell(Some(4_321), None).hash()
    );
    assert_ne!(
        cornell(Some(4_321), None).hash(),
        cornell(Some(4_322), None).hash()
    );
}
