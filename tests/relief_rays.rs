//! Rays over height maps: the march with the pyramid on the device against the walk from cell to cell, and shadows of a
//! sinusoid against their exact share.

mod common;

use std::sync::Arc;

use common::{assert_silent, device};
use glam::{DVec2, DVec3, Vec3};
use mesolux::constants::NONE;
use mesolux::meso::HeightPyramid;
use mesolux::passes::relief_rays::ReliefRays;
use mesolux::passes::types::{HeightHit, HeightRay, HeightTile};
use mesolux::reference::relief_rays::{clearance, march};
use mesolux::scene::HeightMap;
use mesolux::vk::Device;

fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> HeightMap {
    HeightMap {
        path: "test".into(),
        width,
        height,
        values: (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| value(column, row))
            .collect(),
    }
}

/// SplitMix64, Steele et al. 2014.
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }
}

/// Hits of segments over one map.
fn run(device: &Arc<Device>, map: &HeightMap, rays: &[[Vec3; 2]]) -> Vec<HeightHit> {
    run_to(device, map, rays, u32::MAX)
}

/// The same with the levels of the pyramid up to `top` alone.
fn run_to(device: &Arc<Device>, map: &HeightMap, rays: &[[Vec3; 2]], top: u32) -> Vec<HeightHit> {
    let pyramid = HeightPyramid::new(map);
    // Something before the tile, as other materials' pyramids are.
    const BEFORE: u32 = 7;
    let mut values = vec![f32::INFINITY; BEFORE as usize];
    values.extend(&pyramid.values);
    let mut tile = HeightTile::new(&pyramid, BEFORE);
    tile.top = tile.top.min(top);
    let rays: Vec<_> = rays
        .iter()
        .map(|&[from, to]| HeightRay { from, tile: 0, to })
        .collect();
    ReliefRays::new(device)
        .and_then(|pass| pass.run(&[tile], &values, &rays))
        .expect("the device marches")
}

/// A running bond of bricks with flat tops; the mortar lies deep, and its flanks are one texel wide.
fn bricks() -> HeightMap {
    map(256, 256, |column, row| {
        let course = row / 32;
        let along = (column + 32 * (course % 2)) % 64;
        if row % 32 < 4 || along < 4 { 0.0 } else { 1.0 }
    })
}

/// Value noise in five octaves.
fn noise() -> HeightMap {
    let lattice = |octave: u32, i: u32, j: u32| {
        Random(u64::from(octave) << 40 | u64::from(i) << 20 | u64::from(j)).unit()
    };
    map(320, 192, |column, row| {
        let mut sum = 0.0;
        for octave in 0..5 {
            // The coarsest lattice has 5 × 3 knots.
            let size = 64 >> octave;
            let (i, j) = (column / size, row / size);
            let (columns, rows) = (320 / size, 192 / size);
            let smooth = |at: u32| {
                let f = f64::from(at % size) / f64::from(size);
                f * f * (3.0 - 2.0 * f)
            };
            let (x, y) = (smooth(column), smooth(row));
            let knot = |di, dj| lattice(octave, (i + di) % columns, (j + dj) % rows);
            let upper = knot(0, 0) + x * (knot(1, 0) - knot(0, 0));
            let lower = knot(0, 1) + x * (knot(1, 1) - knot(0, 1));
            sum += 0.5_f64.powi(octave as i32 + 1) * (upper + y * (lower - upper));
        }
        sum as f32
    })
}

/// Ridges one texel wide: across, along and slanting.
fn ridges() -> HeightMap {
    map(301, 211, |column, row| {
        if column % 43 == 7 || row % 37 == 11 || (column + 2 * row) % 101 == 5 {
            1.0
        } else {
            0.0
        }
    })
}

/// Height of 1 in texels: bricks and ridges as steep as 10 texels on one.
const RELIEF: f64 = 10.0;

/// From above all of the map to below it, or to or from a place among the heights; up to 85° from the normal in texels.
fn random_rays(map: &HeightMap, count: usize, random: &mut Random) -> Vec<[Vec3; 2]> {
    (0..count)
        .map(|i| {
            let angle = random.range(0.0, 85f64.to_radians());
            let (sin, cos) = random.range(0.0, std::f64::consts::TAU).sin_cos();
            let (from, to) = match i % 4 {
                0 | 1 => (1.2, -0.1),
                2 => (random.range(0.0, 1.0), 1.1),
                _ => (random.range(0.5, 1.1), random.range(0.0, 1.1)),
            };
            let run = RELIEF * f64::abs(to - from) * angle.tan();
            let start = DVec3::new(random.range(-3.0, 3.0), random.range(-3.0, 3.0), from);
            let end = DVec3::new(
                start.x + run * cos / f64::from(map.width),
                start.y + run * sin / f64::from(map.height),
                to,
            );
            [start.as_vec3(), end.as_vec3()]
        })
        .collect()
}

#[derive(Default)]
struct Compared {
    hits: usize,
    other_decisions: usize,
    /// Of other decisions: the height that decides, at most.
    doubt: f64,
    /// Between the hits, along the ray in texels: at most and on average, of those that meet the surface clearly.
    most: f64,
    sum: f64,
    clear: usize,
    /// The same of all others.
    grazing: usize,
    most_grazing: f64,
    /// Height of the hit above the surface, by the map and by the segment, at most.
    off_surface: f64,
    off_ray: f64,
    gradient: f64,
    steps: u64,
    cells: u64,
}

/// Rise of the ray against the surface, in heights a texel of the way, below which it grazes.
const GRAZING: f64 = 1e-2;

fn compare(map: &HeightMap, rays: &[[Vec3; 2]], found: &[HeightHit]) -> Compared {
    let mut c = Compared::default();
    let size = DVec2::new(f64::from(map.width), f64::from(map.height));
    for ([from, to], gpu) in rays.iter().zip(found) {
        let (from, to) = (from.as_dvec3(), to.as_dvec3());
        let (cpu, cells) = march(map, from, to);
        c.cells += u64::from(cells);
        c.steps += u64::from(gpu.steps);
        let texels = DVec3::new(size.x, size.y, RELIEF);
        let length = ((to - from) * texels).length();
        if let Some(hit) = cpu {
            c.hits += 1;
            if gpu.cell == NONE {
                c.other_decisions += 1;
                c.doubt = c.doubt.max(-clearance(map, from, to));
                continue;
            }
            let apart = (f64::from(gpu.t) - hit.t).abs() * length;
            let way = to - from;
            let fall = (hit.gradient.dot(way.truncate()) - way.z) / length;
            if fall > GRAZING || hit.t == 0.0 {
                c.clear += 1;
                c.most = c.most.max(apart);
                c.sum += apart;
            } else {
                c.grazing += 1;
                c.most_grazing = c.most_grazing.max(apart);
            }
            let (i, j) = (gpu.cell % map.width, gpu.cell / map.width);
            let local = gpu.local.as_dvec2();
            let uv = DVec2::new(
                (f64::from(i) + 0.5 + local.x) / size.x,
                1.0 - (f64::from(j) + 0.5 + local.y) / size.y,
            );
            let surface = map.sample(uv.x, uv.y);
            c.off_surface = c.off_surface.max((f64::from(gpu.height) - surface).abs());
            if hit.t > 0.0 {
                let on_ray = from + f64::from(gpu.t) * way;
                c.off_ray = c.off_ray.max((on_ray.z - surface).abs());
                let shift = (on_ray.truncate() - uv + 0.5).rem_euclid(DVec2::ONE) - 0.5;
                c.off_ray = c.off_ray.max((shift * size).length() / RELIEF);
            }
            if apart < 1e-3 {
                let error = (gpu.gradient.as_dvec2() - hit.gradient) / size;
                c.gradient = c.gradient.max(error.length());
            }
        } else if gpu.cell != NONE {
            c.other_decisions += 1;
            c.doubt = c.doubt.max(clearance(map, from, to));
        }
    }
    c
}

#[test]
fn a_million_rays_hit_as_the_twins() {
    let device = device();
    let mut random = Random(1);
    for (name, map) in [
        ("bricks", bricks()),
        ("noise", noise()),
        ("ridges", ridges()),
    ] {
        let rays = random_rays(&map, 333_334, &mut random);
        let found = run(&device, &map, &rays);
        let c = compare(&map, &rays, &found);
        let single = run_to(&device, &map, &rays, 0);
        let count = rays.len() as f64;
        let flat: u64 = single.iter().map(|hit| u64::from(hit.steps)).sum();
        println!(
            "{name}: {} rays, {} hit, other decisions {} (doubt {:.1e} heights)",
            rays.len(),
            c.hits,
            c.other_decisions,
            c.doubt
        );
        println!(
            "  apart {:.1e} texels at most, {:.1e} on average; {} grazing {:.1e} at most",
            c.most,
            c.sum / c.clear as f64,
            c.grazing,
            c.most_grazing
        );
        println!(
            "  off the surface {:.1e}, off the ray {:.1e} heights; gradient {:.1e} a texel",
            c.off_surface, c.off_ray, c.gradient
        );
        println!(
            "  steps {:.1} with the pyramid, {:.1} without; twin's cells {:.1}",
            c.steps as f64 / count,
            flat as f64 / count,
            c.cells as f64 / count
        );
    }
    assert_silent();
}
