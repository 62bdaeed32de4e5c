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

/// Height of 1 in texels: flanks of bricks and ridges rise by as many within one texel.
const RELIEF: f64 = 24.0;

/// Heights within which a decision may differ: heights of 1 and products of them are right to 6e-8 each, places to 1e-7
/// of a texel on flanks of 1 a texel.
const DECISION_TOLERANCE: f64 = 1e-6;
/// Texels along the way, of a hit that is not grazing: t is rounded by 3e-8 of up to 1,500 texels, 4.5e-5, besides what
/// the place is off.
const APART_TOLERANCE: f64 = 1e-4;
/// Texels over the map, of the same: a height off by 1e-7 over a fall of at least GRAZING.
const PLACE_TOLERANCE: f64 = 1e-5;
/// Where the fall goes to 0 a height off by d moves the hit by the root of d over the patch's curvature: √1e-6.
const APART_GRAZING: f64 = 1e-3;
/// Heights: rounding of the sum of four products of heights up to 1.
const SURFACE_TOLERANCE: f64 = 1e-6;
/// Heights, and as many times RELIEF in texels: t's rounding, as above, on falls of up to 1 a texel.
const RAY_TOLERANCE: f64 = 1e-5;

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
    /// Of the same, between the places over the map, in texels.
    place: f64,
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

/// A way over the map, less the periods that it may have too much.
fn nearest(way: DVec2) -> DVec2 {
    way - way.round()
}

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
            let (i, j) = (gpu.cell % map.width, gpu.cell / map.width);
            let local = gpu.local.as_dvec2();
            let uv = DVec2::new(
                (f64::from(i) + 0.5 + local.x) / size.x,
                1.0 - (f64::from(j) + 0.5 + local.y) / size.y,
            );
            let apart = (f64::from(gpu.t) - hit.t).abs() * length;
            let way = to - from;
            let fall = (hit.gradient.dot(way.truncate()) - way.z) / length;
            if fall > GRAZING || hit.t == 0.0 {
                c.clear += 1;
                c.most = c.most.max(apart);
                c.sum += apart;
                let there = (from + hit.t * way).truncate();
                c.place = c.place.max((nearest(there - uv) * size).length());
            } else {
                c.grazing += 1;
                c.most_grazing = c.most_grazing.max(apart);
            }
            let surface = map.sample(uv.x, uv.y);
            c.off_surface = c.off_surface.max((f64::from(gpu.height) - surface).abs());
            if hit.t > 0.0 {
                let on_ray = from + f64::from(gpu.t) * way;
                c.off_ray = c.off_ray.max((on_ray.z - surface).abs());
                let shift = nearest(on_ray.truncate() - uv);
                c.off_ray = c.off_ray.max((shift * size).length() / RELIEF);
            }
            // At the edge of a cell the hit may be given to its neighbour.
            if local.cmpgt(DVec2::splat(1e-4)).all() && local.cmplt(DVec2::splat(1.0 - 1e-4)).all()
            {
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

/// Compares, prints and judges. Marches with level 0 alone too, to tell what the pyramid saves.
fn check(device: &Arc<Device>, name: &str, map: &HeightMap, rays: &[[Vec3; 2]]) {
    let found = run(device, map, rays);
    let c = compare(map, rays, &found);
    let flat = run_to(device, map, rays, 0);
    let flat_steps: u64 = flat.iter().map(|hit| u64::from(hit.steps)).sum();
    let count = rays.len() as f64;
    println!(
        "{name}: {} rays, {} hit, other decisions {} (doubt {:.1e} heights)",
        rays.len(),
        c.hits,
        c.other_decisions,
        c.doubt
    );
    println!(
        "  apart {:.1e} texels at most, {:.1e} on average by t, {:.1e} by place; {} grazing: {:.1e} at most",
        c.most,
        c.sum / c.clear.max(1) as f64,
        c.place,
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
        flat_steps as f64 / count,
        c.cells as f64 / count
    );
    assert!(c.doubt < DECISION_TOLERANCE, "{name}: a wrong decision");
    // Were decisions lost in number, rounding would not be the reason.
    assert!(c.other_decisions <= rays.len() / 10_000, "{name}");
    assert!(c.place < PLACE_TOLERANCE, "{name}: {:.1e}", c.place);
    assert!(
        c.most < APART_TOLERANCE && c.most_grazing < APART_GRAZING,
        "{name}"
    );
    assert!(
        c.off_surface < SURFACE_TOLERANCE && c.off_ray < RAY_TOLERANCE,
        "{name}"
    );
    assert!(c.gradient < APART_TOLERANCE, "{name}");
    for (hit, flat) in found.iter().zip(&flat) {
        // The pyramid changes where the march stops over for its sums, not what it finds.
        assert_eq!(
            hit.cell == NONE,
            flat.cell == NONE,
            "{name}: {hit:?} {flat:?}"
        );
    }
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
        check(&device, name, &map, &rays);
    }
    assert_silent();
}

/// Nearly along the surface, over many periods, to all sides.
#[test]
fn long_ways() {
    let device = device();
    let mut random = Random(2);
    let low_ridges = HeightMap {
        values: ridges().values.iter().map(|h| 0.3 * h).collect(),
        ..ridges()
    };
    let wide = map(4096, 48, |column, row| {
        if (column + 7 * row) % 1024 < 2 {
            1.0
        } else {
            0.0
        }
    });
    let spike = map(
        64,
        48,
        |column, row| if (column, row) == (63, 47) { 1.0 } else { 0.0 },
    );
    for (name, map, high) in [
        ("long ways over ridges", low_ridges, 0.4),
        ("over noise", noise(), 1.0),
        ("over a spike", spike, 1.0),
        ("over a wide map", wide, 1.0),
    ] {
        let rays: Vec<_> = (0..20_000)
            .map(|_| {
                let (sin, cos) = random.range(0.0, std::f64::consts::TAU).sin_cos();
                let run = random.range(100.0, 1500.0);
                let x = random.range(-3.0, 3.0);
                let y = random.range(-3.0, 3.0);
                let from = Vec3::new(x as f32, y as f32, random.range(0.5 * high, high) as f32);
                let to = DVec3::new(
                    x + run * cos / f64::from(map.width),
                    y + run * sin / f64::from(map.height),
                    random.range(0.1 * high, high),
                );
                [from, to.as_vec3()]
            })
            .collect();
        check(&device, name, &map, &rays);
    }
    assert_silent();
}

const ODD_SIZES: [(u32, u32); 9] = [
    (1, 1),
    (1, 5),
    (6, 1),
    (2, 2),
    (3, 2),
    (7, 13),
    (16, 4),
    (17, 33),
    (5, 64),
];

fn rough((width, height): (u32, u32), random: &mut Random) -> HeightMap {
    let values: Vec<_> = (0..width * height).map(|_| random.unit() as f32).collect();
    map(width, height, |column, row| {
        values[(row * width + column) as usize]
    })
}

#[test]
fn maps_of_any_size() {
    let device = device();
    let mut random = Random(3);
    for size in ODD_SIZES {
        let map = rough(size, &mut random);
        let rays = random_rays(&map, 5_000, &mut random);
        check(&device, &format!("{size:?}"), &map, &rays);
    }
    assert_silent();
}

/// Along columns, along rows, upright, and at 45° through corners; from places on and between the texels' centres.
#[test]
fn rays_along_axes_and_through_corners() {
    let device = device();
    let mut random = Random(4);
    for size in [(8, 4), (16, 16), (1, 1), (1, 8)] {
        let map = rough(size, &mut random);
        let half_texel = Vec3::new(0.5 / size.0 as f32, 0.5 / size.1 as f32, 1.0);
        let ways = [
            [0, 0],
            [9, 0],
            [-9, 0],
            [0, 9],
            [0, -9],
            [12, 12],
            [-12, 12],
            [12, -12],
            [-12, -12],
            [1, 40],
            [-40, 1],
        ];
        let mut rays = Vec::new();
        for i in -3..2 * size.0 as i32 + 3 {
            for j in -3..2 * size.1 as i32 + 3 {
                for way in ways {
                    for (high, low) in [(1.1, -0.1), (0.9, 0.3), (0.2, 1.2), (0.6, 0.6)] {
                        let at = |i: i32, j: i32, z| half_texel * Vec3::new(i as f32, j as f32, z);
                        rays.push([at(i, j, high), at(i + way[0], j + way[1], low)]);
                    }
                }
            }
        }
        check(&device, &format!("along axes {size:?}"), &map, &rays);
    }
    assert_silent();
}

#[test]
fn starts_on_and_below_the_surface() {
    let device = device();
    // Sizes and heights of few binary digits: what is on the surface is so exactly.
    let map = map(8, 4, |column, row| {
        [0.0, 0.25, 1.0, 0.5][((column + 3 * row) % 4) as usize]
    });
    let mut rays = Vec::new();
    let mut expected = Vec::new();
    let mut add = |from: Vec3, way: Vec3, t: Option<f32>| {
        rays.push([from, from + way]);
        expected.push(t);
    };
    for row in 0..4 {
        for column in 0..8 {
            let h = map.values[(row * 8 + column) as usize];
            let (u, v) = ((column as f32 + 0.5) / 8.0, 1.0 - (row as f32 + 0.5) / 4.0);
            let on = Vec3::new(u, v, h);
            add(on, Vec3::Z, None);
            add(on, Vec3::new(0.5, 0.25, 50.0), None);
            add(on, -Vec3::Z, Some(0.0));
            add(on, Vec3::new(-0.25, 0.5, -50.0), Some(0.0));
            add(on, Vec3::ZERO, None);
            add(on + Vec3::Z, -2.0 * Vec3::Z, Some(0.5));
            for way in [
                Vec3::ZERO,
                Vec3::Z,
                Vec3::new(0.3, 0.2, 5.0),
                Vec3::new(-2.0, 0.0, 0.0),
            ] {
                add(on - 0.125 * Vec3::Z, way, Some(0.0));
            }
        }
    }
    let found = run(&device, &map, &rays);
    for ((ray, hit), expected) in rays.iter().zip(&found).zip(expected) {
        let t = (hit.cell != NONE).then_some(hit.t);
        // 0 is 0; elsewhere t has a rounding of its own.
        let same = match (t, expected) {
            (Some(t), Some(expected)) => (t - expected).abs() <= expected * f32::EPSILON,
            _ => t == expected,
        };
        assert!(same, "{ray:?}: {hit:?}, not {expected:?}");
        let cpu = march(&map, ray[0].as_dvec3(), ray[1].as_dvec3()).0;
        assert_eq!(cpu.map(|hit| hit.t as f32), expected, "{ray:?}");
    }
    // On a flat map, along it, over its borders.
    let flat = self::map(5, 3, |_, _| 0.7);
    let along = [Vec3::new(0.1, 0.9, 0.7), Vec3::new(-7.3, 4.2, 0.7)];
    let into = [
        Vec3::new(0.1, 0.9, 0.7),
        Vec3::new(-7.3, 4.2, 0.7_f32.next_down()),
    ];
    let found = run(&device, &flat, &[along, into]);
    assert_eq!(found[0].cell, NONE);
    assert_ne!(found[1].cell, NONE);
    assert_silent();
}

/// Share of a sinusoid A cos(2πx / λ) in shadow, A = 0.1 λ, by the light's elevation: closed form, horizons cast and
/// slopes turned away together.
const SINUSOID_SHADOW: [(f64, f64); 3] = [
    (10.0, 0.669_353_760_901_578_8),
    (20.0, 0.472_178_077_935_689),
    (30.0, 0.194_740_188_699_840_75),
];

#[test]
fn shadows_of_a_sinusoid() {
    let device = device();
    const WIDTH: u32 = 1024;
    const RAYS: u32 = 100_000;
    // Wavelengths. Rounded ways from the surface would shadow themselves; a lift of δ moves a shadow's edge where the slope
    // turns away by √(2δ / |h″|), 2e-4.
    const LIFT: f64 = 1e-7;
    let height = |u: f64| 0.1 * (std::f64::consts::TAU * u).cos();
    let map = map(WIDTH, 1, |column, _| {
        height((f64::from(column) + 0.5) / f64::from(WIDTH)) as f32
    });
    for (elevation, exact) in SINUSOID_SHADOW {
        let (sin, cos) = f64::to_radians(elevation).sin_cos();
        let way = DVec3::new(cos, 0.0, sin) * (0.25 / sin);
        let rays: Vec<_> = (0..RAYS)
            .map(|i| (f64::from(i) + 0.5) / f64::from(RAYS))
            .map(|u| DVec3::new(u, 0.5, map.sample(u, 0.5) + LIFT))
            .map(|from| [from.as_vec3(), (from + way).as_vec3()])
            .collect();
        let hits = run(&device, &map, &rays);
        let shadowed = hits.iter().filter(|hit| hit.cell != NONE).count();
        let share = shadowed as f64 / f64::from(RAYS);
        println!("sinusoid at {elevation} deg: {share:.5}, exact {exact:.5}");
        assert!((share - exact).abs() < 0.005);
    }
    assert_silent();
}

/// Every maximum against all texels that it stands for, and the layout that the shader counts on.
#[test]
fn pyramid_holds_the_maxima() {
    let mut random = Random(5);
    for size in ODD_SIZES {
        let map = rough(size, &mut random);
        let pyramid = HeightPyramid::new(&map);
        let (width, height) = size;
        assert_eq!(pyramid.values[..map.values.len()], map.values);
        let mut offset = map.values.len();
        for level in 0..=pyramid.top() {
            let (columns, rows) = pyramid.blocks(level);
            assert_eq!(pyramid.offsets[level as usize], offset);
            for row in 0..rows {
                for column in 0..columns {
                    // One more than the cells: their far corners.
                    let texels = |at: u32, size: u32| at << level..=size.min((at + 1) << level);
                    let highest = texels(row, height)
                        .flat_map(|j| texels(column, width).map(move |i| (i, j)))
                        .map(|(i, j)| map.values[((j % height) * width + i % width) as usize])
                        .fold(f32::NEG_INFINITY, f32::max);
                    let held = pyramid.values[offset + (row * columns + column) as usize];
                    assert_eq!(held, highest, "{size:?}, level {level}: ({column}, {row})");
                }
            }
            offset += (columns * rows) as usize;
        }
        assert_eq!(pyramid.values.len(), offset);
        assert_eq!(pyramid.blocks(pyramid.top()), (1, 1));
    }
}
