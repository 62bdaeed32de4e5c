//! Bakes over a grid of settings, each measured at several times.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::Vec3;

use super::{Method, Row};
use crate::bake;
use crate::bake::quality::sized;
use crate::bench::measure::Measure;
use crate::bench::truth::Truth;
use crate::error::Result;
use crate::math::directions::Directions;
use crate::meso::Transport;
use crate::scene::Scene;
use crate::solver::{Estimator, HEMICUBE_RANGE, Settings, Solver, StopReason};
use crate::vk::Device;

/// The settings that are tried: each hemicube with each size of sources, for both estimators.
#[derive(Debug, Clone)]
pub struct Grid {
    pub hemicubes: Vec<u32>,
    /// Sides of the hemicubes of strong emitters over those; 0 for [`Settings::emitter_shadows`].
    pub emitter_scales: Vec<u32>,
    /// Sizes of sources over the default ones, and what goes with them, see [`sized`].
    pub scales: Vec<f64>,
    /// Hemicubes of the `pixel` estimator, at the default size of sources and at the smallest.
    pub pixel_hemicubes: Vec<u32>,
    /// Numbers of directions, at the default hemicube and size of sources; tried where a scene has
    /// relief.
    pub directions: Vec<u32>,
    /// Each bake goes on to this error bound,
    pub residual: f64,
    /// or until it has taken this long.
    pub limit: Duration,
}

/// One bake to be made.
#[derive(Debug, Clone, Copy)]
pub(super) struct Try {
    pub estimator: Estimator,
    pub hemicube: u32,
    pub emitter_scale: u32,
    pub scale: f64,
    pub directions: u32,
}

/// A bake that is done, `[triangle]` in the order of the input.
pub(super) struct Done {
    pub rows: Vec<Row>,
    pub irradiance: Vec<Vec3>,
    pub direct: Vec<Vec3>,
}

/// Time of the first measurement of a bake; each further one is twice as late.
const FIRST_LOOK: Duration = Duration::from_millis(500);

impl Grid {
    pub(super) fn tries(&self, scene: &Scene) -> Vec<Try> {
        let plain = Settings::default();
        let directions = plain.relief.directions.count() as u32;
        let mut tries = Vec::new();
        let smallest = self.scales.iter().copied().fold(1.0, f64::min);
        let finer = || self.emitter_scales.iter().copied();
        let both = |list: &[u32]| -> Vec<(u32, u32)> {
            let each = list.iter().flat_map(|&n| finer().map(move |e| (n, e)));
            each.collect()
        };
        for &scale in &self.scales {
            for (hemicube, emitter_scale) in both(&self.hemicubes) {
                tries.push(Try {
                    estimator: Estimator::Receiver,
                    hemicube,
                    emitter_scale,
                    scale,
                    directions,
                });
            }
            let by_pixel = scene.lights.beyond_points().is_none();
            if by_pixel && (scale == 1.0 || scale == smallest) {
                let pixel = both(&self.pixel_hemicubes).into_iter();
                tries.extend(pixel.map(|(hemicube, emitter_scale)| Try {
                    estimator: Estimator::Pixel,
                    hemicube,
                    emitter_scale,
                    scale,
                    directions,
                }));
            }
        }
        if scene.materials.iter().any(|m| m.has_relief()) {
            let others = self.directions.iter().filter(|&&k| k != directions);
            tries.extend(others.map(|&directions| Try {
                estimator: Estimator::Receiver,
                hemicube: plain.hemicube,
                emitter_scale: 0,
                scale: 1.0,
                directions,
            }));
        }
        tries
    }
}

impl Try {
    fn emitter_hemicube(&self) -> Option<u32> {
        let finer = self.hemicube.saturating_mul(self.emitter_scale);
        (finer > 0).then(|| finer.min(*HEMICUBE_RANGE.end()))
    }

    fn settings(&self, grid: &Grid) -> Result<Settings> {
        let mut settings = Settings {
            estimator: self.estimator,
            emitter_hemicube: self.emitter_hemicube(),
            residual: grid.residual,
            ..sized(self.hemicube, self.scale)
        };
        settings.relief.directions = Directions::new(self.directions)?;
        if self.estimator == Estimator::Pixel {
            settings.relief.transport = Transport::Lambert;
        }
        Ok(settings)
    }

    /// Bakes and measures. The cost of measuring does not count; `go_on` may stop the bake between
    /// measurements.
    pub fn bake(
        &self,
        device: &Arc<Device>,
        scene: &Scene,
        grid: &Grid,
        truth: &Truth,
        go_on: &impl Fn() -> bool,
    ) -> Result<Done> {
        let start = Instant::now();
        let settings = self.settings(grid)?;
        let elements = bake::elements(device, scene, &settings)?;
        let mut solver = Solver::new(device, elements, &scene.lights, &settings)?;
        let mut taken = start.elapsed();
        let mut done = Done {
            rows: Vec::new(),
            irradiance: Vec::new(),
            direct: Vec::new(),
        };
        let mut look = FIRST_LOOK;
        while look <= taken {
            look *= 2;
        }
        loop {
            let until = look.min(grid.limit.max(taken));
            let (turn, before) = (Instant::now(), taken);
            let in_time = || before + turn.elapsed() < until;
            solver.run(|update| (!update.draws || in_time()) && go_on())?;
            taken += turn.elapsed();
            let report = solver.report();
            let finished = report.stop != StopReason::Interrupted;
            let solution = bake::solution(scene, &solver)?;
            let corners = solution.corners.unwrap_or_default().irradiance;
            let measure = Measure::new(&solution.irradiance, &corners, truth);
            done.irradiance = solution.irradiance;
            done.direct = solution.irradiance_direct;
            done.rows.push(Row {
                method: match self.estimator {
                    Estimator::Receiver => Method::Receiver,
                    Estimator::Pixel | Estimator::Paper => Method::Pixel,
                },
                hemicube: Some(self.hemicube),
                emitter_hemicube: settings.emitter_shadows().face(),
                source_scale: Some(self.scale),
                directions: solver
                    .problem
                    .elements
                    .relief
                    .as_ref()
                    .map(|r| r.directions.count() as u32),
                sources: Some(report.sources),
                hemicubes: Some(report.hemicubes),
                paths: None,
                error_bound: report.error_bound,
                finished,
                seconds: taken.as_secs_f64(),
                measure,
                best: false,
            });
            if finished || taken >= grid.limit || !go_on() {
                return Ok(done);
            }
            while look <= taken {
                look *= 2;
            }
        }
    }
}
