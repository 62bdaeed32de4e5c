//! What a report measures on one device.

use std::sync::Arc;
use std::time::Instant;

use super::model::{Measure, OfDevice, Plan, Section};
use crate::bake;
use crate::bake::quality::Quality;
use crate::bake::solution::{Solution, corner_light};
use crate::bench::places::Sample;
use crate::bench::table1;
use crate::bench::truth::{Truth, Wanted};
use crate::bench::{irradiance, measure};
use crate::error::Result;
use crate::math::directions::Directions;
use crate::meso::Transport;
use crate::render::{Lighting, ReliefShading, Renderer, View};
use crate::scene::{LoadOptions, Scene, load};
use crate::solver::{Report, Settings, Solver};
use crate::vk::Device;

/// Measures on one device, while `go_on` says so.
pub struct Measuring<'a, F: Fn() -> bool> {
    pub device: Arc<Device>,
    pub plan: Plan,
    pub go_on: &'a F,
    pub found: &'a mut OfDevice,
}

const PRESETS: [(&str, Quality); 3] = [
    ("preview", Quality::Preview),
    ("draft", Quality::Draft),
    ("normal", Quality::Normal),
];

/// Of a bake's report.
type Quantity = (&'static str, fn(&Report) -> f64);

const STAGES: [Quantity; 10] = [
    ("set-up", |r| r.seconds.setup),
    ("culling", |r| r.seconds.stages.cull),
    ("item buffers", |r| r.seconds.stages.item_buffer),
    ("sorting", |r| r.seconds.stages.sort),
    ("rays", |r| r.seconds.stages.rays),
    ("form factors", |r| r.seconds.stages.bin),
    ("coupling, keeping", |r| r.seconds.stages.keep),
    ("solving", |r| r.seconds.solve),
    ("gathering", |r| r.seconds.gather),
    ("near light", |r| r.seconds.near),
];

const RATES: [Quantity; 4] = [
    ("item buffers a second", |r| {
        let stages = &r.seconds.stages;
        r.hemicubes as f64 / (stages.cull + stages.item_buffer)
    }),
    ("rows a second, all stages", |r| {
        let stages = &r.seconds.stages;
        let drawn = stages.cull + stages.item_buffer;
        f64::from(r.shots) / (drawn + stages.form_factors() + stages.keep)
    }),
    ("million form factors a second", |r| {
        1e-6 * pairs(r) / r.seconds.stages.bin
    }),
    ("million pairs decided by rays a second", |r| {
        let decided = r.by_rays.doubtful + r.by_rays.silhouettes;
        1e-6 * decided as f64 / r.seconds.stages.rays
    }),
];

/// A finished bake.
struct Baked {
    solver: Solver,
    solution: Solution,
    seconds: f64,
}

impl<F: Fn() -> bool> Measuring<'_, F> {
    fn add(&mut self, section: Section, what: &str, quantity: &str, unit: &str, samples: Vec<f64>) {
        let measure = Measure::new(section, what, quantity, unit, samples);
        tracing::info!(
            "{what}: {quantity} {:.3} {unit} ({:.3} to {:.3})",
            measure.median,
            measure.low,
            measure.high
        );
        self.found.measures.push(measure);
    }

    /// None where `go_on` said no before it was done.
    fn bake(&self, scene: &Scene, settings: &Settings) -> Result<Option<Baked>> {
        let start = Instant::now();
        let elements = bake::elements(&self.device, scene, settings)?;
        let mut solver = Solver::new(&self.device, elements, &scene.lights, settings)?;
        solver.run(|_| (self.go_on)())?;
        let light = solver.light()?;
        let seconds = start.elapsed().as_secs_f64();
        let report = solver.report().clone();
        let solution = Solution::new(scene, &solver.problem.elements, &light, report);
        Ok((self.go_on)().then_some(Baked {
            solver,
            solution,
            seconds,
        }))
    }

    /// Bakes of the Cornell box by preset: their stages, their rates and, against `truth`, their
    /// errors; and the last of them relit. False where `go_on` said no.
    pub fn presets(&mut self, scene: &Scene, truth: &Truth) -> Result<bool> {
        for (name, quality) in PRESETS {
            let what = format!("{name}, {} elements", scene.triangles.len());
            let mut runs = Vec::new();
            let mut last = None;
            for _ in 0..self.plan.runs {
                let Some(baked) = self.bake(scene, &quality.settings())? else {
                    return Ok(false);
                };
                runs.push((baked.seconds, baked.solution.report.clone()));
                last = Some(baked);
            }
            self.stages(&what, &runs);
            let Some(mut baked) = last else { continue };
            self.error(&what, scene, truth, &baked.solution);
            if quality == Quality::Normal && !self.relight(&what, scene, &mut baked.solver)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Stages and rates of bakes, of which `runs` are seconds and reports.
    fn stages(&mut self, what: &str, runs: &[(f64, Report)]) {
        let whole = runs.iter().map(|run| run.0).collect();
        self.add(Section::Stages, what, "whole bake", "s", whole);
        for (quantity, of) in STAGES {
            let samples = runs.iter().map(|run| of(&run.1)).collect();
            self.add(Section::Stages, what, quantity, "s", samples);
        }
        for (quantity, of) in RATES {
            let samples: Vec<f64> = runs.iter().map(|run| of(&run.1)).collect();
            // Without rays there is no rate of them.
            if samples.iter().all(|rate| rate.is_finite() && *rate > 0.0) {
                self.add(Section::Rates, what, quantity, "", samples);
            }
        }
    }

    fn error(&mut self, what: &str, scene: &Scene, truth: &Truth, solution: &Solution) {
        let corners = corner_light(scene, &solution.irradiance);
        let found = measure::Measure::new(&solution.irradiance, &corners, truth);
        for (quantity, figures) in [
            ("rms at random points", found.points),
            ("rms at centroids", found.centroids),
        ] {
            self.add(
                Section::Error,
                what,
                quantity,
                "%",
                vec![100.0 * figures.rms],
            );
            if let Some(added) = self.found.measures.last_mut() {
                [added.low, added.high] = figures.rms_interval.map(|v| 100.0 * v);
            }
        }
        let bias = vec![100.0 * found.points.bias];
        self.add(Section::Error, what, "bias at random points", "%", bias);
    }

    /// By the form factors that are kept, the light being as before.
    fn relight(&mut self, what: &str, scene: &Scene, solver: &mut Solver) -> Result<bool> {
        let mut seconds = Vec::new();
        for _ in 0..self.plan.runs {
            let start = Instant::now();
            solver.relight(scene)?;
            solver.run(|_| (self.go_on)())?;
            seconds.push(start.elapsed().as_secs_f64());
            if !(self.go_on)() {
                return Ok(false);
            }
        }
        self.add(
            Section::Relight,
            what,
            "solving and gathering",
            "s",
            seconds,
        );
        Ok(true)
    }

    /// One scene of Table 1, by `draft`: bakes without directions, in 16 and in 64, and frames.
    /// False where `go_on` said no.
    pub fn table1(&mut self, name: &str, cache: Option<&std::path::Path>) -> Result<bool> {
        let builtin = LoadOptions {
            patches: self.plan.patches,
            ..LoadOptions::default()
        };
        let scene = load(name, &builtin)?;
        let what = format!("{name}, {} elements", scene.triangles.len());
        let kinds = [
            ("lambert", Transport::Lambert, 16),
            ("K = 16", Transport::Physical, 16),
            ("K = 64", Transport::Physical, 64),
        ];
        let mut baked: Vec<(&str, Vec<f64>, Solution)> = Vec::new();
        for (kind, transport, k) in kinds {
            let mut settings = Quality::Draft.settings();
            settings.relief.transport = transport;
            settings.relief.directions = Directions::new(k)?;
            let mut seconds = Vec::new();
            let mut solution = None;
            for _ in 0..self.plan.table_runs {
                let Some(run) = self.bake(&scene, &settings)? else {
                    return Ok(false);
                };
                seconds.push(run.seconds);
                solution = Some(run.solution);
            }
            baked.extend(solution.map(|solution| (kind, seconds, solution)));
        }
        for (kind, seconds, _) in &baked {
            self.add(Section::Table1, &what, kind, "s", seconds.clone());
        }
        let Some(camera) = scene.cameras.first() else {
            return Ok(true);
        };
        let (width, height) = table1::FRAME;
        let view = View {
            camera,
            width,
            height,
        };
        for (kind, _, solution) in &baked {
            let shadings: &[(&str, ReliefShading)] = match solution.relief {
                None => &[("plain", ReliefShading::None)],
                Some(_) => &[
                    ("factored", ReliefShading::Factored),
                    ("clusters", ReliefShading::Clusters),
                ],
            };
            for (shading, value) in shadings {
                let lighting = Lighting {
                    shading: *value,
                    cache,
                    ..Lighting::from(solution)
                };
                let renderer = Renderer::new(&self.device, &scene, lighting, &view, 1)?;
                renderer.frames(1)?;
                let times = renderer.frames(self.plan.frames)?;
                let times = times.into_iter().map(|s| 1e3 * s).collect();
                let quantity = format!("{shading}, {kind}");
                self.add(Section::Frames, &what, &quantity, "ms", times);
                if !(self.go_on)() {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }
}

/// Form factors that the device found.
fn pairs(report: &Report) -> f64 {
    let pairs = &report.pairs;
    (pairs.far + pairs.outline + pairs.parts + pairs.cut + pairs.near) as f64
}

/// The Cornell box of a plan and its path traced irradiance. None where `go_on` said no.
pub fn cornell(plan: &Plan, go_on: &impl Fn() -> bool) -> Result<Option<(Scene, Truth)>> {
    let builtin = LoadOptions {
        patches: Some(plan.elements),
        ..LoadOptions::default()
    };
    let scene = load("cornell", &builtin)?;
    let wanted = Wanted {
        sample: Sample::Some(plan.places),
        paths: plan.paths,
        seed: 0,
        direct: false,
    };
    let truth = irradiance::truth(&scene, &wanted, None, go_on)?;
    Ok(truth.map(|truth| (scene, truth)))
}
