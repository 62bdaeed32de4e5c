//! Light maps: charts that do not overlap, seams that agree, and light against the path tracer at
//! texels.

mod common;

use std::collections::HashMap;

use common::{Build, assert_silent, lit};
use glam::{DVec2, DVec3, Vec3};
use mesolux::bake::quality::Quality;
use mesolux::export::light_map::LightMap;
use mesolux::export::map_files::{MapFile, Page, Part};
use mesolux::export::surface::{PADDING, Surface, Texels};
use mesolux::export::texels::{Texel, borders, quarters};
use mesolux::path_tracer::PathTracer;
use mesolux::render::Light;
use mesolux::scene::{LoadOptions, Refinement, Scene, displace, load};
use rayon::prelude::*;

fn scene(name: &str, patches: Option<usize>) -> Scene {
    let options = LoadOptions {
        patches,
        ..LoadOptions::default()
    };
    load(name, &options).expect("a built-in scene")
}

/// Bakes a scene, and finds its light map on pages of this size.
fn mapped(scene: &Scene, texels: Texels) -> (Surface, LightMap) {
    let lit = lit(scene, Quality::default());
    let surface = Surface::new(scene, texels, || true).expect("it is laid out");
    let map = LightMap::new(&surface, &lit.look(), &|_| true).expect("a light map");
    (surface, map)
}

/// Errors against the path tracer, of texels within charts and on their borders.
struct Errors {
    /// rms and bias over the mean, noise subtracted.
    inside: [f64; 2],
    border: [f64; 2],
}

/// At `count` texels of surfaces without relief and emission.
fn errors(surface: &Surface, map: &LightMap, traced: &Scene, count: usize, paths: u32) -> Errors {
    let tracer = PathTracer::new(traced).expect("it is traced");
    let scene = &surface.scene;
    let is_plain = |t: u32| {
        let material = &scene.materials[scene.triangles[t as usize].material as usize];
        !material.has_relief() && !material.emits()
    };
    let is_border = |t: usize| {
        let texel = &map.map.texels[t];
        let chart = |t: usize| surface.chart[map.map.texels[t].triangle as usize];
        let [x, y] = texel.at.map(i64::from);
        [[1, 0], [-1, 0], [0, 1], [0, -1]].iter().any(|[i, j]| {
            let found = map.map.find(texel.page, x + i, y + j);
            found.is_none_or(|other| {
                chart(other) != chart(t) || map.map.texels[other].distance > 0.0
            })
        })
    };
    let inside = |t: &usize| map.map.texels[*t].distance == 0.0;
    let all: Vec<usize> = (0..map.light.len())
        .filter(|t| inside(t) && is_plain(map.map.texels[*t].triangle))
        .collect();
    let (border, within): (Vec<usize>, Vec<usize>) = all.iter().partition(|&&t| is_border(t));
    let mean: f64 = (all.iter())
        .map(|&t| f64::from(Part::Global.of(&map.light[t]).element_sum()) / 3.0)
        .sum::<f64>()
        / all.len() as f64;
    let of = |texels: &[usize]| -> [f64; 2] {
        let step = 0.618_033_988_749_895;
        // Its square and its bias, of a texel that a place is open of.
        let error = |i: usize| -> Option<[f64; 2]> {
            let t = texels[((i as f64 * step).fract() * texels.len() as f64) as usize];
            let texel = &map.map.texels[t];
            let found = Part::Global.of(&map.light[t]).element_sum() / 3.0;
            // Two independent halves, so that noise falls out of their product; of the places that
            // are not beneath what stands there.
            let (mut halves, mut open) = ([0.0; 2], 0.0);
            for (k, weights) in quarters(surface, texel).into_iter().enumerate() {
                let place = surface.place(texel.triangle as usize, weights);
                let of = |half: usize| {
                    let seed = (i * 8 + k * 2 + half) as u64;
                    let (p, n) = (place.position, place.normal);
                    let light = tracer.irradiance(p, n, paths, seed, Light::Global).0;
                    f64::from(light.element_sum()) / 3.0
                };
                let found = [of(0), of(1)];
                if found != [0.0; 2] {
                    halves = [halves[0] + found[0], halves[1] + found[1]];
                    open += 1.0;
                }
            }
            let halves = halves.map(|half| half / open);
            let [a, b] = halves.map(|half| f64::from(found) - half);
            (open > 0.0).then_some([a * b, 0.5 * (a + b)])
        };
        let errors: Vec<_> = (0..count).into_par_iter().filter_map(error).collect();
        let [square, bias] = [0, 1].map(|k| errors.iter().map(|of| of[k]).sum::<f64>());
        let seen = errors.len() as f64;
        [(square / seen).max(0.0).sqrt() / mean, bias / seen / mean]
    };
    Errors {
        inside: of(&within),
        border: of(&border),
    }
}

/// What interpolation gives on both sides of the seams: rms of the difference over the mean light.
fn seams(surface: &Surface, map: &LightMap) -> (usize, f64) {
    let scene = &surface.scene;
    let mut sides: HashMap<[u32; 2], Vec<(usize, usize)>> = HashMap::new();
    for (t, k) in borders(surface) {
        let [a, b] = [k, (k + 1) % 3].map(|k| scene.triangles[t].vertices[k]);
        sides.entry([a.min(b), a.max(b)]).or_default().push((t, k));
    }
    let at = |t: usize, k: usize, along: f64| -> Option<Vec3> {
        let ends = [k, (k + 1) % 3].map(|k| surface.texel(t, k));
        let place: DVec2 = ends[0] + along * (ends[1] - ends[0]);
        let four = map.map.between(surface.page[t]?, place);
        four.into_iter()
            .try_fold(Vec3::ZERO, |sum, (texel, weight)| {
                Some(sum + Part::Global.of(&map.light[texel?]) * weight as f32)
            })
    };
    let (mut square, mut mean, mut count) = (0.0, 0.0, 0);
    for pair in sides.values() {
        let &[(t, k), (u, l)] = pair.as_slice() else {
            continue;
        };
        let normals = |t: usize, k: usize| [k, (k + 1) % 3].map(|k| surface.normals[t][k]);
        let ([a, b], [c, d]) = (normals(t, k), normals(u, l));
        // The surface is smooth there: it has one light.
        if a.dot(d).min(b.dot(c)) < 0.999 {
            continue;
        }
        for i in 0..8 {
            let along = (f64::from(i) + 0.5) / 8.0;
            if let (Some(one), Some(other)) = (at(t, k, along), at(u, l, 1.0 - along)) {
                square += f64::from((one - other).length_squared()) / 3.0;
                mean += f64::from((one + other).element_sum()) / 6.0;
                count += 1;
            }
        }
    }
    let number = f64::from(count);
    (count as usize, (square / number).sqrt() / (mean / number))
}

/// No texel within a chart is in another; charts keep their distance.
fn check_layout(surface: &Surface, least_used: f64) {
    let pages = surface.pages;
    let mut owner: HashMap<(u32, i64, i64), u32> = HashMap::new();
    let mut covered = 0;
    let reach = i64::from(PADDING);
    for (t, page) in surface.page.iter().enumerate() {
        let Some(page) = *page else {
            continue;
        };
        let corners = [0, 1, 2].map(|k| surface.texel(t, k));
        let low = corners.iter().fold(DVec2::INFINITY, |low, &c| low.min(c));
        let high = corners
            .iter()
            .fold(DVec2::NEG_INFINITY, |high, &c| high.max(c));
        for y in low.y.floor() as i64..high.y.ceil() as i64 {
            for x in low.x.floor() as i64..high.x.ceil() as i64 {
                let p = DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
                let side = |k: usize| {
                    let (a, b) = (corners[k], corners[(k + 1) % 3]);
                    (b - a).perp_dot(p - a)
                };
                let sides = [0, 1, 2].map(side);
                if sides.iter().all(|&s| s > 0.0) || sides.iter().all(|&s| s < 0.0) {
                    let known = owner.insert((page, x, y), surface.chart[t]);
                    assert!(known.is_none_or(|chart| chart == surface.chart[t]));
                    covered += 1;
                }
            }
        }
    }
    // Padding: between the texels of two charts.
    for (&(page, x, y), &chart) in &owner {
        assert!(x >= reach && y >= reach);
        assert!(x < i64::from(pages.width) - reach && y < i64::from(pages.height) - reach);
        for j in -2 * reach + 1..2 * reach {
            for i in -2 * reach + 1..2 * reach {
                let other = owner.get(&(page, x + i, y + j));
                assert!(
                    other.is_none_or(|&other| other == chart),
                    "{x}, {y}: {i}, {j}"
                );
            }
        }
    }
    let all = f64::from(pages.width) * f64::from(pages.height) * f64::from(pages.count);
    let used = f64::from(covered) / all;
    println!(
        "{} charts, {:.1} % of the texels used",
        pages.charts,
        100.0 * used
    );
    assert!(used >= least_used);
}

/// rms of each colour. Measured: 0.68, 1.02 and 1.04 %.
const BC6H: f32 = 0.02;

/// rms within charts and on their borders. Measured: 0.15 and 0.49 %; 0.51 and 0.84 %.
const CORNELL_BOX: [f64; 2] = [0.003, 0.01];
const BOWL_AND_BUNNY: [f64; 2] = [0.01, 0.015];

/// Measured: 0.88 % with 512 texels a side, where most charts of the bunny are a few texels wide.
const SEAMS: f64 = 0.01;

fn assert_errors(errors: &Errors, limits: [f64; 2]) {
    let [inside, border] = [errors.inside, errors.border].map(|[rms, bias]| {
        println!("rms {:.2} %, bias {:+.2} %", 100.0 * rms, 100.0 * bias);
        rms
    });
    assert!(inside <= limits[0] && border <= limits[1]);
}

#[test]
fn cornell_box() {
    let whole = scene("cornell-box", None);
    let cut = whole.refined(&Refinement::default());
    let (surface, map) = mapped(&cut, Texels::Page(256));
    check_layout(&surface, 0.6);
    let (count, seam) = seams(&surface, &map);
    // All its edges are creases.
    assert!(count == 0 && seam.is_nan());
    let found = errors(&surface, &map, &whole, 400, 1000);
    assert_errors(&found, CORNELL_BOX);
    assert_silent();
}

/// A sheet that faces up, as a table of one quad: the floor beneath it sees the sheet's back, and
/// has the light that comes from beside it. And a map that is stopped: refused early, kept later.
#[test]
fn light_comes_in_beneath_a_sheet() {
    let mut build = Build::new();
    let grey = build.material(0.5, 0.0);
    let lamp = build.material(0.0, 5.0);
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    build.room(DVec3::ZERO, DVec3::ONE, 6, grey);
    build.quad(DVec3::new(0.3, 0.3, 0.3), 0.4 * z, 0.4 * x, (3, 3), grey);
    build.quad(DVec3::new(0.4, 0.99, 0.4), 0.2 * x, 0.2 * z, (1, 1), lamp);
    build.weld();
    let lit = lit(&build.scene, Quality::Draft);
    let lit = lit.look();
    let surface = Surface::new(&build.scene, Texels::Page(64), || true).expect("it is laid out");
    let map = LightMap::new(&surface, &lit, &|_| true).expect("a light map");
    let beneath = |texel: &Texel| {
        let place = surface.place(texel.triangle as usize, texel.weights);
        let p = place.position;
        let is_floor = place.normal.dot(y) > 0.999 && p.y < 0.01;
        is_floor && (p - DVec3::new(0.5, 0.0, 0.5)).abs().max_element() < 0.1
    };
    let found: Vec<f32> = (map.map.texels.iter().zip(&map.light))
        .filter(|(texel, _)| beneath(texel))
        .map(|(_, light)| light.indirect.x)
        .collect();
    let mean = map.light.iter().map(|l| l.indirect.x).sum::<f32>() / map.light.len() as f32;
    let least = found.iter().copied().fold(f32::INFINITY, f32::min);
    println!(
        "{} texels beneath: {least:.3} at least of {mean:.3} in the mean",
        found.len()
    );
    assert!(found.len() > 4 && least > 0.2 * mean);

    assert!(LightMap::new(&surface, &lit, &|_| false).is_err());
    let late = map.looked_at - 1;
    let stopped = LightMap::new(&surface, &lit, &|looked_at| looked_at < late).expect("kept");
    assert!(stopped.stopped);
    let dark = |map: &LightMap| map.light.iter().filter(|l| l.indirect.x == 0.0).count();
    assert_eq!(dark(&stopped), dark(&map));
    assert_silent();
}

/// A page as KTX 2 is what Khronos' layout says, and an independent decoder of BC6H finds the light
/// that was written, beyond the last whole block too.
#[test]
fn ktx2_holds_the_light() {
    let (width, height) = (37, 22);
    let light = |x: u32, y: u32| {
        let (x, y) = (x as f32 / 37.0, y as f32 / 22.0);
        Vec3::new(3.0 * x * x + 0.5, 2.0 + y, 0.3 + 0.3 * x * y)
    };
    let texels = (0..height).flat_map(|y| (0..width).map(move |x| light(x, y)));
    let page = Page {
        width,
        height,
        irradiance: texels.collect(),
    };
    let file = page.encoded(MapFile::Ktx2, 1.0).expect("encoded");
    let read = ktx2::Reader::new(&file).expect("a KTX 2 file");
    let header = read.header();
    assert_eq!(header.format, Some(ktx2::Format::BC6H_UFLOAT_BLOCK));
    assert_eq!((header.pixel_width, header.pixel_height), (width, height));
    assert_eq!(
        read.transfer_function(),
        Some(ktx2::TransferFunction::Linear)
    );
    assert_eq!(read.levels().len(), 1);
    let blocks = read.levels().next().expect("a level").data;
    let [across, down] = [width, height].map(|size| size.div_ceil(4) as usize);
    assert_eq!(blocks.len(), 16 * across * down);
    let (mut square, mut sum) = (Vec3::ZERO, Vec3::ZERO);
    for (b, block) in blocks.chunks_exact(16).enumerate() {
        let mut texels = [0.0_f32; 48];
        bcdec_rs::bc6h_float(block, &mut texels, 12, false);
        for (i, found) in texels.as_chunks::<3>().0.iter().enumerate() {
            let [x, y] = [4 * (b % across) + i % 4, 4 * (b / across) + i / 4].map(|at| at as u32);
            if x < width && y < height {
                let wanted = light(x, y);
                square += (Vec3::from_array(*found) - wanted).powf(2.0);
                sum += wanted * wanted;
            }
        }
    }
    let rms = (square / sum).map(f32::sqrt);
    println!("BC6H: rms {:.2} % of each colour", 100.0 * rms);
    assert!(rms.max_element() <= BC6H);
}

#[test]
fn bowl_and_bunny() {
    let scene = scene("bowl-and-bunny", Some(20_000));
    let (surface, map) = mapped(&scene, Texels::Page(512));
    check_layout(&surface, 0.6);
    let (count, seam) = seams(&surface, &map);
    println!("{count} places on seams: {:.2} %", 100.0 * seam);
    let traced = displace(&scene).expect("displaced");
    let found = errors(&surface, &map, &traced, 400, 500);
    assert_errors(&found, BOWL_AND_BUNNY);
    assert!(seam <= SEAMS);
    assert_silent();
}
