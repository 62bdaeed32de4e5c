//! The same irradiance by other methods: the path tracer, instant radiosity, and Mitsuba 3 and
//! Blender's Cycles where they are installed.
//!
//! They compute the centroid of every element, as a bake does, and take the time that this takes;
//! errors are compared at the reference's places. Between the centroids their light is linear as a
//! bake's is. Cycles bakes a light map instead, in which a centroid is looked up.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use glam::Vec3;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::{Method, Row};
use crate::atomic_file::write_atomically;
use crate::bench::measure::Measure;
use crate::bench::places::place_of;
use crate::bench::truth::Truth;
use crate::error::{Error, Result};
use crate::path_tracer::{PathTracer, VirtualLights};
use crate::render::Light;
use crate::scene::{Scene, write_scene};

/// Paths of the first measurement of each method; each further one has four times as many.
const FIRST_PATHS: u32 = 4;

/// Most paths that are tried.
const MOST_PATHS: u32 = 1 << 20;

/// Seed, different from the reference's.
const SEED: u64 = 0x5eed << 32;

/// Input of the peers.
pub(super) struct Job<'a> {
    /// The scene whose elements' centroids are the places, and the scene with its relief as
    /// geometry.
    pub scene: &'a Scene,
    pub fine: &'a Scene,
    pub truth: &'a Truth,
    /// No measurement is begun that would probably take longer.
    pub limit: Duration,
}

impl Job<'_> {
    /// Of irradiance `found` at every element, `[triangle]`.
    fn row(&self, method: Method, paths: u32, seconds: f64, found: &[Vec3]) -> Row {
        Row {
            paths: Some(paths),
            seconds,
            ..Row::new(method, Measure::of_elements(self.scene, found, self.truth))
        }
    }

    /// Irradiance at every element.
    fn each(&self, find: impl Fn(usize) -> Vec3 + Send + Sync) -> Vec<Vec3> {
        let elements = 0..self.scene.triangles.len();
        elements.into_par_iter().map(find).collect()
    }

    /// The project's own path tracer.
    pub fn path_tracer(&self, go_on: &impl Fn() -> bool, mut add: impl FnMut(Row)) -> Result<()> {
        let start = Instant::now();
        let tracer = PathTracer::new(self.fine)?;
        let once = start.elapsed().as_secs_f64();
        let mut paths = FIRST_PATHS;
        loop {
            let turn = Instant::now();
            let found = self.each(|e| {
                let (place, normal) = place_of(self.scene, e);
                let seed = SEED | e as u64;
                tracer
                    .irradiance(place, normal, paths, seed, Light::Global)
                    .0
            });
            let taken = turn.elapsed();
            let seconds = once + taken.as_secs_f64();
            add(self.row(Method::PathTracer, paths, seconds, &found));
            paths *= 4;
            if 4 * taken > self.limit || paths > MOST_PATHS || !go_on() {
                return Ok(());
            }
        }
    }

    /// Keller's virtual point lights, with shadow rays on the CPU. Returns the reason in one line
    /// where it cannot run.
    pub fn instant_radiosity(
        &self,
        go_on: &impl Fn() -> bool,
        mut add: impl FnMut(Row),
    ) -> Result<Option<String>> {
        if let Some(kind) = self.fine.lights.beyond_points() {
            return Ok(Some(format!("it knows no {kind}")));
        }
        let start = Instant::now();
        let tracer = PathTracer::new(self.fine)?;
        let built = start.elapsed().as_secs_f64();
        let mut paths = FIRST_PATHS;
        loop {
            let turn = Instant::now();
            let lights = VirtualLights::new(&tracer, paths, SEED);
            let once = built + turn.elapsed().as_secs_f64();
            let turn = Instant::now();
            let found = self.each(|e| {
                let (place, normal) = place_of(self.scene, e);
                lights.irradiance(place, normal)
            });
            let taken = turn.elapsed();
            let seconds = once + taken.as_secs_f64();
            add(self.row(Method::InstantRadiosity, paths, seconds, &found));
            paths *= 4;
            if 4 * taken > self.limit || paths > MOST_PATHS || !go_on() {
                return Ok(None);
            }
        }
    }

    /// Mitsuba 3 or Blender's Cycles in a separate process, which reads the scene from `folder`.
    /// Returns the reason in one line where it cannot run.
    pub fn script(
        &self,
        script: &Script,
        python: &Path,
        folder: &Path,
        mut add: impl FnMut(Row),
    ) -> Result<Option<String>> {
        let textured = |m: &crate::scene::Material| m.map_kd.is_some() || m.map_ke.is_some();
        if self.fine.materials.iter().any(textured) {
            return Ok(Some("its script knows no textures".into()));
        }
        if let Some(kind) = self.fine.lights.beyond_points() {
            return Ok(Some(format!("it knows no {kind}")));
        }
        if script.bakes && self.scene.materials.iter().any(|m| m.has_relief()) {
            return Ok(Some("its script bakes no relief".into()));
        }
        let ask = Ask::new(self, script.bakes);
        let obj = write_scene(self.fine, folder)?.with_file_name("scene.obj");
        let (program, job) = (folder.join(script.file), folder.join("job.json"));
        write_atomically(&program, |out| out.write_all(script.text.as_bytes()))?;
        let text = serde_json::to_string(&ask).map_err(|e| Error::file(&job, e.to_string()))?;
        write_atomically(&job, |out| out.write_all(text.as_bytes()))?;
        let run = Command::new(python)
            .args([&program, &obj, &job])
            .stdin(Stdio::null())
            .output();
        let output = match run {
            Ok(output) => output,
            Err(error) => return Ok(Some(format!("{}: {error}", python.display()))),
        };
        let answers = String::from_utf8_lossy(&output.stdout);
        for line in answers.lines() {
            let Ok(answer) = serde_json::from_str::<Answer>(line) else {
                return Ok(Some(format!("an answer that cannot be read: {line:.80}")));
            };
            let found: Vec<Vec3> = answer
                .irradiance
                .into_iter()
                .map(Vec3::from_array)
                .collect();
            if found.len() != self.scene.triangles.len() {
                return Ok(Some("not one answer for each place".into()));
            }
            let method = answer.method.unwrap_or(Method::Mitsuba);
            add(self.row(method, answer.paths, answer.seconds, &found));
        }
        let said = String::from_utf8_lossy(&output.stderr);
        let last = said.lines().rfind(|line| !line.trim().is_empty());
        Ok(match output.status.success() {
            true => None,
            false => Some(last.unwrap_or("it failed without a word").to_owned()),
        })
    }
}

/// A program of another renderer.
pub(super) struct Script {
    /// Of the renderer, in tables.
    pub name: &'static str,
    file: &'static str,
    text: &'static str,
    /// It bakes the triangles of the scene into a light map, whose texels take the place of
    /// centroids.
    bakes: bool,
}

/// What is measured if the interpreter has it.
pub(super) const SCRIPTS: [Script; 2] = [
    Script {
        name: "Mitsuba 3",
        file: "mitsuba_irradiance.py",
        text: include_str!("../../../tests/peers/mitsuba_irradiance.py"),
        bakes: false,
    },
    Script {
        name: "Cycles",
        file: "cycles_irradiance.py",
        text: include_str!("../../../tests/peers/cycles_irradiance.py"),
        bakes: true,
    },
];

/// Input of a script besides the mesh.
#[derive(Serialize)]
struct Ask {
    materials: Vec<Surface>,
    points: Vec<Point>,
    /// Scene units, unit normals, `[place]`.
    places: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    /// Numbers of paths to try while a trial takes no longer than `limit` seconds.
    paths: Vec<u32>,
    limit: f64,
    /// Of a renderer that bakes: the corners and the material of each triangle, scene units.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    triangles: Vec<[[f64; 3]; 3]>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    material: Vec<u32>,
    /// The light map is looked up as renderers do.
    bilinear: bool,
}

#[derive(Serialize)]
struct Surface {
    name: String,
    kd: [f32; 3],
    ke: [f32; 3],
}

#[derive(Serialize)]
struct Point {
    position: [f64; 3],
    intensity: [f32; 3],
}

/// A line of a script's output.
#[derive(Deserialize)]
struct Answer {
    /// None of one that has one method, Mitsuba's.
    method: Option<Method>,
    paths: u32,
    seconds: f64,
    irradiance: Vec<[f32; 3]>,
}

impl Ask {
    fn new(job: &Job<'_>, bakes: bool) -> Self {
        let places = (0..job.scene.triangles.len()).map(|e| place_of(job.scene, e));
        let (places, normals) = places.map(|(p, n)| (p.to_array(), n.to_array())).unzip();
        let triangles: &[_] = if bakes { &job.scene.triangles } else { &[] };
        let paths = std::iter::successors(Some(FIRST_PATHS), |p| p.checked_mul(4));
        Self {
            materials: job
                .fine
                .materials
                .iter()
                .map(|m| Surface {
                    name: m.name.clone(),
                    kd: m.kd,
                    ke: m.ke,
                })
                .collect(),
            points: job
                .fine
                .lights
                .points
                .iter()
                .map(|l| Point {
                    position: l.position.to_array(),
                    intensity: l.intensity,
                })
                .collect(),
            places,
            normals,
            paths: paths.take_while(|&p| p <= MOST_PATHS).collect(),
            limit: job.limit.as_secs_f64(),
            triangles: (triangles.iter())
                .map(|t| job.scene.corners(t).map(|corner| corner.to_array()))
                .collect(),
            material: triangles.iter().map(|t| t.material).collect(),
            bilinear: true,
        }
    }
}
