//! `mesolux bench pareto`: error against run time, for settings of the bake and for other methods,
//! against one reference.
//!
//! Time is measured from the scene in memory to the irradiance of every element; opening a device
//! and reading files do not count. Error is that of irradiance on elements with neither relief nor
//! emission, at their centroids and at random points, see [`super::places`].

mod bakes;
mod breakdown;
mod peers;
mod plot;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};

pub use bakes::Grid;
pub use breakdown::{Breakdown, Part, Worst};

use super::measure::{Measure, front};
use super::truth::{Truth, Wanted};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::scene::{Scene, displace};
use crate::vk::Device;
use bakes::Done;
use peers::{Job, SCRIPTS};

/// A method that computes irradiance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// A bake by the estimator of that name.
    Receiver,
    Pixel,
    /// Keller 1997, shadow rays on the CPU.
    InstantRadiosity,
    /// The project's own path tracer.
    PathTracer,
    /// Mitsuba 3, LLVM.
    Mitsuba,
    /// A light map by Blender's Cycles, CPU.
    Cycles,
    /// The same denoised by OpenImageDenoise.
    CyclesOidn,
}

impl Method {
    pub const ALL: [Self; 7] = [
        Self::Receiver,
        Self::Pixel,
        Self::InstantRadiosity,
        Self::PathTracer,
        Self::Mitsuba,
        Self::Cycles,
        Self::CyclesOidn,
    ];

    /// Name in tables and plots.
    pub fn title(self) -> &'static str {
        match self {
            Self::Receiver => "receiver",
            Self::Pixel => "pixel",
            Self::InstantRadiosity => "instant radiosity",
            Self::PathTracer => "path tracer",
            Self::Mitsuba => "Mitsuba 3",
            Self::Cycles => "Cycles",
            Self::CyclesOidn => "Cycles, OIDN",
        }
    }

    fn is_bake(self) -> bool {
        matches!(self, Self::Receiver | Self::Pixel)
    }
}

/// One measurement. Settings that a method does not have are None.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub method: Method,
    pub hemicube: Option<u32>,
    /// Hemicube of strong emitters.
    pub emitter_hemicube: Option<u32>,
    /// Size of the sources over the default one, see [`crate::bake::quality::sized`].
    pub source_scale: Option<f64>,
    pub directions: Option<u32>,
    pub sources: Option<u64>,
    pub hemicubes: Option<u64>,
    /// Paths of each element; of instant radiosity, light paths in all.
    pub paths: Option<u32>,
    /// Error bound at the time of the measurement: `--residual` of an equal bake.
    pub error_bound: Option<f64>,
    /// Whether the bake had ended, and was not measured on its way.
    pub finished: bool,
    /// Time for all elements of the scene.
    pub seconds: f64,
    #[serde(flatten)]
    pub measure: Measure,
    /// Whether no other bake is both quicker and more accurate.
    pub best: bool,
}

impl Row {
    fn new(method: Method, measure: Measure) -> Self {
        Self {
            method,
            hemicube: None,
            emitter_hemicube: None,
            source_scale: None,
            directions: None,
            sources: None,
            hemicubes: None,
            paths: None,
            error_bound: None,
            finished: true,
            seconds: 0.0,
            measure,
            best: false,
        }
    }

    /// Whether two rows are one bake at two times, or the same method.
    fn same_curve(&self, other: &Self) -> bool {
        let settings = |r: &Self| {
            let hemicubes = (r.hemicube, r.emitter_hemicube);
            (r.method, hemicubes, r.source_scale, r.directions)
        };
        settings(self) == settings(other)
    }

    /// The settings as text.
    pub fn settings(&self) -> String {
        let mut words = Vec::new();
        words.extend(self.hemicube.map(|n| format!("hemicube {n}")));
        words.extend(self.emitter_hemicube.map(|n| format!("emitters {n}")));
        words.extend(self.source_scale.map(|s| format!("sources x {s}")));
        words.extend(self.directions.map(|k| format!("K = {k}")));
        words.extend(self.error_bound.map(|b| format!("residual {b:.1e}")));
        words.extend(self.paths.map(|n| format!("{n} paths")));
        words.join(", ")
    }
}

/// What is measured.
#[derive(Debug, Clone)]
pub struct Options {
    pub wanted: Wanted,
    pub grid: Grid,
    /// Most time of one measurement of another method; None leaves the others out.
    pub peers: Option<Duration>,
    /// A Python interpreter that may have Mitsuba and Blender's `bpy`.
    pub python: PathBuf,
}

/// All that was measured of a scene.
#[derive(Serialize)]
struct Found<'a> {
    #[serde(flatten)]
    conditions: &'a Conditions<'a>,
    rows: &'a [Row],
    breakdown: Option<&'a Breakdown>,
}

/// What all measurements of a scene have in common.
#[derive(Serialize)]
struct Conditions<'a> {
    scene: &'a str,
    device: &'a str,
    elements: usize,
    places: usize,
    reference_paths: u32,
    reference_seconds: f64,
    /// See [`Truth::noise`].
    reference_noise: f64,
}

impl Conditions<'_> {
    fn print(&self) {
        crate::say!(
            "{}: {} elements, {}; {} places without relief and emission, reference of {} paths each in {:.0} s, noise {:.2} %",
            self.scene,
            self.elements,
            self.device,
            self.places,
            self.reference_paths,
            self.reference_seconds,
            100.0 * self.reference_noise
        );
    }
}

/// Measures, prints, and writes `pareto.csv`, `pareto.json`, `pareto.svg` and `pareto.png` into
/// `folder` after each bake and each other method. When `go_on` returns false it stops and keeps
/// what has been measured.
///
/// # Errors
/// A scene without triangles that can be compared, settings that cannot be solved, a folder that
/// cannot be written.
pub fn run(
    device: &Arc<Device>,
    scene: &Scene,
    options: &Options,
    folder: &Path,
    go_on: impl Fn() -> bool,
) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let fine = displace(scene)?;
    let Some(truth) = Truth::of(scene, &fine, &options.wanted, Some(folder), &go_on)? else {
        return Ok(());
    };
    let conditions = Conditions {
        scene: &scene.name,
        device: device.name(),
        elements: scene.triangles.len(),
        places: truth.places.len(),
        reference_paths: options.wanted.paths,
        reference_seconds: truth.seconds,
        reference_noise: truth.noise(),
    };
    conditions.print();
    if let Some(kind) = scene.lights.beyond_points() {
        crate::say!("the pixel estimator is left out: it knows no {kind}");
    }
    crate::say!("{HEADER}");
    let save = |rows: &[Row], breakdown: Option<&Breakdown>| {
        let found = Found {
            conditions: &conditions,
            rows,
            breakdown,
        };
        write(&found, folder)
    };
    let mut rows: Vec<Row> = Vec::new();
    let mut closest: Option<(f64, Done)> = None;
    let mut breakdown = None;
    for trial in options.grid.tries(scene) {
        if !go_on() {
            break;
        }
        let done = trial.bake(device, scene, &options.grid, &truth, &go_on)?;
        rows.extend(done.rows.iter().cloned());
        mark(&mut rows);
        if let Some(last) = done.rows.last() {
            crate::say!("{}", line(last));
            if closest
                .as_ref()
                .is_none_or(|(rms, _)| last.measure.centroids.rms < *rms)
            {
                breakdown = Some(Breakdown::new(scene, &done, &truth));
                closest = Some((last.measure.centroids.rms, done));
            }
        }
        save(&rows, breakdown.as_ref())?;
    }
    if let Some(limit) = options.peers.filter(|_| go_on()) {
        let job = Job {
            scene,
            fine: &fine,
            truth: &truth,
            limit,
        };
        let mut add = |row: Row| {
            crate::say!("{}", line(&row));
            rows.push(row);
        };
        if let Some(why) = job.instant_radiosity(&go_on, &mut add)? {
            crate::say!("instant radiosity is left out: {why}");
        }
        job.path_tracer(&go_on, &mut add)?;
        for script in SCRIPTS.iter().filter(|_| go_on()) {
            let into = folder.join("peers");
            if let Some(why) = job.script(script, &options.python, &into, &mut add)? {
                crate::say!("{} is left out: {why}", script.name);
            }
        }
        save(&rows, breakdown.as_ref())?;
    }
    print_best(&rows);
    if let (Some(breakdown), Some((_, done))) = (&breakdown, &closest) {
        let of = done.rows.last().map_or(String::new(), Row::settings);
        crate::say!("\nerror of the closest bake ({of}) over the mean irradiance:");
        breakdown.print();
    }
    Ok(())
}

fn print_best(rows: &[Row]) {
    crate::say!("\nbest settings, none of which is slower and further off than another:\n{HEADER}");
    let mut best: Vec<&Row> = rows.iter().filter(|r| r.best).collect();
    best.sort_by(|a, b| a.seconds.total_cmp(&b.seconds));
    for row in best {
        crate::say!("{}", line(row));
    }
}

/// Marks the best bakes.
fn mark(rows: &mut [Row]) {
    let bakes: Vec<usize> = (0..rows.len())
        .filter(|&i| rows[i].method.is_bake())
        .collect();
    let points: Vec<(f64, f64)> = bakes
        .iter()
        .map(|&i| (rows[i].seconds, rows[i].measure.centroids.rms))
        .collect();
    for (i, best) in bakes.into_iter().zip(front(&points)) {
        rows[i].best = best;
    }
}

const HEADER: &str =
    "  method             seconds   rms % (95 % interval)     bias %        worst %   \
    at random points: rms %, bias %, worst %   settings
  (worst: share of the squared error in the worst 0.1 % of the area)";

fn line(row: &Row) -> String {
    let (m, points) = (&row.measure.centroids, &row.measure.points);
    format!(
        "{} {:<17} {:>8.2} {:>7.2} ({:.2} to {:.2}) {:>+9.2} +- {:.2} {:>6}   {:>7.2} {:>+7.2} {:>6}   {}{}",
        if row.best { '*' } else { ' ' },
        row.method.title(),
        row.seconds,
        100.0 * m.rms,
        100.0 * m.rms_interval[0],
        100.0 * m.rms_interval[1],
        100.0 * m.bias,
        100.0 * m.bias_interval,
        m.worst_percent(),
        100.0 * points.rms,
        100.0 * points.bias,
        points.worst_percent(),
        row.settings(),
        if row.finished { "" } else { " (on its way)" }
    )
}

fn cell<T: ToString>(value: Option<T>) -> String {
    value.map_or(String::new(), |v| v.to_string())
}

fn write(found: &Found<'_>, folder: &Path) -> Result<()> {
    let json = folder.join("pareto.json");
    let text =
        serde_json::to_string_pretty(found).map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("pareto.csv"), |out| {
        writeln!(
            out,
            "method,hemicube,emitter_hemicube,source_scale,directions,sources,hemicubes,paths,error_bound,finished,seconds,rms,rms_low,rms_high,bias,bias_interval,worst_share,points_rms,points_rms_low,points_rms_high,points_bias,points_bias_interval,points_worst_share,best"
        )?;
        for r in found.rows {
            writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                r.method.title(),
                cell(r.hemicube),
                cell(r.emitter_hemicube),
                cell(r.source_scale),
                cell(r.directions),
                cell(r.sources),
                cell(r.hemicubes),
                cell(r.paths),
                cell(r.error_bound),
                r.finished,
                r.seconds,
                r.measure.centroids.cells(),
                r.measure.points.cells(),
                r.best
            )?;
        }
        Ok(())
    })?;
    let caption = format!(
        "{}, {} elements",
        found.conditions.scene, found.conditions.elements
    );
    plot::write(found.rows, &caption, folder)
}
