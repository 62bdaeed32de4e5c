//! From a scene to a solution: the library's main road.

use std::sync::Arc;

use crate::elements::Elements;
use crate::error::Result;
use crate::meso::Relief;
use crate::scene::Scene;
use crate::solution::Solution;
use crate::solver::{Settings, Solver, Update};
use crate::vk::Device;

/// Bakes a scene. `go_on` sees every step and may stop it; what has been solved by then is a valid solution.
pub fn bake(
    device: &Arc<Device>,
    scene: &Scene,
    settings: &Settings,
    go_on: impl FnMut(&Update) -> bool,
) -> Result<Solution> {
    let elements = elements(device, scene, settings)?;
    let mut solver = Solver::new(device, elements, &scene.point_lights, settings)?;
    solver.run(go_on)?;
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
