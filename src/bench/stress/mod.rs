//! `mesolux bench stress`: scenes with extreme numbers and meshes.
//!
//! Each case compares the result of an extreme scene with a closed form, an invariance or the path
//! tracer. `tests/stress.rs` runs the same cases in their small size.

mod furnace;
mod geometry;
mod meshes;
mod numbers;
mod relief;

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;
use serde::Serialize;

use crate::atomic_file::write_atomically;
use crate::bake;
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::scene::shapes::Shapes;
use crate::scene::{Lights, LoadOptions, Scene, load, write_scene};
use crate::solver::{Report, Settings, Solver};
use crate::vk::Device;

pub use furnace::occluded_elements;

/// How large the scenes are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// Seconds a case, for tests.
    Small,
    /// The sizes of the list.
    Full,
}

/// Device and size of a case.
pub struct Context {
    pub device: Arc<Device>,
    pub size: Size,
}

/// A number that must not be above its limit.
#[derive(Debug, Clone, Serialize)]
pub struct Check {
    pub what: String,
    pub value: f64,
    pub limit: f64,
}

impl Check {
    fn at_most(what: impl Into<String>, value: f64, limit: f64) -> Self {
        Self {
            what: what.into(),
            value,
            limit,
        }
    }

    /// A condition: 0 if it holds, else 1.
    fn holds(what: impl Into<String>, holds: bool) -> Self {
        Self::at_most(what, f64::from(u8::from(!holds)), 0.0)
    }

    /// Whether the value is within the limit; NaN never is.
    pub fn passes(&self) -> bool {
        self.value <= self.limit
    }
}

impl std::fmt::Display for Check {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mark = if self.passes() { "" } else { " !" };
        match (self.limit, self.value) {
            (0.0, 0.0) => write!(f, "{}: yes", self.what),
            (0.0, 1.0) => write!(f, "{}: no{mark}", self.what),
            (limit, value) => write!(f, "{}: {value:.2e} (<= {limit:.0e}){mark}", self.what),
        }
    }
}

/// One entry of the list.
pub struct Case {
    pub name: &'static str,
    /// The requirement, and its reference.
    pub asked: &'static str,
    run: fn(&Context) -> Result<Vec<Check>>,
}

/// The list.
pub const CASES: [Case; 22] = [
    numbers::SCALE,
    numbers::OFFSET,
    numbers::NO_EMISSION,
    numbers::EMISSION,
    numbers::BLACK,
    numbers::WHITE,
    numbers::MANY_SHOTS,
    furnace::NEARLY_WHITE,
    furnace::OCCLUDERS,
    meshes::SLIVERS,
    meshes::SPECKS,
    meshes::DEGENERATE,
    meshes::DUPLICATES,
    meshes::SHUFFLED,
    meshes::NON_MANIFOLD,
    geometry::TOUCHING,
    geometry::INTERPENETRATING,
    geometry::THIN_GAP,
    geometry::OPEN_SHEET,
    geometry::ONE_PIXEL,
    relief::MAP_SHAPES,
    relief::EXTREME_HEIGHTS,
];

/// The result of a case.
#[derive(Debug, Clone, Serialize)]
pub struct Verdict {
    pub name: &'static str,
    pub asked: &'static str,
    pub checks: Vec<Check>,
    /// The reason why a case ended early.
    pub error: Option<String>,
    pub seconds: f64,
}

impl Verdict {
    /// Whether all requirements are met.
    pub fn passes(&self) -> bool {
        self.error.is_none() && self.checks.iter().all(Check::passes)
    }

    /// The result in words.
    pub fn found(&self) -> String {
        let mut parts: Vec<String> = self.checks.iter().map(Check::to_string).collect();
        parts.extend(self.error.clone());
        parts.join("; ")
    }
}

impl Case {
    /// Runs the case. An error or a panic is a failure.
    pub fn verdict(&self, context: &Context) -> Verdict {
        let start = Instant::now();
        let run = catch_unwind(AssertUnwindSafe(|| (self.run)(context)));
        let (checks, error) = match run {
            Ok(Ok(checks)) => (checks, None),
            Ok(Err(error)) => (Vec::new(), Some(error.to_string())),
            Err(_) => (Vec::new(), Some("a panic, whose text stands above".into())),
        };
        Verdict {
            name: self.name,
            asked: self.asked,
            checks,
            error,
            seconds: start.elapsed().as_secs_f64(),
        }
    }
}

/// Runs the cases whose names contain `only`, prints each, and writes `stress.json` and
/// `stress.csv` into `folder` if one is given. Returns how many failed.
///
/// # Errors
/// Files that cannot be written.
pub fn run(context: &Context, only: &str, folder: Option<&Path>) -> Result<usize> {
    let mut verdicts = Vec::new();
    for case in CASES.iter().filter(|c| c.name.contains(only)) {
        let verdict = case.verdict(context);
        crate::say!(
            "{:<16} {:<6} {:>6.1} s  {}\n{:34}{}",
            verdict.name,
            if verdict.passes() { "passed" } else { "FAILED" },
            verdict.seconds,
            verdict.asked,
            "",
            verdict.found()
        );
        verdicts.push(verdict);
        if let Some(folder) = folder {
            write(&verdicts, folder)?;
        }
    }
    let failed = verdicts.iter().filter(|v| !v.passes()).count();
    crate::say!("{} cases, {failed} failed", verdicts.len());
    Ok(failed)
}

fn write(verdicts: &[Verdict], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let json = folder.join("stress.json");
    let text =
        serde_json::to_string_pretty(verdicts).map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("stress.csv"), |out| {
        writeln!(out, "case,check,value,limit,passed")?;
        for verdict in verdicts {
            for c in &verdict.checks {
                let what = c.what.replace('"', "\"\"");
                let passed = c.passes();
                writeln!(
                    out,
                    "{},\"{what}\",{},{},{passed}",
                    verdict.name, c.value, c.limit
                )?;
            }
            if let Some(error) = &verdict.error {
                let error = error.replace('"', "\"\"");
                writeln!(out, "{},\"{error}\",,,false", verdict.name)?;
            }
        }
        Ok(())
    })
}

/// A solution, `[triangle]` in the order of the input.
struct Solved {
    /// Internal units.
    area: Vec<f64>,
    irradiance: Vec<Vec3>,
    radiosity: Vec<Vec3>,
    report: Report,
}

impl Solved {
    /// Mean over chosen triangles, by area, of the first colour.
    fn mean(&self, values: &[Vec3], chosen: impl IntoIterator<Item = usize>) -> f64 {
        let (sum, area) = chosen.into_iter().fold((0.0, 0.0), |(sum, area), e| {
            let a = self.area[e];
            (sum + a * f64::from(values[e].x), area + a)
        });
        sum / area
    }

    /// Rms by area, and maximum, of the deviation of radiosities from 1, over all colours.
    fn off_one(&self, chosen: impl IntoIterator<Item = usize>) -> (f64, f64) {
        let (mut sum, mut area, mut most) = (0.0, 0.0, 0.0f64);
        for e in chosen {
            for b in self.radiosity[e].to_array() {
                let off = (f64::from(b) - 1.0).abs();
                sum += self.area[e] * off * off / 3.0;
                most = most.max(off);
            }
            area += self.area[e];
        }
        ((sum / area).sqrt(), most)
    }

    /// Largest difference of the radiosity from another's, over the mean of this one.
    fn largest_difference(&self, other: &Self) -> f64 {
        let mean = self.mean(&self.radiosity, 0..self.area.len());
        let pairs = self.radiosity.iter().zip(&other.radiosity);
        let most = pairs.map(|(a, b)| f64::from((*a - *b).abs().max_element()));
        most.fold(0.0, f64::max) / mean
    }
}

impl Context {
    fn solve(&self, scene: &Scene, settings: &Settings) -> Result<Solved> {
        let elements = bake::elements(&self.device, scene, settings)?;
        self.solve_elements(elements, &scene.lights, settings)
    }

    /// Rejects a solution with NaN or negative light, in every case.
    fn solve_elements(
        &self,
        elements: Elements,
        lights: &Lights,
        settings: &Settings,
    ) -> Result<Solved> {
        let mut solver = Solver::new(&self.device, elements, lights, settings)?;
        solver.run(|_| true)?;
        let light = solver.light()?;
        let fine = |v: &Vec3| v.is_finite() && v.min_element() >= 0.0;
        let bad = light
            .irradiance
            .iter()
            .chain(&light.radiosity)
            .filter(|v| !fine(v));
        match bad.count() {
            0 => {}
            bad => {
                return Err(Error::Scene {
                    scene: "of this case".into(),
                    what: format!("{bad} values of its light are negative or no numbers"),
                });
            }
        }
        let elements = &solver.problem.elements;
        Ok(Solved {
            area: elements.to_input_order(&elements.area),
            irradiance: elements.to_input_order(&light.irradiance),
            radiosity: elements.to_input_order(&light.radiosity),
            report: solver.report().clone(),
        })
    }
}

/// Settings of most cases.
fn settings() -> Settings {
    Settings {
        hemicube: 64,
        ..Settings::default()
    }
}

/// The scene written to files and read again, as by the whole program.
fn through_files(scene: &Scene) -> Result<Scene> {
    let folder = tempfile::tempdir().map_err(|e| Error::write(&std::env::temp_dir(), e))?;
    let path = write_scene(scene, folder.path())?;
    load(&path.to_string_lossy(), &LoadOptions::default())
}

/// Form factors of one receiver onto a closed scene sum to 1 within this: near and far sources are
/// integrated with different points of the receiver, by rules of degree 1, 2 and 5, in rooms of 2
/// to 12 squares a side.
const ROWS: f64 = 1.5e-3;

/// Largest error of a furnace without occlusion: the error of one bounce, summed over all bounces.
fn furnace_limit(rho: f64) -> f64 {
    ROWS / (1.0 - rho)
}

/// Reflectance ρ with the emission 1 − ρ, with which a closed scene has the radiosity 1 everywhere.
fn furnace_material(shapes: &mut Shapes, rho: f32) -> u32 {
    shapes.material(rho, (1.0 - rho) / std::f32::consts::PI)
}
