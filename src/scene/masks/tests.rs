use std::collections::HashMap;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

use super::*;
use crate::scene::shapes::Shapes;

fn mask(side: u32, alpha: impl Fn(f64, f64) -> f64) -> AlphaMask {
    let at = |k: u32| (f64::from(k) + 0.5) / f64::from(side);
    let texel = |n: u32| alpha(at(n % side), 1.0 - at(n / side)) as f32;
    AlphaMask {
        map: Arc::new(AlphaMap {
            path: "mask".into(),
            width: side,
            height: side,
            alpha: (0..side * side).map(texel).collect(),
        }),
        factor: 1.0,
        cutoff: 0.5,
    }
}

/// A unit square of n × n cells whose texture repeats so often, shifted by a little.
fn sheet(n: u32, repeats: f64, shift: f64, mask: AlphaMask) -> Scene {
    let mut shapes = Shapes::new();
    let material = shapes.material(0.5, 1.0);
    let quad = shapes.quad(DVec3::ZERO, DVec3::X, DVec3::Y, (n, n), material);
    let mut scene = shapes.scene;
    for t in quad {
        let triangle = &mut scene.triangles[t];
        triangle.uv = triangle.vertices.map(|v| {
            let p = scene.vertices[v as usize] * repeats + shift;
            [p.x as f32, p.y as f32]
        });
    }
    scene.materials[material as usize].alpha_mask = Some(mask);
    scene
}

fn area(scene: &Scene) -> f64 {
    let of = |t: &Triangle| {
        let [a, b, c] = scene.corners(t);
        0.5 * (b - a).cross(c - a).z
    };
    scene.triangles.iter().map(of).sum()
}

fn cut(mut scene: Scene) -> Scene {
    scene.cut_masks().expect("few triangles");
    println!("{}", scene.notes.last().map_or("", String::as_str));
    for t in &scene.triangles {
        let [a, b, c] = scene.corners(t);
        assert!((b - a).cross(c - a).z > 0.0, "a piece keeps its front");
        for v in 0..3 {
            let (p, [u, w]) = (scene.corners(t)[v], t.uv[v]);
            let [o, _, _] = [t.uv[0], t.uv[1], t.uv[2]];
            assert!(p.is_finite() && u.is_finite() && w.is_finite() && o[0].is_finite());
        }
    }
    scene
}

/// Vertices that lie within an edge of a triangle, which they ought to be corners of.
fn t_junctions(scene: &Scene) -> usize {
    let mut used: Vec<u32> = scene.triangles.iter().flat_map(|t| t.vertices).collect();
    used.sort_unstable();
    used.dedup();
    let within = |a: DVec3, b: DVec3, p: DVec3| {
        let (way, to) = (b - a, p - a);
        let share = to.dot(way) / way.length_squared();
        let is_between = share > 1e-9 && share < 1.0 - 1e-9;
        is_between && to.cross(way).length() < 1e-9 * way.length()
    };
    (scene.triangles.par_iter())
        .map(|t| {
            let corners = scene.corners(t);
            let others = used.iter().filter(|v| !t.vertices.contains(v));
            let places = others.map(|&v| scene.vertices[v as usize]);
            let on = |p: DVec3| (0..3).any(|k| within(corners[k], corners[(k + 1) % 3], p));
            places.filter(|&p| on(p)).count()
        })
        .sum()
}

fn disc(x: f64, y: f64, r: f64) -> impl Fn(f64, f64) -> f64 {
    // One texel of 256 to fade.
    move |u, v| (0.5 + 256.0 * (r - (u - x).hypot(v - y))).clamp(0.0, 1.0)
}

/// Of a disc's area. Measured: 2.4e-5, and 2.5e-3 of one of ten texels, whose border turns within
/// a texel.
const DISC: f64 = 5e-5;
const SMALL_DISC: f64 = 5e-3;

#[test]
fn a_disc_has_its_area() {
    for (r, n) in [(0.3, 1), (0.3, 7), (0.04, 1), (0.04, 64)] {
        let scene = cut(sheet(n, 1.0, 0.0, mask(256, disc(0.503, 0.497, r))));
        let (found, exact) = (area(&scene), PI * r * r);
        let off = (found / exact - 1.0).abs();
        println!(
            "r {r}, {n} cells: {off:.6}, {} triangles",
            scene.triangles.len()
        );
        assert!(off < if r > 0.1 { DISC } else { SMALL_DISC });
        assert_eq!(t_junctions(&scene), 0);
    }
}

/// Measured: 7.4e-4.
const HARD: f64 = 1.5e-3;

#[test]
fn a_disc_of_hard_texels_is_round() {
    let hard = |u: f64, v: f64| f64::from((u - 0.5).hypot(v - 0.5) < 0.3);
    let scene = cut(sheet(3, 1.0, 0.0, mask(256, hard)));
    let off = (area(&scene) / (PI * 0.09) - 1.0).abs();
    println!("{off:.6}, {} triangles", scene.triangles.len());
    assert!(off < HARD);
    assert_eq!(t_junctions(&scene), 0);
}

/// A hole is where it was: no piece reaches into it by more than the tolerance.
#[test]
fn lines_move_by_the_tolerance_at_most() {
    let scene = cut(sheet(5, 1.0, 0.0, mask(256, disc(0.5, 0.5, 0.37))));
    let most = (scene.triangles.iter())
        .flat_map(|t| scene.corners(t))
        .map(|p| (p.truncate() - 0.5).length() - 0.37)
        .fold(f64::MIN, f64::max);
    println!("{:.3} texels", 256.0 * most);
    assert!(256.0 * most < TOLERANCE + 0.1);
}

/// Of its area. Measured: 3.8e-4, and 2.0e-2 where squares are single texels, whose corners meet.
const CHECKER: f64 = 8e-4;
const OF_TEXELS: f64 = 4e-2;

/// A checker of texels, repeated, its texels' borders on the edges of cells, on none, and beside.
#[test]
fn half_of_a_checker_stays() {
    let checker =
        |u: f64, v: f64| f64::from(((8.0 * u) as u32 + (8.0 * v) as u32).is_multiple_of(2));
    for (side, n, repeats, shift) in [
        (64, 1, 1.0, 0.0),
        (64, 4, 1.0, 0.0),
        (64, 8, 3.0, 0.0),
        (64, 5, 3.0, 0.113),
        (8, 4, 2.0, 1.0 / 16.0),
        (8, 3, 7.0, 0.25),
    ] {
        let scene = cut(sheet(n, repeats, shift, mask(side, checker)));
        let off = (area(&scene) / 0.5 - 1.0).abs();
        let count = scene.triangles.len();
        println!("{side} texels, {n} cells, {repeats} repeats: {off:.6}, {count} triangles");
        assert!(off < if side == 8 { OF_TEXELS } else { CHECKER });
        assert_eq!(t_junctions(&scene), 0);
    }
}

#[test]
fn stripes_that_repeat_are_straight() {
    let stripes = |_: f64, v: f64| f64::from((4.0 * v).fract() < 0.25);
    let scene = cut(sheet(2, 4.0, 0.01, mask(64, stripes)));
    let off = (area(&scene) / 0.25 - 1.0).abs();
    println!("{off:.6}, {} triangles", scene.triangles.len());
    assert!(off < 1e-6);
    // 16 stripes through 4 repeats, with a corner in each at either side.
    assert!(scene.triangles.len() < 400);
    assert_eq!(t_junctions(&scene), 0);
}

#[test]
fn an_opaque_mask_changes_nothing() {
    let scene = sheet(3, 2.0, 0.1, mask(16, |_, _| 0.6));
    let same = cut(scene.clone());
    assert_eq!(same.triangles, scene.triangles);
    assert_eq!(same.vertices, scene.vertices);
    assert!(same.materials.iter().all(|m| m.alpha_mask.is_none()));
    let gone = cut(sheet(3, 2.0, 0.1, mask(16, |_, _| 0.4)));
    assert!(gone.triangles.is_empty());
}

/// Of the area under bilinear noise whose lines bend within a texel. Measured: 7.1e-3. And of that
/// of the same noise on other cells. Measured: 1.4e-3.
const NOISE: f64 = 1.4e-2;
const SAME: f64 = 3e-3;

/// Noise, at each size of cell against texel: no line is lost, and neighbours agree.
#[test]
fn noise_leaves_no_crack() {
    let noise = |u: f64, v: f64| (0.5 + 0.5 * (91.0 * u + 57.0 * (13.0 * v).sin()).sin()).powi(2);
    let exact = {
        let fine = mask(64, noise);
        let n = 1500;
        let at = |k: usize| (k as f64 + 0.5) / n as f64 * 64.0;
        let opaque = (0..n * n).filter(|k| fine.is_opaque_at(DVec2::new(at(k % n), at(k / n))));
        opaque.count() as f64 / (n * n) as f64
    };
    let mut of_first = None;
    for n in [1, 3, 16, 64, 150] {
        let scene = cut(sheet(n, 1.0, 0.37, mask(64, noise)));
        let off = (area(&scene) / exact - 1.0).abs();
        let count = scene.triangles.len();
        println!("{n} cells: {off:.6}, {count} triangles of {}", 2 * n * n);
        assert!(off < NOISE);
        let first = *of_first.get_or_insert(area(&scene));
        assert!((area(&scene) / first - 1.0).abs() < SAME);
        if n <= 64 {
            assert_eq!(t_junctions(&scene), 0);
        }
    }
}

/// A neighbour without a mask gets the same corners on the edge that it shares.
#[test]
fn neighbours_without_a_mask_share_corners() {
    let mut scene = sheet(4, 1.0, 0.0, mask(256, disc(0.5, 0.5, 0.3)));
    for t in 0..8 {
        scene.triangles[t].material = 0;
    }
    let scene = cut(scene);
    assert_eq!(t_junctions(&scene), 0);
}

/// The back of a sheet is cut as its front.
#[test]
fn backs_are_cut_as_fronts() {
    let mut scene = sheet(3, 1.0, 0.0, mask(64, disc(0.5, 0.5, 0.3)));
    let backs: Vec<Triangle> = scene
        .triangles
        .iter()
        .map(super::super::sides::turned)
        .collect();
    scene.triangles.extend(backs);
    scene.cut_masks().expect("few triangles");
    let mut sides: HashMap<[u32; 3], usize> = HashMap::new();
    for t in &scene.triangles {
        let mut corners = t.vertices;
        corners.sort_unstable();
        *sides.entry(corners).or_default() += 1;
    }
    assert!(sides.values().all(|&count| count == 2));
}

#[test]
fn too_many_holes_are_refused() {
    let checker =
        |u: f64, v: f64| f64::from(((8.0 * u) as u32 + (8.0 * v) as u32).is_multiple_of(2));
    for repeats in [1e3, 1e9, 1e30] {
        let mut scene = sheet(1, repeats, 0.0, mask(8, checker));
        let refused = scene
            .cut_masks()
            .expect_err("millions of holes")
            .to_string();
        assert!(refused.contains("alpha masks would cut"), "{refused}");
    }
}

#[test]
fn an_image_gives_alpha_or_luminance() {
    let path = Path::new("x.png");
    let rgba = image::RgbaImage::from_pixel(2, 1, image::Rgba([255, 0, 0, 51]));
    assert_eq!(
        AlphaMap::from_image(path, rgba.clone().into(), None).alpha,
        [0.2; 2]
    );
    let channel = Some(crate::scene::maps::Channel::Red);
    assert_eq!(
        AlphaMap::from_image(path, rgba.into(), channel).alpha,
        [1.0; 2]
    );
    let grey = image::GrayImage::from_pixel(1, 1, image::Luma([51]));
    let alpha = AlphaMap::from_image(path, grey.into(), None).alpha[0];
    assert!((alpha - 0.2).abs() < 1e-6);
}
