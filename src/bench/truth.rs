//! The reference: irradiance by the path tracer, kept in a file named by what it depends on.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use glam::{DVec3, Vec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::places::{Place, Sample, place_of, places};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::path_tracer::PathTracer;
use crate::render::Light;
use crate::scene::Scene;

/// Incremented when the reference's values change.
const VERSION: &str = "2";

/// Places that are traced between two calls of `go_on`.
const CHUNK: usize = 64;

/// Interval between lines of progress.
const QUIET: Duration = Duration::from_secs(10);

/// Independent estimates of each value, each from as many paths.
pub const PARTS: usize = 3;

/// Irradiance at one place, W·m⁻², RGB.
pub type Parts = [Vec3; PARTS];

/// Irradiance at chosen elements, `[place][part]`.
#[derive(Debug, Clone, Default)]
pub struct Truth {
    pub places: Vec<Place>,
    /// At the centroids.
    pub centroids: Vec<Parts>,
    /// Light straight from emitters and point lights at the centroids; empty if not wanted.
    pub direct: Vec<Parts>,
    /// At the random points.
    pub points: Vec<Parts>,
    /// Time of tracing.
    pub seconds: f64,
}

/// A truth as its file holds it: centroids, direct, points.
#[derive(Serialize, Deserialize)]
struct Kept {
    triangles: Vec<usize>,
    values: [Vec<[[f32; 3]; PARTS]>; 3],
    seconds: f64,
}

/// What is traced.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    pub sample: Sample,
    /// Paths of each value.
    pub paths: u32,
    pub seed: u64,
    /// Whether direct light is traced as well.
    pub direct: bool,
}

impl Truth {
    /// Reads the reference of `scene` from `folder`; where there is none, traces it in `fine`, the
    /// scene with its relief as geometry, and keeps it in `folder`. None when `go_on` returned
    /// false.
    pub fn of(
        scene: &Scene,
        fine: &Scene,
        wanted: &Wanted,
        folder: Option<&Path>,
        go_on: &impl Fn() -> bool,
    ) -> Result<Option<Self>> {
        let tracer = PathTracer::new(fine)?;
        let places = places(scene, &tracer, wanted.sample, wanted.seed)?;
        let path = folder.map(|f| f.join(format!("reference-{}.json", wanted.identity(scene))));
        if let Some(kept) = path
            .as_ref()
            .and_then(|path| Self::load(path, wanted, &places))
        {
            return Ok(Some(kept));
        }
        let truth = Self::traced(scene, &tracer, wanted, places, go_on);
        if let (Some(truth), Some(path)) = (&truth, &path) {
            truth.save(path)?;
        }
        Ok(truth)
    }

    fn traced(
        scene: &Scene,
        tracer: &PathTracer<'_>,
        wanted: &Wanted,
        places: Vec<Place>,
        go_on: &impl Fn() -> bool,
    ) -> Option<Self> {
        let start = Instant::now();
        let mut shown = start;
        let mut truth = Self::default();
        for (chunk, part) in places.chunks(CHUNK).enumerate() {
            if !go_on() {
                return None;
            }
            let found: Vec<_> = (part.par_iter().enumerate())
                .map(|(i, place)| {
                    let trace = Trace {
                        tracer,
                        wanted,
                        place: (CHUNK * chunk + i) as u64,
                        normal: place_of(scene, place.triangle).1,
                    };
                    let (centroid, point) =
                        (place_of(scene, place.triangle).0, place.position(scene));
                    let direct = || trace.parts(centroid, 1, Light::Direct);
                    (
                        trace.parts(centroid, 0, Light::Global),
                        wanted.direct.then(direct),
                        trace.parts(point, 2, Light::Global),
                    )
                })
                .collect();
            for (centroid, direct, point) in found {
                truth.centroids.push(centroid);
                truth.direct.extend(direct);
                truth.points.push(point);
            }
            let done = truth.centroids.len();
            if shown.elapsed() >= QUIET || done == places.len() {
                shown = Instant::now();
                let (all, seconds) = (places.len(), start.elapsed().as_secs_f64());
                tracing::info!("reference: {done} of {all} places in {seconds:.0} s");
            }
        }
        truth.places = places;
        truth.seconds = start.elapsed().as_secs_f64();
        Some(truth)
    }

    fn save(&self, path: &Path) -> Result<()> {
        let rgb = |values: &[Parts]| values.iter().map(|v| v.map(|c| c.to_array())).collect();
        let kept = Kept {
            triangles: self.places.iter().map(|place| place.triangle).collect(),
            values: [rgb(&self.centroids), rgb(&self.direct), rgb(&self.points)],
            seconds: self.seconds,
        };
        let text = serde_json::to_string(&kept).map_err(|e| Error::file(path, e.to_string()))?;
        write_atomically(path, |out| out.write_all(text.as_bytes()))
    }

    /// A kept reference; None where there is none or it is damaged: it is then traced again.
    fn load(path: &PathBuf, wanted: &Wanted, places: &[Place]) -> Option<Self> {
        let text = std::fs::read(path).ok()?;
        let kept: Kept = serde_json::from_slice(&text).ok()?;
        let counts = [true, wanted.direct, true].map(|is_there| match is_there {
            true => places.len(),
            false => 0,
        });
        let is_sound = |(v, count): (&Vec<[[f32; 3]; PARTS]>, usize)| {
            v.len() == count
                && v.as_flattened()
                    .as_flattened()
                    .iter()
                    .all(|c| c.is_finite())
        };
        let triangles = places.iter().map(|place| place.triangle);
        if !triangles.eq(kept.triangles) || !kept.values.iter().zip(counts).all(is_sound) {
            return None;
        }
        let [centroids, direct, points] = (kept.values).map(|values| {
            values
                .into_iter()
                .map(|v| v.map(Vec3::from_array))
                .collect()
        });
        Some(Self {
            places: places.to_vec(),
            centroids,
            direct,
            points,
            seconds: kept.seconds,
        })
    }

    /// Standard error of the centroids' values, root mean square over places and colours, as a
    /// share of the mean.
    pub fn noise(&self) -> f64 {
        let variance = |parts: &Parts| {
            let middle = average(parts);
            let apart = parts
                .iter()
                .map(|p| (p.as_dvec3() - middle).length_squared());
            apart.sum::<f64>() / (3 * PARTS * (PARTS - 1)) as f64
        };
        let sum: f64 = (self.places.iter().zip(&self.centroids))
            .map(|(place, parts)| place.weight * variance(parts))
            .sum();
        sum.sqrt() / mean(&self.places, &self.centroids)
    }

    /// The values at the places, from values `[triangle]`.
    pub fn at_places(&self, values: &[Vec3]) -> Vec<Vec3> {
        self.places
            .iter()
            .map(|place| values[place.triangle])
            .collect()
    }
}

/// Paths of one place.
struct Trace<'a> {
    tracer: &'a PathTracer<'a>,
    wanted: &'a Wanted,
    place: u64,
    normal: DVec3,
}

impl Trace<'_> {
    /// `kind` separates the paths of values at one place.
    fn parts(&self, at: DVec3, kind: u64, light: Light) -> Parts {
        let paths = self.wanted.paths.div_ceil(PARTS as u32);
        std::array::from_fn(|part| {
            let number = (3 * self.place + kind) * PARTS as u64 + part as u64;
            let seed = (self.wanted.seed << 32) + number;
            self.tracer
                .irradiance(at, self.normal, paths, seed, light)
                .0
        })
    }
}

/// Mean of the parts.
pub fn average(parts: &Parts) -> DVec3 {
    parts.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / PARTS as f64
}

/// Mean of the reference, over places and colours, W·m⁻².
pub fn mean(places: &[Place], truth: &[Parts]) -> f64 {
    (places.iter().zip(truth))
        .map(|(place, parts)| place.weight * average(parts).element_sum() / 3.0)
        .sum()
}

impl Wanted {
    /// Sixteen digits that identify a reference.
    fn identity(&self, scene: &Scene) -> String {
        let Self {
            sample,
            paths,
            seed,
            direct,
        } = self;
        let mut hash = Sha256::new();
        let scene = scene.hash();
        hash.update(format!(
            "{VERSION} {scene} {sample} {paths} {seed} {direct}"
        ));
        let digest = hash.finalize();
        digest.iter().take(8).map(|b| format!("{b:02x}")).collect()
    }
}
