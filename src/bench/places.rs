//! Places at which irradiance is compared: the centroid of an element and a random point of it.

use std::str::FromStr;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::math::random::unit;
use crate::path_tracer::PathTracer;
use crate::scene::Scene;

/// Elements that are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Sample {
    All,
    /// About so many, stratified: by whether other surfaces are close, and by size.
    Some(usize),
}

impl FromStr for Sample {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "all" => Ok(Self::All),
            number => (number.parse().map(|n: usize| Self::Some(n.max(2))))
                .map_err(|_| "neither `all` nor a number".into()),
        }
    }
}

impl std::fmt::Display for Sample {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::All => write!(f, "all"),
            Self::Some(count) => write!(f, "{count}"),
        }
    }
}

/// An element that is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// In the order of the input.
    pub triangle: usize,
    /// Barycentric coordinates of a random point of the element.
    pub point: [f64; 3],
    /// The share of the compared area that it stands for. The sum over all places is 1.
    pub weight: f64,
}

/// Elements with neither relief nor emission.
///
/// In a stratum the elements are chosen by area, a large one perhaps more than once. A stratum has
/// places by the root of its area, so that contacts and small elements are resolved.
///
/// # Errors
/// A scene without such elements.
pub fn places(
    scene: &Scene,
    tracer: &PathTracer<'_>,
    sample: Sample,
    seed: u64,
) -> Result<Vec<Place>> {
    let plain: Vec<usize> = (0..scene.triangles.len())
        .filter(|&e| {
            let material = &scene.materials[scene.triangles[e].material as usize];
            !material.has_relief() && !material.emits()
        })
        .collect();
    if plain.is_empty() {
        return Err(Error::Scene {
            scene: scene.name.clone(),
            what: "it has no triangles without relief and emission to compare".into(),
        });
    }
    let chosen: Vec<(usize, f64)> = match sample {
        Sample::All => plain.iter().map(|&e| (e, area(scene, e))).collect(),
        Sample::Some(count) => {
            let strata = strata(scene, tracer, plain);
            let areas = strata
                .each_ref()
                .map(|stratum| sum_of_areas(scene, stratum));
            let roots: f64 = areas.iter().map(|area| area.sqrt()).sum();
            (strata.iter().zip(areas))
                .flat_map(|(stratum, area)| {
                    let wanted = (count as f64 * area.sqrt() / roots).round().max(1.0);
                    choose(scene, stratum, area, wanted as usize, seed)
                })
                .collect()
        }
    };
    let whole: f64 = chosen.iter().map(|(_, area)| area).sum();
    let place = |(i, (triangle, area)): (u64, (usize, f64))| Place {
        triangle,
        point: random_point(seed, i),
        weight: area / whole,
    };
    Ok((0..).zip(chosen).map(place).collect())
}

/// An element is close to other surfaces where rays meet one within so many times its longest edge.
const CLOSE: f64 = 2.0;

/// Share of the area that the smallest elements have.
const SMALL: f64 = 0.125;

/// Elements by size, and by whether other surfaces are close to them.
fn strata(scene: &Scene, tracer: &PathTracer<'_>, mut plain: Vec<usize>) -> [Vec<usize>; 4] {
    let whole = sum_of_areas(scene, &plain);
    plain.sort_by(|&a, &b| area(scene, a).total_cmp(&area(scene, b)).then(a.cmp(&b)));
    let mut before = 0.0;
    let sizes: Vec<usize> = (plain.iter())
        .map(|&e| {
            let is_small = before < SMALL * whole;
            before += area(scene, e);
            usize::from(is_small)
        })
        .collect();
    let close: Vec<bool> = plain
        .par_iter()
        .map(|&e| is_close(scene, tracer, e))
        .collect();
    let mut strata: [Vec<usize>; 4] = Default::default();
    for ((e, is_small), is_close) in plain.into_iter().zip(sizes).zip(close) {
        strata[2 * usize::from(is_close) + is_small].push(e);
    }
    strata
        .iter_mut()
        .for_each(|stratum| stratum.sort_unstable());
    strata
}

/// Whether rays from the centroid, straight up and 60° from it, meet a surface nearby.
fn is_close(scene: &Scene, tracer: &PathTracer<'_>, e: usize) -> bool {
    let [a, b, c] = scene.corners(&scene.triangles[e]);
    let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
    let (centroid, normal) = place_of(scene, e);
    let (u, v) = normal.any_orthonormal_pair();
    let mut ways = vec![normal];
    ways.extend([u, v, -u, -v].map(|way| 0.5 * normal + 0.75_f64.sqrt() * way));
    (ways.into_iter())
        .filter_map(|way| tracer.distance(centroid, normal, way))
        .any(|distance| distance < CLOSE * longest)
}

/// Elements of one stratum, by area, each with its part of the stratum's area.
fn choose(
    scene: &Scene,
    stratum: &[usize],
    whole: f64,
    count: usize,
    seed: u64,
) -> Vec<(usize, f64)> {
    let mut ends = Vec::with_capacity(stratum.len());
    let mut sum = 0.0;
    for &e in stratum {
        sum += area(scene, e);
        ends.push(sum);
    }
    // The golden ratio's multiples run evenly through the intervals, whatever order the elements
    // have.
    (0..count)
        .filter_map(|i| {
            let shift = ((i as u64 + seed) as f64 * 0.618_033_988_749_894_9).fract();
            let at = whole * (i as f64 + shift) / count as f64;
            let e = *stratum.get(ends.partition_point(|&end| end <= at))?;
            Some((e, whole / count as f64))
        })
        .collect()
}

/// Barycentric coordinates, even over the triangle.
fn random_point(seed: u64, i: u64) -> [f64; 3] {
    let mut state = (seed << 32) ^ i.wrapping_mul(0xd1b5_4a32_d192_ed03);
    let (u, v) = (unit(&mut state), unit(&mut state));
    match u + v > 1.0 {
        true => [u + v - 1.0, 1.0 - u, 1.0 - v],
        false => [1.0 - u - v, u, v],
    }
}

fn area(scene: &Scene, e: usize) -> f64 {
    let [a, b, c] = scene.corners(&scene.triangles[e]);
    0.5 * (b - a).cross(c - a).length()
}

fn sum_of_areas(scene: &Scene, elements: &[usize]) -> f64 {
    elements.iter().map(|&e| area(scene, e)).sum()
}

/// Centroid, scene units, and unit normal of a triangle.
pub fn place_of(scene: &Scene, triangle: usize) -> (DVec3, DVec3) {
    let [a, b, c] = scene.corners(&scene.triangles[triangle]);
    ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero())
}

impl Place {
    /// The random point, scene units.
    pub fn position(&self, scene: &Scene) -> DVec3 {
        let corners = scene.corners(&scene.triangles[self.triangle]);
        corners
            .into_iter()
            .zip(self.point)
            .map(|(corner, weight)| weight * corner)
            .sum()
    }

    /// What is linear between the corners, at the random point.
    pub fn between(&self, corners: &[Vec3; 3]) -> Vec3 {
        let weighted = corners.iter().zip(self.point);
        weighted.map(|(&value, weight)| value * weight as f32).sum()
    }
}
