//! Hits of the device against the twin's.

use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};
use mesolux::constants::NONE;
use mesolux::passes::types::HeightHit;
use mesolux::reference::relief_rays::{clearance, march};
use mesolux::scene::HeightMap;
use mesolux::vk::Device;

use crate::{run, run_to};

/// Height of 1 in texels: flanks of bricks and ridges rise by as many within one texel.
pub const RELIEF: f64 = 24.0;

/// Heights within which a decision may differ: heights of 1 and products of them are right to 6e-8
/// each, places to 1e-7 of a texel on flanks of 1 a texel.
const DECISION_TOLERANCE: f64 = 1e-6;
/// Texels along the way, of a hit that is not grazing: t is rounded by 3e-8 of up to 1,500 texels,
/// 4.5e-5, besides what the place is off.
const APART_TOLERANCE: f64 = 1e-4;
/// Texels over the map, of the same: a height off by 1e-7 over a fall of at least GRAZING.
const PLACE_TOLERANCE: f64 = 1e-5;
/// Where the fall goes to 0 a height off by d moves the hit by the root of d over the patch's
/// curvature: √1e-6.
const APART_GRAZING: f64 = 1e-3;
/// Heights: rounding of the sum of four products of heights up to 1.
const SURFACE_TOLERANCE: f64 = 1e-6;
/// Heights, and as many times RELIEF in texels: t's rounding, as above, on falls of up to 1 a
/// texel.
const RAY_TOLERANCE: f64 = 1e-5;

/// Rise of the ray against the surface, in heights a texel of the way, below which it grazes.
const GRAZING: f64 = 1e-2;

#[derive(Default)]
struct Compared {
    hits: usize,
    other_decisions: usize,
    /// Of other decisions: the height that decides, at most.
    doubt: f64,
    /// Between the hits, along the ray in texels: at most and on average, of those that meet the
    /// surface clearly.
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
pub fn check(device: &Arc<Device>, name: &str, map: &HeightMap, rays: &[[Vec3; 2]]) {
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
