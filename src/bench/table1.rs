//! `mesolux bench table1`: the paper's Table 1, its times and frame rates beside ours.
//!
//! The bakes of a scene take turns of a few seconds, so that what slows the machine slows all of
//! them. To the letter of the paper they take much longer, and follow.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::bake;
use crate::bake::quality;
use crate::bake::solution::Solution;
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::meso::{Options as ReliefOptions, Transport};
use crate::render::{Lighting, ReliefShading, Renderer, View};
use crate::scene::{LoadOptions, Scene, displace, load};
use crate::solver::{Settings, Solver, StopReason};
use crate::vk::Device;

use super::table1_output::{HEADER, PAPER, Rate, Row, against_high_poly, line, ratios, write};
use super::{Difference, frame, plain_pairs};

/// A scene of the paper with its minutes and its frames a second for K = 16, 32, 64 (on hardware of
/// 2013 and at a size that it does not name).
pub const SCENES: [(&str, [f64; 3], [f64; 3]); 3] = [
    ("fruit-platter", [10.4, 11.0, 12.3], [62.0, 48.0, 29.0]),
    ("bowl-and-bunny", [6.3, 6.6, 7.8], [98.0, 67.0, 25.0]),
    ("cornell-relief", [8.8, 9.8, 10.3], [64.0, 46.0, 22.0]),
];

/// Of the paper.
const DIRECTIONS: [u32; 3] = [16, 32, 64];

/// Pixels of the frames, one sample each.
pub const FRAME: (u32, u32) = (1280, 720);

/// What is to be measured.
pub struct Options {
    /// Names out of [`SCENES`].
    pub scenes: Vec<String>,
    /// Elements, the paper's numbers if not given.
    pub patches: Option<usize>,
    pub residual: f64,
    /// Also bake and draw by the paper's method to the letter.
    pub paper: bool,
    /// Also bake the relief as geometry.
    pub high_poly: bool,
    /// Rounds over which frames are measured, none for 0.
    pub frame_rounds: usize,
    /// Folder that keeps the visibility of reliefs for the frames; bakes compute it anew.
    pub cache: Option<PathBuf>,
}

/// A bake that is done.
struct Done {
    row: Row,
    solution: Solution,
}

/// A bake under way.
struct Under {
    row: Row,
    solver: Solver,
    done: bool,
}

/// How long a bake goes on before the next one has its turn.
const TURN: Duration = Duration::from_secs(4);

/// Bakes, prints and writes `table1.csv`, `table1.json` and `table1.svg` into `folder` whenever
/// bakes are done. `go_on` may stop it between turns; finished bakes are kept.
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
    crate::say!(
        "{}; to an error bound of {} %",
        device.name(),
        100.0 * options.residual
    );
    crate::say!("{HEADER}");
    for (name, minutes, fps) in scenes {
        let builtin = LoadOptions {
            patches: options.patches,
            ..LoadOptions::default()
        };
        let scene = load(name, &builtin)?;
        let start = |kind: &str, transport, k, paper_minutes| {
            let settings = settings(options.residual, transport, k)?;
            let how = How {
                kind,
                settings,
                paper_minutes,
            };
            begin(device, &scene, how)
        };
        let by_k = || DIRECTIONS.into_iter().zip(minutes);
        let mut under = vec![start("lambert", Transport::Lambert, 16, None)?];
        for (k, minutes) in by_k() {
            under.push(start(
                &k.to_string(),
                Transport::Physical,
                k,
                Some(minutes),
            )?);
        }
        let first = rows.len();
        let mut keep = |found: &[Done]| -> Result<()> {
            for done in found {
                rows.push(done.row.clone());
                crate::say!("{}", line(&done.row, &rows[first..]));
            }
            write(&rows, folder)
        };
        let mut low = in_turns(under, &scene, &go_on)?;
        if options.paper && go_on() {
            let letter = by_k().map(|(k, minutes)| {
                let how = How {
                    kind: &format!("{PAPER}{k}"),
                    settings: Settings {
                        residual: options.residual,
                        ..quality::paper(k)?
                    },
                    paper_minutes: Some(minutes),
                };
                begin(device, &scene, how)
            });
            low.extend(in_turns(letter.collect::<Result<_>>()?, &scene, &go_on)?);
        }
        if go_on() && options.frame_rounds > 0 {
            measure_frames(device, &scene, options, fps, &mut low)?;
        }
        keep(&low)?;
        let low_rows: Vec<Row> = low.iter().map(|done| done.row.clone()).collect();
        for ratio in ratios(&low_rows) {
            crate::say!("{ratio}");
        }
        if options.high_poly && go_on() {
            let fine = displace(&scene)?;
            let how = How {
                kind: "high-poly",
                settings: settings(options.residual, Transport::Lambert, 16)?,
                paper_minutes: None,
            };
            let under = begin(device, &fine, how)?;
            let high = in_turns(vec![under], &fine, &go_on)?;
            keep(&high)?;
            if let [high] = &high[..] {
                let pairs = plain_pairs(&scene, &fine);
                for (row, done) in rows[first..].iter_mut().zip(&low) {
                    let light = (&done.solution.irradiance[..], &high.solution.irradiance[..]);
                    let difference = Difference::new(&scene, &pairs, light);
                    crate::say!("{}", against_high_poly(row, &high.row, &difference));
                    row.plain = Some(difference);
                }
                write(&rows, folder)?;
            }
        }
    }
    Ok(())
}

/// How a scene is baked, and what the paper's table says of it.
struct How<'a> {
    kind: &'a str,
    settings: Settings,
    paper_minutes: Option<f64>,
}

/// Ours, nothing kept on disk.
fn settings(residual: f64, transport: Transport, k: u32) -> Result<Settings> {
    Ok(Settings {
        residual,
        relief: ReliefOptions {
            transport,
            directions: Directions::new(k)?,
            cache: None,
        },
        ..Settings::default()
    })
}

fn begin(device: &Arc<Device>, scene: &Scene, how: How<'_>) -> Result<Under> {
    let How {
        kind,
        settings,
        paper_minutes,
    } = how;
    let start = Instant::now();
    let elements = bake::elements(device, scene, &settings)?;
    let relief_seconds = start.elapsed().as_secs_f64();
    let meso_elements = elements.relief.as_ref().map_or(0, |r| r.count() as u64);
    let solver = Solver::new(device, elements, &scene.lights, &settings)?;
    Ok(Under {
        row: Row {
            scene: scene.name.clone(),
            kind: kind.into(),
            elements: scene.triangles.len() as u64,
            meso_elements,
            sources: solver.problem.sources.list.len() as u64,
            hemicubes: 0,
            error_bound: None,
            relief_seconds,
            seconds: start.elapsed().as_secs_f64(),
            paper_minutes,
            fps_factored: None,
            fps_clusters: None,
            paper_fps: None,
            plain: None,
        },
        solver,
        done: false,
    })
}

fn in_turns(mut under: Vec<Under>, scene: &Scene, go_on: &impl Fn() -> bool) -> Result<Vec<Done>> {
    while under.iter().any(|u| !u.done) && go_on() {
        for bake in under.iter_mut().filter(|u| !u.done) {
            let turn = Instant::now();
            let in_time = || turn.elapsed() < TURN;
            bake.solver.turn(|update| !update.draws || in_time())?;
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
        let report = u.solver.report().clone();
        Ok(Done {
            solution: Solution::new(scene, &u.solver.problem.elements, &light, report),
            row: u.row,
        })
    });
    done.collect()
}

/// Frames of the bakes in K directions, drawn by factors and by clusters, to the letter by clusters
/// alone, in turns.
fn measure_frames(
    device: &Arc<Device>,
    scene: &Scene,
    options: &Options,
    paper: [f64; 3],
    bakes: &mut [Done],
) -> Result<()> {
    let Some(camera) = scene.cameras.first() else {
        return Ok(());
    };
    let view = View {
        camera,
        width: FRAME.0,
        height: FRAME.1,
    };
    let shadings = |row: &Row| -> &[ReliefShading] {
        match row.kind.starts_with(PAPER) {
            true => &[ReliefShading::Clusters],
            false => &[ReliefShading::Clusters, ReliefShading::Factored],
        }
    };
    let directed = |done: &&Done| done.solution.relief.is_some();
    let mut renderers = Vec::new();
    for done in bakes.iter().filter(directed) {
        for &shading in shadings(&done.row) {
            let lighting = Lighting {
                shading,
                cache: options.cache.as_deref(),
                ..Lighting::from(&done.solution)
            };
            renderers.push(Renderer::new(device, scene, lighting, &view, 1)?);
        }
    }
    let times = frame::in_turns(&renderers, options.frame_rounds)?;
    drop(renderers);
    let mut times = times.iter();
    // The fastest frame has the highest rate.
    let rate = |&(median, low, high): &(f64, f64, f64)| Rate {
        median: 1e3 / median,
        low: 1e3 / high,
        high: 1e3 / low,
    };
    for done in bakes.iter_mut().filter(|d| d.solution.relief.is_some()) {
        let row = &mut done.row;
        row.fps_clusters = times.next().map(rate);
        if shadings(row).len() > 1 {
            row.fps_factored = times.next().map(rate);
        }
        let k = DIRECTIONS
            .iter()
            .position(|k| row.kind.ends_with(&k.to_string()));
        row.paper_fps = k.map(|k| paper[k]);
    }
    Ok(())
}
