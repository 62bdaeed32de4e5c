//! `mesolux bench irradiance`: irradiance of a bake against the path tracer, which knows nothing of
//! hemicubes, sources or slots and sees relief as geometry.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use crate::error::{Error, Result};
use crate::path_tracer::{NORMAL_95, PathTracer};
use crate::render::Light;
use crate::scene::{Scene, displace};

/// How far irradiance is from the truth, over triangles without relief chosen at random by area.
#[derive(Debug, Clone, Copy)]
pub struct Found {
    pub samples: usize,
    /// Mean difference over the mean of the truth, and half of its 95 % interval.
    pub bias: f64,
    pub bias_interval: f64,
    /// Root mean square of the difference over the mean of the truth, the path tracer's own noise
    /// taken off.
    pub rms: f64,
    /// That noise, of one sample over the mean.
    pub noise: f64,
}

/// What is compared with what.
pub struct Options {
    pub samples: usize,
    /// Paths a sample.
    pub paths: u32,
    pub seed: u64,
}

/// A place on a plain triangle with what the path tracer finds there.
pub struct Sample {
    pub triangle: usize,
    pub truth: Vec3,
    error: Vec3,
}

/// Triangles with neither relief nor emission, chosen by area, stratified; a large one may come
/// again.
///
/// # Errors
/// A scene without such triangles.
pub fn places(scene: &Scene, samples: usize, seed: u64) -> Result<Vec<usize>> {
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
    let cross = |e: usize| {
        let [a, b, c] = scene.corners(&scene.triangles[e]);
        (b - a).cross(c - a)
    };
    let mut ends = Vec::with_capacity(plain.len());
    let mut whole = 0.0;
    for &e in &plain {
        whole += cross(e).length();
        ends.push(whole);
    }
    // The golden ratio's multiples run evenly through the strata's triangles, whatever order those
    // have.
    let chosen = (0..samples).filter_map(|i| {
        let shift = ((i as u64 + seed) as f64 * 0.618_033_988_749_894_9).fract();
        let at = whole * (i as f64 + shift) / samples as f64;
        plain.get(ends.partition_point(|&end| end <= at)).copied()
    });
    Ok(chosen.collect())
}

/// Centroid, scene units, and unit normal of a triangle.
pub fn place_of(scene: &Scene, triangle: usize) -> (DVec3, DVec3) {
    let [a, b, c] = scene.corners(&scene.triangles[triangle]);
    ((a + b + c) / 3.0, (b - a).cross(c - a).normalize_or_zero())
}

/// The truth at the centroids of [`places`].
pub fn samples(scene: &Scene, options: &Options) -> Result<Vec<Sample>> {
    let chosen = places(scene, options.samples, options.seed)?;
    let fine = displace(scene);
    let tracer = PathTracer::new(&fine)?;
    Ok(chosen
        .into_par_iter()
        .map(|e| {
            let (centroid, normal) = place_of(scene, e);
            let (truth, error) =
                tracer.irradiance(centroid, normal, options.paths, e as u64, Light::Global);
            Sample {
                triangle: e,
                truth,
                error,
            }
        })
        .collect())
}

/// `irradiance` is `[triangle]` in the order of the input.
pub fn compare(irradiance: &[Vec3], samples: &[Sample]) -> Found {
    let count = samples.len() as f64;
    let apart = |s: &Sample| (irradiance[s.triangle] - s.truth).as_dvec3();
    let mean = samples
        .iter()
        .map(|s| s.truth.as_dvec3().element_sum())
        .sum::<f64>()
        / (3.0 * count);
    let sum: DVec3 = samples.iter().map(apart).sum();
    let squares: f64 = samples
        .iter()
        .map(|s| apart(s).length_squared())
        .sum::<f64>()
        / (3.0 * count);
    let noise: f64 = samples
        .iter()
        .map(|s| s.error.as_dvec3().length_squared())
        .sum::<f64>()
        / (3.0 * count);
    let bias = sum.element_sum() / (3.0 * count);
    // Colours of a sample err together: the interval is that of the samples' means.
    let spread = samples
        .iter()
        .map(|s| (apart(s).element_sum() / 3.0 - bias).powi(2))
        .sum::<f64>()
        / (count - 1.0).max(1.0);
    Found {
        samples: samples.len(),
        bias: bias / mean,
        bias_interval: NORMAL_95 * (spread / count).sqrt() / mean,
        rms: (squares - noise).max(0.0).sqrt() / mean,
        noise: noise.sqrt() / mean,
    }
}
