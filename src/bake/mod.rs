//! From a scene to a solution: the library's main entry.

pub mod cache;
pub mod discretisation;
pub mod lit_scene;
pub mod quality;
pub mod solution;

use std::sync::Arc;
use std::time::Instant;

use crate::bake::solution::Solution;
use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::meso::{self, HeightField, Relief};
use crate::passes::relief_visibility::ReliefVisibility;
use crate::scene::Scene;
use crate::solver::{Crew, Settings, Solver, Update, Visibility};
use crate::vk::Device;

/// Bakes a scene. `go_on` is called at every step; when it returns false, the bake stops, and what
/// has been solved by then is a valid solution.
///
/// # Errors
/// Settings out of range; a scene that does not fit the device; a device that fails.
pub fn bake(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solution> {
    solution(scene, &solve(device, scene, settings, None, go_on)?)
}

/// As [`bake`], and returns the solver. With `kept`, hemicubes that were drawn under other light
/// are not drawn again.
///
/// # Errors
/// `kept` is of another scene or other settings.
pub fn solve(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solver> {
    solve_by(&device.into(), scene, settings, kept, go_on)
}

/// As [`solve`], with several devices; see [`Solver::by`]. With
/// [`Settings::checkpoints`] it goes on from what a bake of the same kind has left that was killed.
pub fn solve_by(
    crew: &Crew,
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solver> {
    let start = Instant::now();
    let first = crew.check(settings)?;
    let elements = elements(first, scene, settings)?;
    if let Some(kept) = kept {
        kept.check(scene, settings)?;
    }
    let lights = &scene.lights;
    let mut solver = Solver::by(crew, elements, lights, settings, kept)?;
    if settings.checkpoints.is_some() {
        let rows = kept.map(Visibility::described).unwrap_or_default();
        solver.keep_checkpoints(&format!("{} {rows}", scene.hash()))?;
    }
    solver.spend(start.elapsed());
    solver.run(go_on)?;
    Ok(solver)
}

/// The solution that a solver of `scene` has reached.
pub fn solution(scene: &Scene, solver: &Solver) -> Result<Solution> {
    let light = solver.light()?;
    let mut report = solver.report().clone();
    report.submissions = solver.submissions();
    report.skipped.degenerate_triangles = scene.dropped_degenerate as u64;
    report.notes = [scene.notes.as_slice(), &scene.warnings].concat();
    let elements = &solver.problem.elements;
    Ok(Solution::new(scene, elements, &light, report).with_corners(scene))
}

/// The elements of a scene, with their relief where `settings` want it.
pub fn elements(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Elements> {
    let mut elements = Elements::new(scene);
    let relief = Relief::new(scene, &elements, &settings.relief, &mut marcher(device))?;
    elements.set_relief(relief);
    Ok(elements)
}

/// Marches height fields on a device. The pass is made at the first call, so that a run that finds
/// all visibility in its cache makes none.
pub(crate) fn marcher(
    device: &Arc<Device>,
) -> impl FnMut(&HeightField) -> Result<meso::Visibility> {
    let mut pass = None;
    move |field| {
        let pass = match &mut pass {
            Some(pass) => pass,
            none => none.insert(ReliefVisibility::new(device)?),
        };
        pass.run(field)
    }
}
