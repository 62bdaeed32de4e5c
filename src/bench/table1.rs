//! `mesolux bench table1`: the paper's Table 1, its time column beside ours.
//!
//! The bakes of a scene take turns of a few seconds, so that what slows the machine slows all of them.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;
use plotters::style::RGBColor;
use serde::Serialize;

use crate::atomic_file::write_atomically;
use crate::bake;
use crate::directions::Directions;
use crate::error::{Error, Result};
use crate::meso::{Options as ReliefOptions, Transport};
use crate::scene::{BuiltinOptions, Scene, displace, load};
use crate::solver::{Settings, Solver, StopReason};
use crate::vk::Device;

use super::bars::{Bar, Bars};
use super::{Difference, plain_pairs};

/// A scene of the paper with its minutes for K = 16, 32, 64 (on hardware of 2013 that it does not name).
pub const SCENES: [(&str, [f64; 3]); 3] = [
    ("fruit-platter", [10.4, 11.0, 12.3]),
    ("bowl-and-bunny", [6.3, 6.6, 7.8]),
    ("cornell-relief", [8.8, 9.8, 10.3]),
];

/// What is to be measured.
pub struct Options {
    /// Names out of [`SCENES`].
    pub scenes: Vec<String>,
    /// Elements, the paper's numbers if not given.
    pub patches: Option<usize>,
    pub residual: f64,
    /// Also bake the relief as geometry.
    pub high_poly: bool,
}

/// One bake.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub scene: String,
    /// `lambert`, `16`, `32`, `64` or `high-poly`.
    pub kind: String,
    pub elements: u64,
    pub meso_elements: u64,
    pub sources: u64,
    pub hemicubes: u64,
    pub error_bound: Option<f64>,
    /// Visibility and response of the relief, nothing kept from earlier runs.
    pub relief_seconds: f64,
    /// All of the bake but reading the scene.
    pub seconds: f64,
    pub paper_minutes: Option<f64>,
    /// How far the triangles without relief are from those of the high-poly bake; none before that is done.
    pub plain: Option<Difference>,
}

impl Row {
    fn name(&self) -> String {
        bake_name(&self.kind)
    }
}

/// A bake that is done, with its irradiance, `[triangle]` in the order of the input.
struct Done {
    row: Row,
    irradiance: Vec<Vec3>,
}

/// A bake under way.
struct Under {
    row: Row,
    solver: Solver,
    done: bool,
}

/// How long a bake goes on before the next one has its turn.
const TURN: Duration = Duration::from_secs(4);

/// Bakes, prints and writes `table1.csv`, `table1.json` and `table1.svg` into `folder` whenever bakes are
/// done. `go_on` may stop it between turns; finished bakes are kept.
pub fn run(
    device: &Arc<Device>,
    options: &Options,
    folder: &Path,
    go_on: impl Fn() -> bool,
) -> Result<()> {
    let mut scenes = Vec::new();
    for name in &options.scenes {
        scenes.push(*SCENES.iter().find(|s| s.0 == name).ok_or_else(|| {
            let names = SCENES.map(|s| s.0).join(", ");
            Error::Usage(format!("--scene {name}: must be one of {names}"))
        })?);
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let mut rows: Vec<Row> = Vec::new();
    println!(
        "{}; to an error bound of {} %",
        device.name(),
        100.0 * options.residual
    );
    println!("{HEADER}");
    for (name, paper) in scenes {
        let builtin = BuiltinOptions {
            patches: options.patches,
            statue: None,
        };
        let scene = load(name, &builtin)?;
        let mut under = Vec::new();
        let mut start = |kind: &str, transport, k, minutes| -> Result<()> {
            let bake = (transport, k);
            under.push(begin(device, &scene, options, kind, bake, minutes)?);
            Ok(())
        };
        start("lambert", Transport::Lambert, 16, None)?;
        for (k, minutes) in [16, 32, 64].into_iter().zip(paper) {
            start(&k.to_string(), Transport::Physical, k, Some(minutes))?;
        }
        let first = rows.len();
        let mut keep = |found: &[Done]| -> Result<()> {
            for done in found {
                rows.push(done.row.clone());
                println!("{}", line(&done.row, &rows[first..]));
            }
            write(&rows, folder)
        };
        let low = in_turns(under, &go_on)?;
        keep(&low)?;
        if options.high_poly && go_on() {
            let fine = displace(&scene);
            let lambert = (Transport::Lambert, 16);
            let under = begin(device, &fine, options, "high-poly", lambert, None)?;
            let high = in_turns(vec![under], &go_on)?;
            keep(&high)?;
            if let [high] = &high[..] {
                let pairs = plain_pairs(&scene, &fine);
                for (row, done) in rows[first..].iter_mut().zip(&low) {
                    let light = (&done.irradiance[..], &high.irradiance[..]);
                    let difference = Difference::new(&scene, &pairs, light);
                    println!("{}", against_high_poly(row, &high.row, &difference));
                    row.plain = Some(difference);
                }
                write(&rows, folder)?;
            }
        }
    }
    Ok(())
}

fn begin(
    device: &Arc<Device>,
    scene: &Scene,
    options: &Options,
    kind: &str,
    (transport, k): (Transport, u32),
    paper_minutes: Option<f64>,
) -> Result<Under> {
    let settings = Settings {
        residual: options.residual,
        relief: ReliefOptions {
            transport,
            directions: Directions::new(k)?,
            cache: None,
        },
        ..Settings::default()
    };
    let start = Instant::now();
    let elements = bake::elements(device, scene, &settings)?;
    let relief_seconds = start.elapsed().as_secs_f64();
    let meso_elements = elements.relief.as_ref().map_or(0, |r| r.count() as u64);
    let solver = Solver::new(device, elements, &scene.point_lights, &settings)?;
    Ok(Under {
        row: Row {
            scene: scene.name.clone(),
            kind: kind.into(),
            elements: scene.triangles.len() as u64,
            meso_elements,
            sources: solver.sources.list.len() as u64,
            hemicubes: 0,
            error_bound: None,
            relief_seconds,
            seconds: start.elapsed().as_secs_f64(),
            paper_minutes,
            plain: None,
        },
        solver,
        done: false,
    })
}

fn in_turns(mut under: Vec<Under>, go_on: &impl Fn() -> bool) -> Result<Vec<Done>> {
    while under.iter().any(|u| !u.done) && go_on() {
        for bake in under.iter_mut().filter(|u| !u.done) {
            let turn = Instant::now();
            bake.solver.run(|_| turn.elapsed() < TURN)?;
            let report = bake.solver.report();
            bake.done = report.stop != StopReason::Interrupted;
            bake.row.seconds += turn.elapsed().as_secs_f64();
            bake.row.hemicubes = report.hemicubes;
            bake.row.error_bound = report.error_bound;
            tracing::info!(
                "{} {}: {} hemicubes in {:.0} s, error bound {:.2} %",
                bake.row.scene,
                bake.row.kind,
                report.hemicubes,
                bake.row.seconds,
                100.0 * report.error_bound.unwrap_or(f64::NAN)
            );
        }
    }
    let done = under.into_iter().filter(|u| u.done).map(|u| {
        let light = u.solver.light()?;
        Ok(Done {
            irradiance: u.solver.elements.to_input_order(&light.irradiance),
            row: u.row,
        })
    });
    done.collect()
}

/// What a bake of relief gains and loses against the same relief as geometry.
fn against_high_poly(row: &Row, high: &Row, difference: &Difference) -> String {
    format!(
        "{:<17} {:<10} {:.2} times as fast as high-poly; its {} plain triangles against it: bias {:+.2} %, rms {:.2} %",
        row.scene,
        row.name(),
        high.seconds / row.seconds,
        difference.triangles,
        100.0 * difference.bias,
        100.0 * difference.rms
    )
}

const HEADER: &str = "scene             bake       elements  meso  hemicubes  seconds  of it relief  over K=16  over lambert  paper, min";

/// A row as it is printed, with its time over those of the same scene's K = 16 and `lambert`.
fn line(row: &Row, scene: &[Row]) -> String {
    let over = |kind: &str| {
        scene
            .iter()
            .find(|r| r.kind == kind)
            .map_or("-".into(), |r| format!("{:.3}", row.seconds / r.seconds))
    };
    format!(
        "{:<17} {:<10} {:>8} {:>4.0}% {:>10} {:>8.1} {:>13.2} {:>10} {:>13} {:>11}",
        row.scene,
        row.name(),
        row.elements,
        100.0 * row.meso_elements as f64 / row.elements as f64,
        row.hemicubes,
        row.seconds,
        row.relief_seconds,
        over("16"),
        over("lambert"),
        row.paper_minutes.map_or("-".into(), |m| format!("{m:.1}")),
    )
}

fn write(rows: &[Row], folder: &Path) -> Result<()> {
    let bad = |path: &Path, e: String| Error::file(path, e);
    let json = folder.join("table1.json");
    let text = serde_json::to_string_pretty(rows).map_err(|e| bad(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("table1.csv"), |out| {
        writeln!(
            out,
            "scene,bake,elements,meso_elements,sources,hemicubes,error_bound,relief_seconds,seconds,paper_minutes,plain_bias,plain_rms"
        )?;
        for r in rows {
            let optional = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
            writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{}",
                r.scene,
                r.kind,
                r.elements,
                r.meso_elements,
                r.sources,
                r.hemicubes,
                optional(r.error_bound),
                r.relief_seconds,
                r.seconds,
                optional(r.paper_minutes),
                optional(r.plain.map(|d| d.bias)),
                optional(r.plain.map(|d| d.rms))
            )?;
        }
        Ok(())
    })?;
    chart(rows).write(&folder.join("table1.svg"))
}

/// Seconds, one group a scene.
fn chart(rows: &[Row]) -> Bars<'static> {
    const KINDS: [(&str, RGBColor); 5] = [
        ("lambert", RGBColor(120, 120, 120)),
        ("16", RGBColor(158, 202, 225)),
        ("32", RGBColor(66, 146, 198)),
        ("64", RGBColor(8, 69, 148)),
        ("high-poly", RGBColor(217, 95, 14)),
    ];
    let mut groups: Vec<String> = Vec::new();
    for row in rows {
        if !groups.contains(&row.scene) {
            groups.push(row.scene.clone());
        }
    }
    let bars = rows.iter().filter_map(|row| {
        Some(Bar {
            group: groups.iter().position(|g| *g == row.scene)?,
            kind: KINDS.iter().position(|k| k.0 == row.kind)?,
            value: row.seconds,
            spread: None,
        })
    });
    Bars {
        caption: "Time of a bake",
        unit: "seconds",
        bars: bars.collect(),
        kinds: KINDS
            .iter()
            .map(|(kind, colour)| (bake_name(kind), *colour))
            .collect(),
        groups,
    }
}

/// A kind of bake as it is shown.
fn bake_name(kind: &str) -> String {
    match kind.parse::<u32>() {
        Ok(k) => format!("K = {k}"),
        Err(_) => kind.to_owned(),
    }
}
