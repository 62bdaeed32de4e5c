//! Rays over height maps: the march with the pyramid on the device against the walk from cell to
//! cell, and shadows of a sinusoid against their exact share.

#[path = "../common/mod.rs"]
mod common;
mod compare;
mod exact;
mod maps;

use std::sync::Arc;

use common::random::Random;
use common::{assert_silent, device};
use compare::{RELIEF, check};
use glam::{DVec3, Vec3};
use maps::{ODD_SIZES, bricks, map, noise, ridges, rough};
use mesolux::meso::{HeightPyramid, Horizons};
use mesolux::passes::relief_rays::ReliefRays;
use mesolux::passes::types::{HeightHit, HeightRay, HeightTile};
use mesolux::scene::HeightMap;
use mesolux::vk::Device;

/// Hits of segments over one map.
fn run(device: &Arc<Device>, map: &HeightMap, rays: &[[Vec3; 2]]) -> Vec<HeightHit> {
    run_to(device, map, rays, u32::MAX)
}

/// The same with the levels of the pyramid up to `top` alone.
fn run_to(device: &Arc<Device>, map: &HeightMap, rays: &[[Vec3; 2]], top: u32) -> Vec<HeightHit> {
    let pyramid = HeightPyramid::new(map);
    // Something before the tile, as other materials' pyramids are.
    const BEFORE: u32 = 8;
    let mut values = vec![f32::INFINITY; BEFORE as usize];
    values.extend(&pyramid.values);
    let mut tile = HeightTile::new((&pyramid, BEFORE), (&Horizons::unknown(), 0));
    tile.top = tile.top.min(top);
    let rays: Vec<_> = rays
        .iter()
        .map(|&[from, to]| HeightRay { from, tile: 0, to })
        .collect();
    let march = |levels| {
        ReliefRays::new(device, levels)
            .and_then(|pass| pass.run(&[tile], &values, &rays))
            .expect("the device marches")
    };
    let hits = march(true);
    if tile.top == 0 {
        // From cell to cell, which a pipeline of its own does.
        let bits = |hits: &[HeightHit]| bytemuck::cast_slice::<_, u8>(hits).to_vec();
        assert!(bits(&march(false)) == bits(&hits), "another hit");
    }
    hits
}

/// From above all of the map to below it, or to or from a place among the heights; up to 85° from
/// the normal in texels.
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

/// Along columns, along rows, upright, and at 45° through corners; from places on and between the
/// texels' centres.
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
