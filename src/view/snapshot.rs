//! A solution as the window shows it: finished, or as far as it has come.

use std::sync::Arc;

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::corner_light::CornerLight;
use super::meter::Meter;
use crate::bake::solution::{Bake, DirectionalLight, Solution};
use crate::error::Result;
use crate::mesh::corners::Corners;
use crate::render::Lighting;
use crate::scene::{Scene, Triangle};
use crate::solver::{Ambient, Solver, StopReason, Update};

/// How far a bake has come.
#[derive(Debug, Clone, Copy, Default)]
pub struct Progress {
    /// Of the whole bake, not of the slice of it that was solved last.
    pub update: Update,
    pub done: bool,
}

/// What the light of a scene is shown with and does not depend on the light.
pub struct About {
    pub corners: Corners,
    meter: Meter,
}

impl About {
    pub fn new(scene: &Scene) -> Self {
        Self {
            corners: Corners::new(scene),
            meter: Meter::new(scene),
        }
    }
}

/// Light of a scene; values `[triangle]` in the order of the input, W·m⁻².
pub struct Snapshot {
    /// Counts the lightings of the session: a later one is of other lights or another bake.
    pub epoch: u64,
    /// The scene that is lit.
    pub scene: Arc<Scene>,
    pub irradiance: Vec<Vec3>,
    pub direct: Vec<Vec3>,
    pub relief: Option<DirectionalLight>,
    pub at_corners: CornerLight,
    pub about: Arc<About>,
    /// What has not been shot, spread evenly.
    pub ambient: Ambient,
    /// What surfaces reflect is still of the light before.
    pub lags: bool,
    /// Stops by which the light is exposed if nobody asks otherwise.
    pub exposure: f32,
    pub progress: Progress,
}

impl Snapshot {
    fn new(
        epoch: u64,
        scene: &Arc<Scene>,
        about: &Arc<About>,
        (irradiance, direct): (Vec<Vec3>, Vec<Vec3>),
        relief: Option<DirectionalLight>,
        ambient: Ambient,
        progress: Progress,
    ) -> Self {
        Self {
            epoch,
            at_corners: CornerLight::new(&about.corners, [&irradiance, &direct], relief.as_ref()),
            about: Arc::clone(about),
            exposure: about.meter.exposure(scene, &irradiance, ambient.irradiance),
            scene: Arc::clone(scene),
            irradiance,
            direct,
            relief,
            ambient,
            lags: false,
            progress,
        }
    }

    /// What a solver has found. `about` is of the scene.
    ///
    /// # Errors
    /// A device that fails.
    pub fn of_solver(
        epoch: u64,
        scene: &Arc<Scene>,
        about: &Arc<About>,
        solver: &Solver,
        progress: Progress,
    ) -> Result<Self> {
        let ambient = solver.ambient()?;
        let report = solver.report().clone();
        let Solution {
            irradiance,
            irradiance_direct,
            relief,
            ..
        } = Solution::new(scene, &solver.problem.elements, &solver.light()?, report);
        let light = (irradiance, irradiance_direct);
        Ok(Self::new(
            epoch, scene, about, light, relief, ambient, progress,
        ))
    }

    /// The direct light that a solver has brought, with what surfaces reflected `before`; none where
    /// that was of other elements.
    ///
    /// # Errors
    /// A device that fails.
    pub fn of_emitted(
        (epoch, scene, progress): (u64, &Arc<Scene>, Progress),
        about: &Arc<About>,
        solver: &Solver,
        before: &Self,
    ) -> Result<Option<Self>> {
        let report = solver.report().clone();
        let Solution {
            irradiance_direct: direct,
            relief,
            ..
        } = Solution::new(scene, &solver.problem.elements, &solver.light()?, report);
        let [of, of_before] = [&relief, &before.relief].map(|relief| {
            let relief = relief.as_ref();
            relief.map(|relief| (&relief.elements, relief.directions.len()))
        });
        if of != of_before || direct.len() != before.direct.len() {
            return Ok(None);
        }
        let and_reflected = |direct: Vec3, all: Vec3, direct_before: Vec3| {
            // What rounding leaves below none is none.
            direct + (all - direct_before).max(Vec3::ZERO)
        };
        let irradiance = (direct.iter().zip(&before.irradiance).zip(&before.direct))
            .map(|((&direct, &all), &of_it)| and_reflected(direct, all, of_it))
            .collect();
        let relief = relief.zip(before.relief.as_ref()).map(|(now, before)| {
            let moments = (now.incident_moment_direct.par_iter())
                .zip(&before.incident_moment)
                .zip(&before.incident_moment_direct)
                .map(|((direct, all), of_it)| {
                    std::array::from_fn(|colour| direct[colour] + all[colour] - of_it[colour])
                });
            DirectionalLight {
                incident_moment: moments.collect(),
                ..now
            }
        });
        let light = (irradiance, direct);
        let ambient = before.ambient;
        Ok(Some(Self {
            lags: true,
            ..Self::new(epoch, scene, about, light, relief, ambient, progress)
        }))
    }

    /// What a bake holds.
    pub fn of_bake(scene: &Arc<Scene>, bake: Bake) -> Self {
        let progress = Progress {
            done: true,
            ..Progress::default()
        };
        let light = (bake.irradiance, bake.irradiance_direct);
        let about = Arc::new(About::new(scene));
        let ambient = Ambient::default();
        Self::new(0, scene, &about, light, bake.relief, ambient, progress)
    }

    /// What is shown before any light is known: shapes and colours, as on a drawing table, brighter
    /// from one side than from another.
    pub fn unlit(scene: &Arc<Scene>) -> Self {
        let side = DVec3::new(0.5, 0.8, 0.35).normalize();
        let shade = |triangle: &Triangle| {
            let [a, b, c] = scene.corners(triangle);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            Vec3::splat((1.0 + 0.6 * normal.dot(side)) as f32)
        };
        let even: Vec<_> = scene.triangles.iter().map(shade).collect();
        let progress = Progress::default();
        let light = (even.clone(), even);
        let about = Arc::new(About::new(scene));
        Self::new(0, scene, &about, light, None, Ambient::default(), progress)
    }

    /// The light as pictures show it; `irradiance` stands in place of this one's own.
    pub fn lighting<'a>(&'a self, irradiance: &'a [Vec3]) -> Lighting<'a> {
        Lighting {
            irradiance_direct: Some(&self.direct),
            relief: self.relief.as_ref(),
            hide_backs: true,
            ..Lighting::from(irradiance)
        }
    }
}

/// ∫ L ω dω over each slot of a sky whose irradiance is 1, the directions of a slot taken as one; L
/// = 1/π.
pub fn even_moments(directions: &[DVec3]) -> Vec<Vec3> {
    let angle = std::f64::consts::TAU / directions.len() as f64;
    let moment = |d: &DVec3| (*d * (angle / std::f64::consts::PI)).as_vec3();
    directions.iter().map(moment).collect()
}

/// Why a bake that has stopped will not go on by itself.
pub fn is_done(stop: StopReason) -> bool {
    matches!(
        stop,
        StopReason::Residual | StopReason::Shots | StopReason::Budget | StopReason::Unsolved
    )
}
