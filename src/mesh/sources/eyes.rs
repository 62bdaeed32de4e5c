//! Where sources see from, and how their hemicubes are turned: by numbers drawn from a seed.

use glam::DVec3;

use super::cut::Limits;
use super::group::holds;
use super::{Grouping, Source, triangle_area};
use crate::constants::KIND_SURFACE;
use crate::mesh::elements::Elements;

/// Turns the hemicube of each source about its axis by an angle of its own.
pub(super) fn turn_frames(sources: &mut [Source], seed: u64) {
    for (i, source) in sources.iter_mut().enumerate() {
        if source.is_far() {
            continue;
        }
        (source.tangent, source.bitangent) = turned_frame(source.normal, seed, i as u64);
    }
}

/// Moves the eyes of strong plane emitters off their centroids, see [`off_the_grid`]. The power
/// of point lights does not count, so that other point lights do not move eyes.
pub(super) fn move_eyes(
    sources: &mut [Source],
    elements: &Elements,
    limits: &Limits<'_>,
    seed: u64,
) {
    let Limits {
        grouping,
        total_area,
        total_power,
    } = *limits;
    let least = LEAST * grouping.max_power * total_power;
    for (i, source) in sources.iter_mut().enumerate() {
        let emitted = source.emitted_power();
        let strong = emitted > 0.0 && emitted >= least;
        if strong && source.kind == KIND_SURFACE && source.cone == 0.0 {
            let bright = emitted * total_area > BRIGHT * total_power * source.area;
            source.eye = off_the_grid(elements, source, spread(seed, i as u64), bright);
        }
    }
}

/// Tangent and bitangent about `normal` (Duff et al. 2017), turned by an angle drawn from the seed
/// and the index.
fn turned_frame(normal: DVec3, seed: u64, index: u64) -> (DVec3, DVec3) {
    let (t, b) = normal.any_orthonormal_pair();
    let angle = std::f64::consts::TAU * unit_random(seed, index);
    let (sin, cos) = angle.sin_cos();
    (t * cos + b * sin, b * cos - t * sin)
}

/// Power of the weakest emitter that counts as strong, as a share of [`Grouping::max_power`].
/// Groups that are cut for their power are stronger. The limit bounds the number of strong
/// emitters, 512 by default, even where everything glows; the errors of many weak lamps are
/// independent and average out.
const LEAST: f64 = 1.0 / 16.0;

/// Power of a scene's weakest emitter that counts as strong, internal units. Suns, skies and beams
/// are looked at by rays anyway, and do not count: beside the sun no lamp in a house is strong.
pub(crate) fn least_strong(sources: &[Source], grouping: &Grouping) -> f64 {
    let near = sources.iter().filter(|source| !source.is_far());
    let power: f64 = near.map(Source::emitted_power).sum();
    LEAST * grouping.max_power * power
}

/// Least exitance of a lamp over that of the whole scene. A lamp is cut for its power, into many
/// sources that share each shadow's edge.
const BRIGHT: f64 = 4.0;

/// An eye for a plane source: the place at `[u, v]`, which maps the unit square to the source by
/// equal areas, if the source is bright; otherwise halfway from its own eye to there, if that is on
/// the source. Emitters and receivers often lie on aligned grids: from their centroids all sources
/// would see past an edge, or none. For a silhouette across a single source its middle is the best
/// estimate.
fn off_the_grid(elements: &Elements, source: &Source, [u, v]: [f64; 2], bright: bool) -> DVec3 {
    let members = source.first_element..source.first_element + source.element_count;
    let triangles: Vec<[DVec3; 3]> = match (source.element_count, &source.contour[..]) {
        // One that may be a piece of its element.
        (1, [corners]) if corners.len() == 3 => vec![[corners[0], corners[1], corners[2]]],
        _ => members.map(|e| elements.triangle(e as usize)).collect(),
    };
    let mut left = u * triangles.iter().copied().map(triangle_area).sum::<f64>();
    let within = triangles.iter().find(|&&triangle| {
        left -= triangle_area(triangle);
        left < 0.0
    });
    let &[a, b, c] = within.unwrap_or(&triangles[0]);
    let share = 1.0 + (left / triangle_area([a, b, c])).clamp(-1.0, 0.0);
    let place = a + share.sqrt() * ((1.0 - v) * (b - a) + v * (c - a));
    let half = source.eye.midpoint(place);
    match !bright && triangles.iter().any(|&t| holds(t, half, source.normal)) {
        true => half,
        false => place,
    }
}

/// Places in the unit square; neighbouring indices lie far apart: the sequence R₂ (Roberts 2018).
fn spread(seed: u64, index: u64) -> [f64; 2] {
    // 1/g and 1/g² with g³ = g + 1.
    const STEP: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_3];
    let axis = |i: usize| (unit_random(seed, !(i as u64)) + STEP[i] * index as f64).fract();
    [axis(0), axis(1)]
}

/// A number in 0..1 from a seed and an index (SplitMix64).
fn unit_random(seed: u64, index: u64) -> f64 {
    let mut z = seed
        .wrapping_mul(0xa076_1d64_78bd_642f)
        .wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}
