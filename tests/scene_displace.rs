//! The high-poly baseline: relief turned into geometry.

use std::collections::HashMap;
use std::f64::consts::TAU;
use std::sync::Arc;

use glam::DVec3;
use mesolux::scene::{HeightMap, LoadOptions, Material, Scene, Triangle, displace, load};

fn map(size: u32, height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(size);
    HeightMap {
        path: "made.png".into(),
        width: size,
        height: size,
        values: (0..size)
            .flat_map(|row| (0..size).map(move |column| (place(column), 1.0 - place(row))))
            .map(|(u, v)| height(u, v) as f32)
            .collect(),
    }
}

fn relief(map: HeightMap, scale: f32) -> Material {
    Material {
        name: "relief".into(),
        kd: [0.5; 3],
        map_height: Some(Arc::new(map)),
        height_scale: scale,
        ..Material::default()
    }
}

fn plain() -> Material {
    Material {
        name: "plain".into(),
        kd: [0.25; 3],
        ke: [1.0; 3],
        ..Material::default()
    }
}

fn triangle(vertices: [u32; 3], uv: [[f32; 2]; 3], material: u32) -> Triangle {
    Triangle {
        vertices,
        uv,
        emission_uv: None,
        light_uv: None,
        material,
    }
}

/// The square from (0,0) to (2,2) in z = 0 under one tile; with `beside` a plain one of the same
/// size at its right.
fn sheet(material: Material, beside: bool) -> Scene {
    let mut scene = Scene {
        name: "sheet".into(),
        vertices: [[0, 0], [2, 0], [2, 2], [0, 2], [4, 0], [4, 2]]
            .map(|[x, y]| DVec3::new(f64::from(x), f64::from(y), 0.0))
            .to_vec(),
        materials: vec![material, plain()],
        ..Scene::default()
    };
    let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    scene
        .triangles
        .push(triangle([0, 1, 2], [uv[0], uv[1], uv[2]], 0));
    scene
        .triangles
        .push(triangle([0, 2, 3], [uv[0], uv[2], uv[3]], 0));
    if beside {
        scene
            .triangles
            .push(triangle([1, 4, 5], [uv[0], uv[1], uv[2]], 1));
        scene
            .triangles
            .push(triangle([1, 5, 2], [uv[0], uv[2], uv[3]], 1));
    } else {
        scene.vertices.truncate(4);
    }
    scene
}

/// A product of waves whose mean over the texels is 0.5.
fn waves(size: u32) -> HeightMap {
    map(size, |u, v| {
        0.5 + 0.25 * (TAU * u).sin() + 0.25 * (TAU * v).cos()
    })
}

fn area(scene: &Scene, material: u32) -> f64 {
    scene
        .triangles
        .iter()
        .filter(|t| t.material == material)
        .map(|t| scene.corners(t))
        .map(|[a, b, c]| (b - a).cross(c - a).length() / 2.0)
        .sum()
}

fn edges(triangles: impl Iterator<Item = Triangle>) -> HashMap<[u32; 2], usize> {
    let mut edges = HashMap::new();
    for [a, b, c] in triangles.map(|t| t.vertices) {
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    edges
}

#[test]
fn a_wave_on_a_plane_has_exact_heights_at_the_vertices() {
    // Nine rows of nine cells, the outer ones cut by the border. The nine along the diagonal are
    // cut in two by it; of each of the others there are four triangles.
    for (scale, beside) in [(0.3_f32, false), (-0.125, false)] {
        let heights = waves(8);
        let flat = sheet(relief(heights.clone(), scale), beside);
        let high = displace(&flat).unwrap();
        assert_eq!(high.triangles.len(), 72 * 4 + 9 * 2, "{scale}");
        assert_eq!(high.dropped_degenerate, 0);
        let mut moved = 0;
        for t in &high.triangles {
            for (p, uv) in high.corners(t).iter().zip(t.uv) {
                let [u, v] = uv.map(f64::from);
                assert!(
                    (p.x - 2.0 * u).abs().max((p.y - 2.0 * v).abs()) < 1e-15,
                    "{p}"
                );
                let expected = f64::from(scale) * (heights.sample(u, v) - heights.mean());
                assert!((p.z - expected).abs() < 1e-15, "{} {expected}", p.z);
                moved += usize::from(p.z != 0.0);
            }
        }
        assert!(moved > 300, "{moved}");
        assert_eq!(
            high.vertices[0].z,
            f64::from(scale) * (heights.sample(0.0, 0.0) - heights.mean())
        );
        // Facing up still, and above the same square.
        let seen: f64 = high
            .triangles
            .iter()
            .map(|t| high.corners(t))
            .map(|[a, b, c]| (b - a).cross(c - a).z / 2.0)
            .sum();
        assert!((seen - 4.0).abs() < 1e-12, "{seen}");
        assert!(area(&high, 0) > 4.01);
    }
}

#[test]
fn no_triangle_reaches_over_more_than_a_cell() {
    for size in [1_u32, 2, 3, 5, 16] {
        let heights = map(size, |u, v| u + 2.0 * v);
        let high = displace(&sheet(relief(heights, 1.0), false)).unwrap();
        let cells = |uv: [f32; 2]| uv.map(|x| f64::from(x) * f64::from(size) - 0.5);
        let mut widest = 0.0_f64;
        for t in &high.triangles {
            for axis in 0..2 {
                let along = t.uv.map(|uv| cells(uv)[axis]);
                let [low, high] =
                    [f64::min, f64::max].map(|of| along.into_iter().reduce(of).unwrap());
                let line = (low + 1e-4).ceil();
                assert!(
                    size == 1 || line > high - 1e-4,
                    "{size}: a line in {low} to {high}"
                );
                widest = widest.max(high - low);
            }
        }
        // A map of one texel is flat: no relief, nothing to refine.
        match size {
            1 => assert_eq!(high.triangles.len(), 2),
            _ => assert!((widest - 1.0).abs() < 1e-4, "{size}: {widest}"),
        }
    }
}

/// A closed shape of 32 triangles under textures turned, stretched and shifted at random, some of
/// them along the lines between cells, some a line or a point.
fn wrapped(seed: u64) -> Scene {
    let mut state = seed;
    let mut random = move || {
        state = state
            .wrapping_mul(6364136223846793005)
            .wrapping_add(1442695040888963407);
        (state >> 40) as f32 / (1 << 24) as f32
    };
    let (mut vertices, mut faces) = (Vec::new(), Vec::new());
    let corner = [DVec3::X, DVec3::Y, DVec3::Z];
    vertices.extend(corner.iter().flat_map(|&axis| [axis, -axis]));
    for k in 0..8_u32 {
        let [x, y, z] = [k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2)];
        faces.push(if k.count_ones() % 2 == 0 {
            [x, y, z]
        } else {
            [x, z, y]
        });
    }
    let mut middles = HashMap::new();
    let mut quarters = Vec::new();
    for [a, b, c] in faces {
        let mut middle = |p: u32, q: u32| {
            *middles.entry([p.min(q), p.max(q)]).or_insert_with(|| {
                vertices.push((vertices[p as usize] + vertices[q as usize]).normalize());
                vertices.len() as u32 - 1
            })
        };
        let [d, e, f] = [middle(a, b), middle(b, c), middle(c, a)];
        quarters.extend([[a, d, f], [d, b, e], [f, e, c], [d, e, f]]);
    }
    let mut scene = Scene {
        name: "wrapped".into(),
        vertices,
        materials: vec![relief(waves(7), 0.05), plain()],
        ..Scene::default()
    };
    // Shared where it can be: by vertex, shifted by whole repeats.
    let shared: Vec<[f32; 2]> = scene
        .vertices
        .iter()
        .map(|_| [random(), random()])
        .collect();
    for (k, vertices) in quarters.into_iter().enumerate() {
        let shift = [random(), random()].map(|x| (8.0 * x).floor());
        let uv = match k % 8 {
            0..3 => vertices.map(|v| shared[v as usize]),
            3 => vertices.map(|v| [0, 1].map(|i| shared[v as usize][i] + shift[i])),
            4 => [0; 3].map(|_| [random(), random()].map(|x| 3.0 * x)),
            // On lines: texels of a seventh, whose centres are at odd fourteenths.
            5 => [0; 3].map(|_| [random(), random()].map(|x| ((20.0 * x).floor() + 0.5) / 7.0)),
            6 => [0; 3].map(|_| [2.0 * random(), 0.3]),
            _ => [shared[0]; 3],
        };
        scene
            .triangles
            .push(triangle(vertices, uv, u32::from(k == 9)));
    }
    scene
}

/// No gap, no overlap, and the same share of the texture, however the texture lies.
#[test]
fn any_texture_leaves_the_surface_closed() {
    let texture = |scene: &Scene| -> f64 {
        let area = |t: &Triangle| {
            let [a, b, c] = t.uv.map(|uv| uv.map(f64::from));
            ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs() / 2.0
        };
        scene.triangles.iter().map(area).sum()
    };
    for seed in 0..200 {
        let flat = wrapped(seed);
        let high = displace(&flat).unwrap();
        let edges = edges(high.triangles.iter().copied());
        for (&[a, b], &n) in &edges {
            assert_eq!((n, edges.get(&[b, a])), (1, Some(&1)), "{seed}: {a} {b}");
        }
        assert_eq!(high.dropped_degenerate, 0, "{seed}");
        let [before, after] = [texture(&flat), texture(&high)];
        assert!(
            (before - after).abs() < 1e-3 * before,
            "{seed}: {before} {after}"
        );
    }
}

/// Where whole cells are, the surface passes through the bilinear map at all of its vertices.
#[test]
fn a_whole_cell_has_the_height_of_its_middle() {
    let heights = map(6, |u, v| ((40.0 * u).sin() * (31.0 * v).cos() + 1.0) / 2.0);
    let high = displace(&sheet(relief(heights.clone(), 0.2), false)).unwrap();
    let middles: Vec<DVec3> = high
        .vertices
        .iter()
        .copied()
        .filter(|p| {
            [p.x, p.y]
                .iter()
                .all(|x| ((3.0 * x).fract()).abs() < 1e-9 && *x > 0.0)
        })
        .collect();
    assert!(middles.len() >= 20, "{}", middles.len());
    for p in middles {
        let expected = f64::from(0.2_f32) * (heights.sample(p.x / 2.0, p.y / 2.0) - heights.mean());
        assert!((p.z - expected).abs() < 1e-12, "{p} {expected}");
    }
}

#[test]
fn without_relief_nothing_changes_but_the_maps() {
    let constant = relief(map(8, |_, _| 0.7), 1.0);
    let zero = relief(waves(8), 0.0);
    for material in [constant, zero] {
        let flat = sheet(material, true);
        let high = displace(&flat).unwrap();
        assert_eq!(
            (&high.vertices, &high.triangles),
            (&flat.vertices, &flat.triangles)
        );
        assert!(
            high.materials
                .iter()
                .all(|m| m.map_height.is_none() && m.map_normal.is_none())
        );
        assert_eq!(high.materials[0].kd, [0.5; 3]);
    }
    // Refined, but as good as flat.
    let faint = relief(waves(8), 1e-30);
    let high = displace(&sheet(faint, true)).unwrap();
    assert!(high.triangles.len() > 256);
    assert!((area(&high, 0) - 4.0).abs() < 1e-12);
    assert!((area(&high, 1) - 4.0).abs() < 1e-12);
}

#[test]
fn the_border_to_plain_surfaces_stays_and_has_no_t_junction() {
    let high = displace(&sheet(relief(waves(8), 0.3), true)).unwrap();
    for t in &high.triangles {
        for p in high.corners(t) {
            if t.material == 1 || p.x == 2.0 {
                assert_eq!(p.z, 0.0, "{p}");
            }
        }
    }
    assert!(
        high.vertices.iter().any(|p| p.x == 0.0 && p.z.abs() > 0.05),
        "the open border moves"
    );
    assert!((area(&high, 1) - 4.0).abs() < 1e-12);
    // An edge without a twin lies on the border of the whole.
    let edges = edges(high.triangles.iter().copied());
    for [a, b] in edges.keys() {
        if !edges.contains_key(&[*b, *a]) {
            let [p, q] = [a, b].map(|v| high.vertices[*v as usize]);
            let on = |axis: usize, at: f64| p[axis] == at && q[axis] == at;
            assert!(
                on(0, 0.0) || on(0, 4.0) || on(1, 0.0) || on(1, 2.0),
                "{p} {q}"
            );
        }
    }
    assert!(edges.values().all(|&n| n == 1));
}

#[test]
fn at_a_seam_the_mean_of_the_heights_counts() {
    let mut flat = sheet(relief(waves(8), 1.0), false);
    // The second triangle elsewhere in the tile: the diagonal is a seam.
    for uv in &mut flat.triangles[1].uv {
        uv[0] += 0.25;
    }
    let heights = waves(8);
    let high = displace(&flat).unwrap();
    let corner = (heights.sample(0.0, 0.0) + heights.sample(0.25, 0.0)) / 2.0 - heights.mean();
    assert!((high.vertices[0].z - corner).abs() < 1e-15);
    // A shift by whole repeats is no seam: the two count once, beside a third.
    for uv in &mut flat.triangles[1].uv {
        uv[0] += 6.75;
    }
    let mut third = flat.clone();
    third.vertices.push(DVec3::new(-2.0, 2.0, 0.0));
    let uv = [[0.25, 0.0], [1.25, 1.0], [0.25, 1.0]];
    third.triangles.push(triangle([0, 3, 4], uv, 0));
    assert!((displace(&third).unwrap().vertices[0].z - corner).abs() < 1e-15);
    let corner = heights.sample(0.0, 0.0) - heights.mean();
    assert!((displace(&flat).unwrap().vertices[0].z - corner).abs() < 1e-15);
}

#[test]
fn it_moves_along_the_smooth_normal() {
    // A roof of two planes that meet at the ridge x = 0 at right angles: there the normal is
    // straight up.
    let mut roof = sheet(relief(map(4, |u, _| (TAU * u).cos()), 1.0), false);
    let x = 0.5_f64.sqrt();
    roof.vertices = [
        [-1.0, 0.0],
        [0.0, 0.0],
        [0.0, 1.0],
        [-1.0, 1.0],
        [1.0, 0.0],
        [1.0, 1.0],
    ]
    .map(|[s, y]: [f64; 2]| DVec3::new(s * x, y, -s.abs() * x))
    .to_vec();
    let uv = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let next = uv.map(|[u, v]| [u + 1.0, v]);
    roof.triangles
        .push(triangle([1, 4, 5], [next[0], next[1], next[2]], 0));
    roof.triangles
        .push(triangle([1, 5, 2], [next[0], next[2], next[3]], 0));
    let high = displace(&roof).unwrap();
    let map = roof.materials[0].map_height.as_deref().unwrap();
    let height = map.sample(0.0, 0.0) - map.mean();
    let ridge = high.vertices[1];
    assert!(
        ridge.x.abs() < 0.35 * height && ridge.z > 0.9 * height,
        "{ridge} {height}"
    );
    let eave = high.vertices[0] - roof.vertices[0];
    assert!(
        (eave - height * DVec3::new(-x, 0.0, x)).length() < 1e-12,
        "{eave}"
    );
}

#[test]
fn the_built_in_scenes_stay_closed() {
    for (name, patches) in [
        ("bowl-and-bunny", 6_000),
        ("cornell-relief", 8_000),
        ("fruit-platter", 6_000),
    ] {
        let options = LoadOptions {
            patches: Some(patches),
            ..LoadOptions::default()
        };
        let scene = load(name, &options).unwrap();
        let high = displace(&scene).unwrap();
        assert_eq!(high.dropped_degenerate, 0);
        assert!(high.materials.iter().all(|m| !m.has_relief()));
        let raised = |t: &&Triangle| scene.materials[t.material as usize].has_relief();
        let edges = edges(high.triangles.iter().filter(raised).copied());
        assert!(
            edges
                .iter()
                .all(|(&[a, b], &n)| n == 1 && edges.get(&[b, a]) == Some(&1)),
            "{name}"
        );
        let count = |scene: &Scene, wanted: bool| {
            scene
                .triangles
                .iter()
                .filter(|t| raised(t) == wanted)
                .count()
        };
        assert_eq!(
            count(&high, false),
            count(&scene, false),
            "the rest is untouched"
        );
        assert!(count(&high, true) > 10 * count(&scene, true));
    }
}

#[test]
#[ignore = "prints the sizes of the baselines"]
fn sizes() {
    for name in ["fruit-platter", "bowl-and-bunny", "cornell-relief"] {
        let scene = load(name, &LoadOptions::default()).unwrap();
        let before = std::time::Instant::now();
        let high = displace(&scene).unwrap();
        let raised = |t: &&Triangle| scene.materials[t.material as usize].has_relief();
        let count = |s: &Scene| s.triangles.iter().filter(raised).count();
        println!(
            "{name}: {} to {} triangles, of relief {} to {} ({:.1} each), {:.2} s, {} dropped",
            scene.triangles.len(),
            high.triangles.len(),
            count(&scene),
            count(&high),
            count(&high) as f64 / count(&scene) as f64,
            before.elapsed().as_secs_f64(),
            high.dropped_degenerate
        );
    }
}

/// A sheet that would take more memory than most machines have is refused before it does.
#[test]
fn too_fine_a_relief_is_refused() {
    let mut flat = sheet(relief(waves(8), 1.0), true);
    for triangle in &mut flat.triangles {
        triangle.uv = triangle.uv.map(|uv| uv.map(|x| 2048.0 * x));
    }
    let error = displace(&flat).unwrap_err().to_string();
    assert!(error.contains("height maps"), "{error}");
}
