//! What is known exactly: hits on the surface, shadows in closed form, the pyramid's maxima.

use glam::{DVec3, Vec3};
use mesolux::constants::NONE;
use mesolux::meso::HeightPyramid;
use mesolux::reference::relief_rays::march;

use crate::common::random::Random;
use crate::common::{assert_silent, device};
use crate::maps::{self, ODD_SIZES, rough};
use crate::run;

#[test]
fn starts_on_and_below_the_surface() {
    let device = device();
    // Sizes and heights of few binary digits: what is on the surface is so exactly.
    let map = maps::map(8, 4, |column, row| {
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
    let flat = maps::map(5, 3, |_, _| 0.7);
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

/// Share of a sinusoid A cos(2πx / λ) in shadow, A = 0.1 λ, by the light's elevation: closed form,
/// horizons cast and slopes turned away together.
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
    // Wavelengths. Rounded ways from the surface would shadow themselves; a lift of δ moves a
    // shadow's edge where the slope turns away by √(2δ / |h″|), 2e-4.
    const LIFT: f64 = 1e-7;
    let height = |u: f64| 0.1 * (std::f64::consts::TAU * u).cos();
    let map = maps::map(WIDTH, 1, |column, _| {
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
        // Measured: 2.9e-4.
        assert!((share - exact).abs() < 6e-4);
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
        let texel = |i: u32, j: u32| map.values[(j % height * width + i % width) as usize];
        for (j, i) in (0..height).flat_map(|j| (0..width).map(move |i| (j, i))) {
            let corners =
                [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)].map(|(i, j)| texel(i, j));
            let held = &pyramid.values[4 * (j * width + i) as usize..][..4];
            assert_eq!(held, corners, "{size:?}: ({i}, {j})");
        }
        let mut offset = 4 * map.values.len();
        for level in 0..=pyramid.top() {
            let (columns, rows) = pyramid.blocks(level);
            assert_eq!(pyramid.offsets[level as usize], offset);
            for row in 0..rows {
                for column in 0..columns {
                    // One more than the cells: their far corners.
                    let texels = |at: u32, size: u32| at << level..=size.min((at + 1) << level);
                    let highest = texels(row, height)
                        .flat_map(|j| texels(column, width).map(move |i| (i, j)))
                        .map(|(i, j)| texel(i, j))
                        .fold(f32::NEG_INFINITY, f32::max);
                    let held = pyramid.values[offset + (row * columns + column) as usize];
                    assert_eq!(held, highest, "{size:?}, level {level}: ({column}, {row})");
                }
            }
            offset += (columns * rows) as usize;
        }
        assert_eq!(pyramid.values.len(), offset.next_multiple_of(4));
        assert_eq!(pyramid.blocks(pyramid.top()), (1, 1));
    }
}
