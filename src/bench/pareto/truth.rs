//! The reference: irradiance by the path tracer, kept in a file named by what it depends on.

use std::path::Path;
use std::time::Instant;

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::atomic_file::write_atomically;
use crate::bench::irradiance::{place_of, places};
use crate::error::{Error, Result};
use crate::path_tracer::PathTracer;
use crate::render::Light;
use crate::scene::Scene;

/// Incremented when the reference's values change.
const VERSION: &str = "1";

/// Places that are traced between two calls of `go_on`.
const CHUNK: usize = 16;

/// Irradiance at the centroids of chosen triangles, `[place]`, W·m⁻², RGB, with its standard error.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    /// In the order of the input.
    pub triangles: Vec<usize>,
    pub global: Vec<Vec3>,
    pub global_error: Vec<Vec3>,
    /// Light straight from emitters and point lights.
    pub direct: Vec<Vec3>,
    pub direct_error: Vec<Vec3>,
    /// Time of tracing.
    pub seconds: f64,
}

/// A truth as its file holds it: global, its error, direct, its error.
#[derive(Serialize, Deserialize)]
struct Kept {
    triangles: Vec<usize>,
    values: [Vec<[f32; 3]>; 4],
    seconds: f64,
}

/// What is traced.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Places, at random by area.
    pub samples: usize,
    /// Paths of each place.
    pub paths: u32,
    pub seed: u64,
}

impl Truth {
    /// Reads the reference of `scene` from `folder`; where there is none, traces it in `fine`, the
    /// scene with its relief as geometry, and keeps it in `folder`. None when `go_on` returned
    /// false.
    pub fn of(
        scene: &Scene,
        fine: &Scene,
        wanted: &Wanted,
        folder: &Path,
        go_on: &impl Fn() -> bool,
    ) -> Result<Option<Self>> {
        let path = folder.join(format!("reference-{}.json", identity(scene, wanted)));
        let triangles = places(scene, wanted.samples, wanted.seed)?;
        if let Some(kept) = Self::load(&path, &triangles) {
            return Ok(Some(kept));
        }
        let start = Instant::now();
        let tracer = PathTracer::new(fine)?;
        let mut truth = Self::default();
        let numbered: Vec<(usize, usize)> = triangles.iter().copied().enumerate().collect();
        for chunk in numbered.chunks(CHUNK) {
            if !go_on() {
                return Ok(None);
            }
            // A triangle that is chosen again gets other paths.
            let trace = |(i, e): (usize, usize), light| {
                let (centroid, normal) = place_of(scene, e);
                let seed = (wanted.seed << 32) | i as u64;
                tracer.irradiance(centroid, normal, wanted.paths, seed, light)
            };
            let found: Vec<_> = chunk
                .par_iter()
                .map(|&place| (trace(place, Light::Global), trace(place, Light::Direct)))
                .collect();
            for ((global, global_error), (direct, direct_error)) in found {
                truth.global.push(global);
                truth.global_error.push(global_error);
                truth.direct.push(direct);
                truth.direct_error.push(direct_error);
            }
            tracing::info!(
                "reference: {} of {} places in {:.0} s",
                truth.global.len(),
                triangles.len(),
                start.elapsed().as_secs_f64()
            );
        }
        truth.triangles = triangles;
        truth.seconds = start.elapsed().as_secs_f64();
        let rgb = |values: &[Vec3]| values.iter().map(Vec3::to_array).collect();
        let kept = Kept {
            triangles: truth.triangles.clone(),
            values: [
                rgb(&truth.global),
                rgb(&truth.global_error),
                rgb(&truth.direct),
                rgb(&truth.direct_error),
            ],
            seconds: truth.seconds,
        };
        let text = serde_json::to_string(&kept).map_err(|e| Error::file(&path, e.to_string()))?;
        write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
        Ok(Some(truth))
    }

    /// A kept reference; None where there is none or it is damaged: it is then traced again.
    fn load(path: &Path, triangles: &[usize]) -> Option<Self> {
        let text = std::fs::read(path).ok()?;
        let kept: Kept = serde_json::from_slice(&text).ok()?;
        let count = triangles.len();
        let sound =
            |v: &Vec<[f32; 3]>| v.len() == count && v.iter().flatten().all(|c| c.is_finite());
        if kept.triangles != triangles || !kept.values.iter().all(sound) {
            return None;
        }
        let [global, global_error, direct, direct_error] = kept
            .values
            .map(|values| values.into_iter().map(Vec3::from_array).collect());
        Some(Self {
            triangles: kept.triangles,
            global,
            global_error,
            direct,
            direct_error,
            seconds: kept.seconds,
        })
    }

    /// Standard error of a place, root mean square over places and colours, as a share of the mean.
    pub fn noise(&self) -> f64 {
        let sum: f64 = self
            .global_error
            .iter()
            .map(|e| e.as_dvec3().length_squared())
            .sum();
        (sum / (3.0 * self.global.len() as f64)).sqrt() / mean(&self.global)
    }

    /// The values at the places, from values `[triangle]`.
    pub fn at_places(&self, values: &[Vec3]) -> Vec<Vec3> {
        self.triangles.iter().map(|&e| values[e]).collect()
    }
}

/// Mean of the reference, over places and colours, W·m⁻².
pub fn mean(truth: &[Vec3]) -> f64 {
    let sum: f64 = truth.iter().map(|t| t.as_dvec3().element_sum()).sum();
    sum / (3.0 * truth.len() as f64)
}

/// Sixteen digits that identify a reference.
fn identity(scene: &Scene, wanted: &Wanted) -> String {
    let mut hash = Sha256::new();
    let Wanted {
        samples,
        paths,
        seed,
    } = wanted;
    hash.update(format!(
        "{VERSION} {} {samples} {paths} {seed}",
        scene.hash()
    ));
    let digest = hash.finalize();
    digest.iter().take(8).map(|b| format!("{b:02x}")).collect()
}
