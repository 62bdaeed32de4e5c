//! `mesolux bench hemicube`: how fast item buffers are drawn, culled and not, of merged elements
//! and of all.

use std::sync::Arc;

use super::spread;
use crate::error::Result;
use crate::mesh::elements::Elements;
use crate::passes::cull::Culling;
use crate::scene::Scene;
use crate::solver::{Settings, Solver};
use crate::vk::Device;

/// What is culled, whether elements are merged, and the batches of each kind in a round.
const BATCHES: [(&str, Culling, bool, usize); 4] = [
    ("elements merged too", Culling::Triangles, true, 4),
    ("triangles culled too", Culling::Triangles, false, 4),
    ("meshlets culled", Culling::Meshlets, false, 2),
    ("no culling", Culling::Off, false, 1),
];

/// The sources of a batch, each batch spread over all of them.
fn batch_of_sources(solver: &Solver, batch: usize) -> Vec<u32> {
    let count = solver.problem.sources.list.len();
    let slots = (solver.report().batch as usize).min(count);
    let source = |slot: usize| ((slot * count / slots + batch) % count) as u32;
    (0..slots).map(source).collect()
}

/// Prints hemicubes a second, drawing alone (culling and item buffer) and with everything (form
/// factors, coupling and keeping too).
pub fn run(device: &Arc<Device>, scene: &Scene, hemicube: u32, rounds: usize) -> Result<()> {
    let mut solvers = Vec::new();
    for (_, culling, merging, _) in BATCHES {
        let settings = Settings {
            culling,
            merging,
            hemicube,
            // Never reached: the benchmark stops by itself.
            residual: 1e-12,
            ..Settings::default()
        };
        solvers.push(Solver::new(
            device,
            Elements::new(scene),
            &scene.lights,
            &settings,
        )?);
    }
    let mut draw = [const { Vec::new() }; BATCHES.len()];
    let mut whole = [const { Vec::new() }; BATCHES.len()];
    for round in 0..rounds.max(1) {
        for (i, (.., batches)) in BATCHES.iter().enumerate() {
            for batch in 0..*batches {
                let sources = batch_of_sources(&solvers[i], round * batches + batch);
                let stages = solvers[i].draw(&sources)?.stages;
                let count = sources.len() as f64;
                let drawing = stages.cull + stages.item_buffer;
                draw[i].push(count / drawing);
                whole[i].push(count / (drawing + stages.form_factors() + stages.keep));
            }
        }
    }
    crate::say!(
        "{}: {} elements, {} sources, hemicube {hemicube}, {}",
        scene.name,
        scene.triangles.len(),
        solvers[0].problem.sources.list.len(),
        device.name()
    );
    crate::say!(
        "hemicubes a second      drawn (10 % to 90 %)         with form factors and keeping"
    );
    for (i, (name, ..)) in BATCHES.iter().enumerate() {
        let (d, d10, d90) = spread(&mut draw[i]);
        let (w, w10, w90) = spread(&mut whole[i]);
        crate::say!("{name:<22}{d:>8.1} ({d10:.1} to {d90:.1}){w:>18.1} ({w10:.1} to {w90:.1})");
    }
    Ok(())
}
