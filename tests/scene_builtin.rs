//! The scenes of the paper's Table 1: exact counts and shares, closed solids, sane materials.

use std::collections::HashMap;
use std::path::PathBuf;

use glam::DVec3;
use mesolux::scene::builtin::relief_maps;
use mesolux::scene::{LoadOptions, Scene, Triangle, load, write_scene};

fn built(name: &str, patches: Option<usize>, statue: Option<PathBuf>) -> Scene {
    load(
        name,
        &LoadOptions {
            patches,
            statue,
            ..LoadOptions::default()
        },
    )
    .unwrap()
}

/// Name, elements, meso elements, the least number of elements.
const TABLE_1: [(&str, usize, usize, usize); 3] = [
    ("fruit-platter", 76_304, 11_446, 6_000),
    ("bowl-and-bunny", 73_256, 15_384, 6_000),
    ("cornell-relief", 83_160, 25_780, 8_000),
];
const ROOM: [&str; 9] = [
    "white",
    "red",
    "green",
    "light",
    "plaster",
    "wood",
    "terracotta",
    "teal",
    "rose",
];

fn meso(scene: &Scene) -> usize {
    scene
        .triangles
        .iter()
        .filter(|t| scene.materials[t.material as usize].has_relief())
        .count()
}

#[test]
fn the_counts_are_those_of_the_paper() {
    for (name, patches, of_relief, _) in TABLE_1 {
        let scene = built(name, None, None);
        assert_eq!(scene.triangles.len(), patches, "{name}");
        assert_eq!(meso(&scene), of_relief, "{name}");
        assert_eq!(scene.dropped_degenerate, 0, "{name}");
        assert!(scene.notes.is_empty(), "{name}: {:?}", scene.notes);
        assert_eq!(scene.name, name);
        assert_eq!(scene.cameras[0].name, "front");
        assert_eq!(
            scene.lights.points.len(),
            usize::from(name == "bowl-and-bunny")
        );
        let area_lights = scene.materials.iter().filter(|m| m.emits()).count();
        assert_eq!(area_lights, usize::from(name != "bowl-and-bunny"));
        assert_eq!(scene.hash(), built(name, None, None).hash());
    }
}

#[test]
fn other_numbers_are_exact_too() {
    for (name, patches, of_relief, least) in TABLE_1 {
        let share = (100.0 * of_relief as f64 / patches as f64).round() / 100.0;
        for patches in [least, least + 1, 9_999, 12_000, 20_003] {
            let scene = built(name, Some(patches), None);
            assert_eq!(scene.triangles.len(), patches, "{name}");
            let even = 2 * (share * patches as f64 / 2.0).round() as usize;
            assert_eq!(meso(&scene), even, "{name} {patches}");
        }
        let options = LoadOptions {
            patches: Some(least - 1),
            ..LoadOptions::default()
        };
        let error = load(name, &options).unwrap_err().to_string();
        assert!(
            error.contains(name) && error.contains(&least.to_string()),
            "{error}"
        );
    }
}

/// The pieces of the triangles chosen that hang together by vertices.
fn pieces<'a>(triangles: impl Iterator<Item = &'a Triangle>) -> Vec<Vec<&'a Triangle>> {
    fn root(parent: &mut HashMap<u32, u32>, v: u32) -> u32 {
        let mut at = v;
        while let Some(&up) = parent.get(&at).filter(|&&up| up != at) {
            at = up;
        }
        parent.insert(v, at);
        at
    }
    let triangles: Vec<&Triangle> = triangles.collect();
    let mut parent = HashMap::new();
    for t in &triangles {
        let [a, b, c] = t.vertices.map(|v| root(&mut parent, v));
        parent.insert(b, a);
        let c = root(&mut parent, c);
        let a = root(&mut parent, a);
        parent.insert(c, a);
    }
    let mut found: HashMap<u32, Vec<&Triangle>> = HashMap::new();
    for t in triangles {
        found
            .entry(root(&mut parent, t.vertices[0]))
            .or_default()
            .push(t);
    }
    found.into_values().collect()
}

fn solids(scene: &Scene) -> Vec<Vec<&Triangle>> {
    let in_room = |t: &&Triangle| {
        // The blue wall shares nothing with a solid.
        let name = scene.materials[t.material as usize].name.as_str();
        ROOM.contains(&name) || name == "blue"
    };
    pieces(scene.triangles.iter().filter(|t| !in_room(t)))
}

/// Around every vertex the triangles form one closed fan, each edge used once in each direction;
/// volume positive.
fn closed(scene: &Scene, solid: &[&Triangle], what: &str) {
    let mut rims: HashMap<u32, HashMap<u32, u32>> = HashMap::new();
    let mut volume = 0.0;
    for t in solid {
        let [a, b, c] = t.vertices;
        for [at, from, to] in [[a, b, c], [b, c, a], [c, a, b]] {
            let before = rims.entry(at).or_default().insert(from, to);
            assert_eq!(
                before, None,
                "{what}: an edge is used twice in one direction"
            );
        }
        let origin = scene.vertices[solid[0].vertices[0] as usize];
        let [a, b, c] = scene.corners(t).map(|p| p - origin);
        volume += a.dot(b.cross(c)) / 6.0;
    }
    for rim in rims.values() {
        let start = *rim.keys().next().unwrap();
        let (mut next, mut length) = (rim[&start], 1);
        while next != start {
            next = *rim
                .get(&next)
                .unwrap_or_else(|| panic!("{what}: there is a hole"));
            length += 1;
        }
        assert_eq!(length, rim.len(), "{what}: two fans meet in a vertex");
    }
    assert!(volume > 0.0, "{what}: the fronts look inward");
}

#[test]
fn the_solids_are_closed_at_every_resolution() {
    for (name, patches, _, least) in TABLE_1 {
        for patches in [least, 10_000, 17_777, 40_001, patches, 120_000] {
            let scene = built(name, Some(patches), None);
            let solids = solids(&scene);
            let expected = match name {
                "fruit-platter" => 1 + 5 + 4 + 4 + 1 + 12,
                "bowl-and-bunny" => 2,
                _ => 1,
            };
            assert_eq!(solids.len(), expected, "{name} {patches}");
            for solid in &solids {
                let material = &scene.materials[solid[0].material as usize].name;
                closed(&scene, solid, &format!("{name} {patches} {material}"));
            }
        }
    }
}

#[test]
fn nothing_floats_or_stands_in_the_floor() {
    for (name, _, _, least) in TABLE_1 {
        for patches in [Some(least), None] {
            let scene = built(name, patches, None);
            let room = scene.bounds();
            for solid in solids(&scene) {
                let points = || solid.iter().flat_map(|t| scene.corners(t));
                let low = points().reduce(DVec3::min).unwrap();
                let high = points().reduce(DVec3::max).unwrap();
                assert!(low.y >= 0.0 && low.cmpge(room.0).all() && high.cmple(room.1).all());
                let name = &scene.materials[solid[0].material as usize].name;
                if ["statue", "wool", "glaze", "porcelain", "banana"].contains(&name.as_str()) {
                    assert!(low.y <= 1e-3 + 1e-12, "{name} floats at {}", low.y);
                }
            }
        }
    }
}

/// No two solids whose vertices lie within each other, by the winding number.
#[test]
fn solids_do_not_stand_in_each_other() {
    for name in ["fruit-platter", "bowl-and-bunny"] {
        let scene = built(name, Some(14_000), None);
        let solids = solids(&scene);
        for (i, one) in solids.iter().enumerate() {
            let box_of = |solid: &[&Triangle]| {
                let points = || solid.iter().flat_map(|t| scene.corners(t));
                (
                    points().reduce(DVec3::min).unwrap(),
                    points().reduce(DVec3::max).unwrap(),
                )
            };
            let (low, high) = box_of(one);
            for (j, other) in solids.iter().enumerate() {
                if i == j {
                    continue;
                }
                for t in other {
                    let p = scene.corners(t)[0];
                    if p.cmplt(low).any() || p.cmpgt(high).any() {
                        continue;
                    }
                    let turns: f64 = one.iter().map(|t| solid_angle(scene.corners(t), p)).sum();
                    let names = [one, other].map(|s| &scene.materials[s[0].material as usize].name);
                    assert!(turns < 1.0, "{name}: {names:?} at {p}");
                }
            }
        }
    }
}

/// Van Oosterom and Strackee 1983.
fn solid_angle(corners: [DVec3; 3], p: DVec3) -> f64 {
    let [a, b, c] = corners.map(|q| q - p);
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(below)
}

#[test]
fn coordinates_and_materials_are_sane() {
    for (name, ..) in TABLE_1 {
        let scene = built(name, None, None);
        assert!(
            scene
                .triangles
                .iter()
                .flat_map(|t| t.uv)
                .flatten()
                .all(f32::is_finite)
        );
        for (index, material) in scene.materials.iter().enumerate() {
            assert!(
                material.kd.iter().all(|c| (0.0..0.9).contains(c)),
                "{}",
                material.name
            );
            let used = scene
                .triangles
                .iter()
                .filter(|t| t.material as usize == index)
                .count();
            assert!(used > 0, "{name}: {} is in no triangle", material.name);
        }
        let (low, high) = scene.bounds();
        let extent = (high - low).max_element();
        let camera = &scene.cameras[0];
        assert!(camera.position.distance(camera.look_at) < 2.0 * extent);
        // A texel is 1/2 to 1/4 of an element's edge, in the mean.
        let (mut edges, mut texels, mut n) = (0.0, 0.0, 0.0);
        for t in &scene.triangles {
            let material = &scene.materials[t.material as usize];
            let Some(map) = material.map_height.as_deref() else {
                continue;
            };
            let [a, b, c] = scene.corners(t);
            let uv =
                t.uv.map(|uv| glam::DVec2::from(uv.map(f64::from)) * f64::from(map.width));
            edges += (a.distance(b) + b.distance(c) + c.distance(a)) / 3.0;
            texels += (uv[0].distance(uv[1]) + uv[1].distance(uv[2]) + uv[2].distance(uv[0])) / 3.0;
            n += 1.0;
        }
        let texels_an_edge: f64 = texels / n;
        assert!(
            (2.0..4.0).contains(&texels_an_edge),
            "{name}: {texels_an_edge}"
        );
        let relief = scene.materials.iter().find(|m| m.has_relief()).unwrap();
        let map = relief.map_height.as_deref().unwrap();
        // The length of one repeat, by lengths in space and in texels (edges lie aslant: a few
        // percent less).
        let tile = edges / texels * f64::from(map.width);
        let slope = f64::from(relief.height_scale) / tile * unit_slope(map);
        println!(
            "{name}: {texels_an_edge:.2} texels an edge, rms slope {slope:.2}, tile {tile:.4} m"
        );
        assert!((0.2..0.5).contains(&slope), "{name}: {slope}");
    }
}

/// Root mean square slope of a map on a tile of one unit.
fn unit_slope(map: &mesolux::scene::HeightMap) -> f64 {
    let step = 0.5 / f64::from(map.width);
    let place = |i: u32| f64::from(2 * i + 1) * step;
    let mut sum = 0.0;
    for (u, v) in (0..map.width).flat_map(|i| (0..map.height).map(move |j| (place(i), place(j)))) {
        let du = (map.sample(u + step, v) - map.sample(u - step, v)) / (2.0 * step);
        let dv = (map.sample(u, v + step) - map.sample(u, v - step)) / (2.0 * step);
        sum += du * du + dv * dv;
    }
    (sum / f64::from(map.width * map.height)).sqrt()
}

#[test]
fn they_read_back_the_same() {
    for (name, _, _, least) in TABLE_1 {
        let scene = built(name, Some(least), None);
        let dir = tempfile::tempdir().unwrap();
        let path = write_scene(&scene, dir.path()).unwrap();
        let again = load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
        assert_eq!(scene.hash(), again.hash(), "{name}");
        assert!(again.notes.is_empty(), "{name}: {:?}", again.notes);
    }
}

#[test]
fn a_statue_takes_the_place_of_the_figure() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("tetrahedron.obj");
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
    std::fs::write(&path, text).unwrap();
    for name in ["bowl-and-bunny", "cornell-relief"] {
        for patches in [None, Some(7_001)] {
            let scene = built(name, patches, Some(path.clone()));
            assert_eq!(meso(&scene), 4, "{name}");
            if let Some(patches) = patches {
                assert_eq!(scene.triangles.len(), patches);
            }
        }
    }
    let options = LoadOptions {
        statue: Some(path),
        ..LoadOptions::default()
    };
    let error = load("fruit-platter", &options).unwrap_err().to_string();
    assert!(
        error.contains("fruit-platter") && error.contains("statue"),
        "{error}"
    );
}

#[test]
fn maps_of_other_sizes_are_there() {
    let map = relief_maps::brick(48);
    assert_eq!((map.width, map.height, map.values.len()), (48, 48, 48 * 48));
}
