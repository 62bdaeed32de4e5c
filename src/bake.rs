//! From a scene to a solution: the library's main road.

use std::sync::Arc;

use crate::elements::Elements;
use crate::error::Result;
use crate::meso::Relief;
use crate::scene::Scene;
use crate::solution::Solution;
use crate::solver::{self, Settings, Solver, Update, Visibility};
use crate::vk::Device;

/// Bakes a scene. `go_on` sees every step and may stop it; what has been solved by then is a valid solution.
pub fn bake(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solution> {
    solution(scene, &solve(device, scene, settings, None, go_on)?)
}

/// The solver of [`bake`] when it is done. With `kept`, what was drawn when the scene was lit otherwise is not drawn again.
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
    solve_on(&[Arc::clone(device)], scene, settings, kept, go_on)
}

/// As [`solve`], with several devices; see [`Solver::on_devices`].
pub fn solve_on(
    devices: &[Arc<Device>],
    scene: &Scene,
    settings: &Settings,
    kept: Option<&Visibility>,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solver> {
    let first = solver::check_devices(devices, settings)?;
    let elements = elements(first, scene, settings)?;
    if let Some(kept) = kept {
        kept.check(scene, settings)?;
    }
    let lights = &scene.point_lights;
    let mut solver = Solver::on_devices(devices, elements, lights, settings, kept)?;
    solver.run(go_on)?;
    Ok(solver)
}

/// What a solver has found of a scene.
pub fn solution(scene: &Scene, solver: &Solver) -> Result<Solution> {
    let mut report = solver.report().clone();
    report.skipped.degenerate_triangles = scene.dropped_degenerate as u64;
    Ok(Solution::new(
        scene,
        &solver.elements,
        &solver.light()?,
        report,
    ))
}

/// The elements of a scene, with their relief where `settings` want it.
pub fn elements(device: &Arc<Device>, scene: &Scene, settings: &Settings) -> Result<Elements> {
    let mut elements = Elements::new(scene);
    let relief = Relief::new(device, scene, &elements, &settings.relief)?;
    elements.set_relief(relief);
    Ok(elements)
}
