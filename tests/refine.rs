//! Cutting coarse meshes: where, and that nothing of the scene changes.

mod common;

use std::collections::HashMap;

use common::Build;
use glam::{DVec3, Vec3};
use mesolux::render::{Joined, corner_irradiance};
use mesolux::scene::{Refinement, Scene};

/// A room of 12 triangles with a lamp of 2 close below its ceiling.
fn room() -> Scene {
    let mut build = Build::new();
    let lamp = build.material(0.2, 5.0);
    build.room(DVec3::ZERO, DVec3::new(4.0, 2.5, 3.0), 1, 0);
    build.quad(
        DVec3::new(1.5, 2.49, 1.2),
        DVec3::X,
        0.6 * DVec3::Z,
        (1, 1),
        lamp,
    );
    build.weld();
    for (e, triangle) in build.scene.triangles.iter_mut().enumerate() {
        triangle.uv = [[e as f32, 0.0], [e as f32 + 1.0, 0.0], [e as f32, 2.0]];
    }
    build.scene.clone()
}

fn areas(scene: &Scene) -> Vec<f64> {
    let area = |t| {
        let [a, b, c] = scene.corners(t);
        0.5 * (b - a).cross(c - a).length()
    };
    scene.triangles.iter().map(area).collect()
}

#[test]
fn cuts_follow_the_triangles() {
    let scene = room();
    let cut = scene.refined(&Refinement::default());
    let on_input = cut.on_input();
    println!(
        "{} triangles from {}",
        cut.triangles.len(),
        scene.triangles.len()
    );
    assert!(cut.triangles.len() > 3000);
    assert_eq!(cut.input_hash(), scene.hash());
    // The parts of each triangle take its area, its normal, its material and its texture.
    let mut parts = vec![0.0; scene.triangles.len()];
    for ((triangle, on), area) in cut.triangles.iter().zip(&on_input).zip(areas(&cut)) {
        let whole = &scene.triangles[on.triangle as usize];
        assert_eq!(triangle.material, whole.material);
        parts[on.triangle as usize] += area;
        for (k, &[v, w]) in on.corners.iter().enumerate() {
            let mix = |i: usize| {
                let [a, b, c] = whole.uv.map(|uv| f64::from(uv[i]));
                (1.0 - v - w) * a + v * b + w * c
            };
            for i in 0..2 {
                assert!((f64::from(triangle.uv[k][i]) - mix(i)).abs() < 1e-5);
            }
        }
    }
    for (part, whole) in parts.iter().zip(areas(&scene)) {
        assert!((part / whole - 1.0).abs() < 1e-12);
    }
    // The same from what a bake keeps.
    let again = scene.cut_as(&on_input);
    for (a, b) in cut.triangles.iter().zip(&again.triangles) {
        let corners = cut.corners(a).into_iter().zip(again.corners(b));
        assert!(corners.into_iter().all(|(a, b)| a.distance(b) < 1e-12));
    }
    // And back.
    for whole in [cut.uncut(), again.uncut()] {
        assert_eq!(whole.triangles, scene.triangles);
        assert_eq!(whole.vertices, scene.vertices);
        assert_eq!(whole.hash(), scene.hash());
    }
}

/// No corner lies on another triangle's edge: every edge is shared as the input's was.
#[test]
fn no_corner_lies_on_an_edge() {
    let count = |scene: &Scene| {
        let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
        for t in &scene.triangles {
            for k in 0..3 {
                let (a, b) = (t.vertices[k], t.vertices[(k + 1) % 3]);
                *edges.entry([a.min(b), a.max(b)]).or_default() += 1;
            }
        }
        edges
    };
    let scene = room();
    let cut = scene.refined(&Refinement::default());
    // The room is closed, and the lamp has a border.
    let border = |scene: &Scene| -> f64 {
        let length =
            |[a, b]: [u32; 2]| scene.vertices[a as usize].distance(scene.vertices[b as usize]);
        let alone = count(scene).into_iter().filter(|&(_, sides)| sides == 1);
        alone.map(|(edge, _)| length(edge)).sum()
    };
    assert!((border(&scene) - 3.2).abs() < 1e-12);
    assert!(
        (border(&cut) - border(&scene)).abs() < 1e-9,
        "{}",
        border(&cut)
    );
    assert!(count(&cut).values().all(|&sides| sides <= 2));
}

/// The ceiling is cut most finely along the border of what the lamp hides of it, and no more
/// triangles are made than asked for.
#[test]
fn cuts_are_finer_where_shadows_end() {
    let scene = room();
    let cut = scene.refined(&Refinement::default());
    // The lamp is 1 by 0.6, 1 cm below the ceiling.
    let (low, high) = (DVec3::new(1.5, 2.5, 1.2), DVec3::new(2.5, 2.5, 1.8));
    let mean = |at_border: bool| {
        let (mut sum, mut count) = (0.0, 0);
        for (triangle, area) in cut.triangles.iter().zip(areas(&cut)) {
            let [a, b, c] = cut.corners(triangle);
            let middle = (a + b + c) / 3.0;
            let outside = middle.distance(middle.clamp(low, high));
            let inside = (middle - low).min(high - middle).with_y(9.0).min_element();
            let off = if outside > 0.0 { outside } else { inside };
            if middle.y == 2.5 && (off < 0.01) == at_border {
                sum += area;
                count += 1;
            }
        }
        sum / f64::from(count)
    };
    println!(
        "{} triangles, at the border {:.1e}, elsewhere {:.1e}",
        cut.triangles.len(),
        mean(true),
        mean(false)
    );
    assert!(8.0 * mean(true) < mean(false));
    assert!(cut.triangles.len() < 30_000);
    let few = scene.refined(&Refinement {
        max_elements: 500,
        ..Refinement::default()
    });
    assert!((100..=500).contains(&few.triangles.len()));
    assert!(
        few.notes
            .iter()
            .any(|note| note.contains("--max-elements 500"))
    );
    let whole = scene.refined(&Refinement {
        max_elements: 1,
        ..Refinement::default()
    });
    assert_eq!(whole.triangles, scene.triangles);
    assert!(whole.notes.iter().any(|note| note.contains("not cut")));
    let fine = Refinement {
        element_size: Some(100.0),
        ..Refinement::default()
    };
    let kept = scene.refined(&fine);
    assert!(kept.triangles.len() < cut.triangles.len());
}

/// Twice as fine: edges half as long, and along the edges of the room a quarter.
#[test]
fn fineness_divides_sizes() {
    let scene = room();
    let corner = DVec3::new(4.0, 2.5, 3.0);
    let sizes = |fineness: f64| {
        let cut = scene.refined(&Refinement {
            fineness,
            ..Refinement::default()
        });
        let (mut longest, mut at_edges) = (0.0_f64, 0.0_f64);
        for triangle in &cut.triangles {
            let corners @ [a, b, c] = cut.corners(triangle);
            let length = a.distance(b).max(b.distance(c)).max(c.distance(a));
            longest = longest.max(length);
            let at_edge = |p: DVec3| {
                let off = p.min(corner - p).to_array();
                off.into_iter().filter(|&off| off < 1e-9).count() > 1
            };
            if corners.into_iter().filter(|&p| at_edge(p)).count() == 2 {
                at_edges = at_edges.max(length);
            }
        }
        println!(
            "fineness {fineness}: {} triangles, edges to {longest:.3}, in corners to {at_edges:.3}",
            cut.triangles.len()
        );
        (longest, at_edges)
    };
    let area: f64 = areas(&scene).iter().sum();
    let even = 2.0 * (area / 6000.0).sqrt();
    let (normal, fine) = (sizes(1.0), sizes(2.0));
    // A cut halves an edge, so that sizes fall in steps.
    assert!(normal.0 <= even && normal.0 > 0.5 * even);
    assert!(fine.0 <= 0.5 * even && fine.0 > 0.25 * even);
    assert!(normal.1 <= 0.5 * even && normal.1 > 0.25 * even);
    assert!(fine.1 <= 0.125 * even && fine.1 > 0.0625 * even);
}

/// Light that is linear over a plane comes back at all corners but those of its border, and bent
/// surfaces keep the light of each facet.
#[test]
fn linear_light_comes_back() {
    let mut build = Build::new();
    build.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (9, 7), 0);
    build.quad(DVec3::ZERO, DVec3::Y, DVec3::Z, (7, 5), 0);
    build.weld();
    let scene = &build.scene;
    let linear = |p: DVec3| Vec3::new(2.0 + p.x as f32, 3.0 - p.y as f32, 1.0);
    let light: Vec<Vec3> = (scene.triangles.iter())
        .map(|t| match scene.corners(t).map(|v| v.z) {
            [0.0, 0.0, 0.0] => linear(scene.corners(t).iter().sum::<DVec3>() / 3.0),
            _ => Vec3::splat(9.0),
        })
        .collect();
    let corners = corner_irradiance(scene, &light, Joined::Plane);
    let mut inside = 0;
    for (t, corners) in scene.triangles.iter().zip(&corners) {
        for (place, corner) in scene.corners(t).into_iter().zip(corners) {
            if place.z > 0.0 || scene.corners(t).iter().any(|v| v.z > 0.0) {
                assert_eq!(*corner, Vec3::splat(9.0), "a facet's own light");
            } else if (0.2..0.8).contains(&place.x) && (0.2..0.8).contains(&place.y) {
                assert!((*corner - linear(place)).abs().max_element() < 1e-5);
                inside += 1;
            }
        }
    }
    assert!(inside > 50);
}
