//! The reference: an unbiased path tracer on the CPU with an estimate of its own error. Slow, and
//! independent of the baking code.
//!
//! A front shows L = Le + ρ/π · E; a back is black and blocks light; only fronts send light (Kajiya
//! 1986, diffuse). Emitters and point lights are sampled at each vertex of a path, and emitters
//! that the path itself hits are weighted by the balance heuristic (Veach 1997). Paths end by
//! Russian roulette only. Height maps are ignored: to include relief, pass the geometry of
//! [`scene::displace`](crate::scene::displace).
//!
//! ```text
//! scene ─► geometry (bounding volume hierarchy) ─┐
//!       └► lights (by power) ────────────────────┼─► paths ─► film ─► Picture
//! camera ─► sampling (a stream a sample) ────────┘               └──► confidence intervals
//! ```

mod film;
mod instant;
mod lights;
mod paths;

use std::time::{Duration, Instant};

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

pub use film::Film;
#[cfg(feature = "cli")]
pub(crate) use film::NORMAL_95;
pub use instant::VirtualLights;

use crate::error::{Error, Result};
use crate::math::sampling;
use crate::picture::{Light, Projection, View};
use crate::scene::{Scene, geometry};
use film::Batch;
use geometry::Geometry;
use lights::Lights;
use sampling::Random;

/// Most pixels of a picture: 64 Mi take 3.5 GiB of sums.
pub const MOST_PIXELS: u64 = 1 << 26;

/// Most paths of a pixel: far below the limit of u32 when rounded up to whole passes.
pub const MOST_PATHS: u32 = 1 << 30;

/// Least batches that [`Settings::paths`] are split into, if there are as many paths: the spread of
/// fewer is too uncertain.
const LEAST_PASSES: u32 = 8;

/// Most strata along a side of a pixel: beyond 4, the remaining noise is that of the paths and not
/// of edges within the pixel.
const MOST_STRATA: u32 = 4;

/// Approximate paths of a pass, unless the picture has more pixels: a few seconds, after which
/// tracing can be stopped.
const PASS_PATHS: u64 = 1 << 20;

/// Paths that one thread sums at a time: fixed, so that the sum does not depend on the number of
/// threads.
const CHUNK: u32 = 1024;

/// How a picture is traced.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Paths of each pixel, at least 2; rounded up to whole passes.
    pub paths: u32,
    /// No pass is begun that would probably end after it; two are always made.
    pub budget: Option<Duration>,
    /// Another seed gives an independent picture.
    pub seed: u64,
    pub light: Light,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            paths: 256,
            budget: None,
            seed: 0,
            light: Light::Global,
        }
    }
}

/// Progress of a picture.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// Paths of each pixel so far, and in total.
    pub paths: u32,
    pub of: u32,
    pub elapsed: Duration,
}

/// A scene ready to be traced.
pub struct PathTracer<'a> {
    scene: &'a Scene,
    geometry: Geometry,
    lights: Lights,
}

impl<'a> PathTracer<'a> {
    /// # Errors
    /// A scene without triangles, or with corners or materials that are missing.
    pub fn new(scene: &'a Scene) -> Result<Self> {
        let geometry = Geometry::new(scene)?;
        let lights = Lights::new(scene, &geometry);
        Ok(Self {
            scene,
            geometry,
            lights,
        })
    }

    /// Traces a picture: box filter over the pixel, jittered strata. The same settings give the
    /// same bits for any number of threads. `go_on` is called after each pass from the second on,
    /// with the picture so far; when it returns false, that is the result.
    ///
    /// # Errors
    /// Paths not in 2..=[`MOST_PATHS`]; a size of 0, above [`crate::picture::MOST_PIXELS`] a
    /// side or [`MOST_PIXELS`] in all; a camera that looks nowhere.
    pub fn render(
        &self,
        view: &View<'_>,
        settings: &Settings,
        mut go_on: impl FnMut(&Progress, &Film) -> bool,
    ) -> Result<Film> {
        view.check()?;
        let pixels = u64::from(view.width) * u64::from(view.height);
        if pixels > MOST_PIXELS {
            return Err(Error::Usage(format!(
                "picture of {}x{}: the path tracer takes no more than {MOST_PIXELS} pixels",
                view.width, view.height
            )));
        }
        if !(2..=MOST_PATHS).contains(&settings.paths) {
            return Err(Error::Usage(format!(
                "paths {}: must be in 2..={MOST_PATHS}; two have a spread, from which the error is found",
                settings.paths
            )));
        }
        let projection = Projection::new(self.scene, view)?;
        let most = u64::from(settings.paths / LEAST_PASSES).min(PASS_PATHS / pixels);
        let strata = (most.isqrt() as u32).clamp(1, MOST_STRATA);
        let batch = strata * strata;
        let passes = settings.paths.div_ceil(batch);

        let start = Instant::now();
        let mut film = Film::new(view.width, view.height);
        while film.passes < passes {
            let first = u64::from(film.paths);
            film.add(batch, |column, row| {
                let pixel = u64::from(row) * u64::from(view.width) + u64::from(column);
                let (mut sum, mut metered) = (DVec3::ZERO, true);
                for stratum in 0..batch {
                    let mut random = Random::new(settings.seed, pixel, first + u64::from(stratum));
                    let cell = DVec2::new(f64::from(stratum % strata), f64::from(stratum / strata));
                    let within = (cell + random.square()) / f64::from(strata);
                    let direction =
                        projection.ray(f64::from(column) + within.x, f64::from(row) + within.y);
                    let seen = self
                        .geometry
                        .hit(self.geometry.inside(projection.eye), direction);
                    metered &=
                        seen.is_some_and(|hit| hit.front && !self.lights.emits(hit.triangle));
                    match seen {
                        Some(hit) => sum += self.radiance(&hit, settings.light, &mut random),
                        None if settings.light != Light::Direct => {
                            sum += self.lights.sky(direction)
                        }
                        None => {}
                    }
                }
                Batch {
                    mean: sum / f64::from(batch),
                    metered,
                }
            });
            film.elapsed = start.elapsed();
            let progress = Progress {
                paths: film.paths,
                of: passes * batch,
                elapsed: film.elapsed,
            };
            let next_ends = film.elapsed + film.elapsed / film.passes;
            let in_time = settings.budget.is_none_or(|budget| next_ends <= budget);
            if film.passes >= 2 && !(go_on(&progress, &film) && in_time) {
                break;
            }
        }
        Ok(film)
    }

    /// Irradiance at a place of the scene (scene units) about a unit normal, and its standard
    /// error, W·m⁻², RGB; zero about no direction. At least two paths are traced.
    ///
    /// An independent check of the radiosity solver: at a place on an element, with its normal, it
    /// is the `irradiance` that the solution has of the element there.
    pub fn irradiance(
        &self,
        point: DVec3,
        normal: DVec3,
        paths: u32,
        seed: u64,
        light: Light,
    ) -> (Vec3, Vec3) {
        let paths = paths.max(2);
        let (place, normal) = (self.geometry.inside(point), normal.normalize_or_zero());
        if normal == DVec3::ZERO || !place.is_finite() {
            return (Vec3::ZERO, Vec3::ZERO);
        }
        let sums: Vec<[DVec3; 2]> = (0..paths.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = [DVec3::ZERO; 2];
                for path in chunk * CHUNK..paths.min((chunk + 1).saturating_mul(CHUNK)) {
                    let mut random = Random::new(seed, u64::MAX, u64::from(path));
                    let found = self.gathered(place, normal, light, &mut random);
                    sums[0] += found;
                    sums[1] += found * found;
                }
                sums
            })
            .collect();
        let [sum, squares] = sums
            .iter()
            .fold([DVec3::ZERO; 2], |[a, b], [c, d]| [a + c, b + d]);
        let count = f64::from(paths);
        let error = film::standard_error(squares - sum * sum / count, count);
        ((sum / count).as_vec3(), error.as_vec3())
    }

    /// How far the nearest surface is from a place of a surface with a unit normal, in scene units;
    /// None where there is none.
    #[cfg(feature = "cli")]
    pub(crate) fn distance(&self, point: DVec3, normal: DVec3, way: DVec3) -> Option<f64> {
        let from = self.geometry.inside(point) + geometry::ABOVE * normal;
        let hit = self.geometry.hit(from, way)?;
        Some(hit.distance * self.geometry.unit)
    }
}
