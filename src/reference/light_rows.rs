//! Twin of the rows of lights without surfaces: every ray of every element, and every occluder, in
//! f64.

use glam::DVec3;

use crate::constants::{FIRST_EYES, SOURCE_EYES};
use crate::math::form_factor::spread_in_triangle;
use crate::mesh::elements::Elements;
use crate::mesh::sources::Source;
use crate::structs::ShadowOccluder;

/// Elements that follow one another and decide together, as in the shader.
const NEIGHBOURS: usize = 8;

/// Invocations of a workgroup that ask other places each, as in the shader.
const SURVEYS: usize = (SOURCE_EYES / FIRST_EYES) as usize;

/// Least distance behind a plane at which a place is hidden, and least rise of a way above a plane,
/// as in the shader.
const HIDDEN: f64 = 4e-6;
const LEAST_RISE: f64 = 1e-6;

/// Form factors from each element to a sun or a part of the sky, before they are rounded; elements
/// without relief, in their order.
pub fn light_rows(elements: &Elements, occluders: &[ShadowOccluder], source: &Source) -> Vec<f64> {
    let open = |e: usize, eye: usize| {
        let towards = source.places[eye].at;
        let above = towards.dot(elements.normal[e]) > 0.0;
        let [v, w] = spread_in_triangle(eye);
        let [a, b, c] = elements.triangle(e);
        let place = a + v * (b - a) + w * (c - a);
        above && !occluders.iter().any(|o| stands_in(o, place, towards))
    };
    let surveyed = |e: usize| {
        let first = e % SURVEYS * FIRST_EYES as usize;
        let open: Vec<bool> = (first..first + FIRST_EYES as usize)
            .map(|k| open(e, k))
            .collect();
        (open.contains(&true), open.contains(&false))
    };
    let surveys: Vec<(bool, bool)> = (0..elements.plain_count()).map(surveyed).collect();
    let row = |e: usize| {
        let first = e / NEIGHBOURS * NEIGHBOURS;
        let near = &surveys[first..(first + NEIGHBOURS).min(surveys.len())];
        let (opens, closes) = (near.iter().any(|s| s.0), near.iter().any(|s| s.1));
        let cosine = |eye: usize| source.places[eye].at.dot(elements.normal[e]);
        let seen = |eye: usize| match closes && !open(e, eye) {
            true => 0.0,
            false => cosine(eye),
        };
        match opens {
            true => {
                let count = source.places.len();
                source.facing * (0..count).map(seen).sum::<f64>() / count as f64
            }
            false => 0.0,
        }
    };
    (0..elements.plain_count()).map(row).collect()
}

fn stands_in(occluder: &ShadowOccluder, place: DVec3, towards: DVec3) -> bool {
    let normal = occluder.normal.as_dvec3();
    let height = normal.dot(place) - f64::from(occluder.height);
    let rises = normal.dot(towards);
    let behind = match rises {
        r if r > LEAST_RISE => height < -HIDDEN,
        r if r < -LEAST_RISE => height > HIDDEN,
        _ => false,
    };
    let [a, b, c] = [occluder.a, occluder.b, occluder.c].map(|v| v.as_dvec3() - place);
    let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|over| towards.dot(over));
    let least = volumes.into_iter().fold(f64::INFINITY, f64::min);
    let most = volumes.into_iter().fold(f64::NEG_INFINITY, f64::max);
    behind && (least >= 0.0 || most <= 0.0) && least != most
}
