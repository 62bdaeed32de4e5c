//! What a scene is lit by before the bake that was asked for.

use crate::bake::quality::Quality;
use crate::mesh::near::Nearness;
use crate::meso::Transport;
use crate::scene::{Material, Scene};
use crate::solver::{Estimator, Settings};
use crate::view::orders::Stage;

/// Triangles of a scene from which on a coarse bake comes first.
const MANY: usize = 1 << 13;

/// Under a sky a first light is of the suns, or where they are not the only other lights, of so
/// many sources, the strongest: rays to each part of the sky take long, and what was not shot is
/// shown spread evenly.
const FIRST_OF_SKY: u32 = 4;

/// Whether a scene has relief that takes part.
pub(super) fn raises(scene: &Scene, settings: &Settings) -> bool {
    let raised = settings.relief.transport != Transport::Lambert;
    raised && scene.materials.iter().any(Material::has_relief)
}

pub(super) fn first_stage(scene: &Scene, settings: &Settings) -> Stage {
    match raises(scene, settings) {
        true => Stage::Flat,
        false => Stage::First,
    }
}

/// What a scene is lit by first; none where the bake itself is as quick.
pub(super) fn first_light(scene: &Scene, settings: &Settings) -> Option<Settings> {
    let preview = Quality::Preview.settings();
    let coarser = preview.grouping.max_area > settings.grouping.max_area
        && settings.estimator == Estimator::Receiver
        && scene.triangles.len() >= MANY;
    if coarser {
        let suns = scene.lights.suns.len() as u32;
        let others = !scene.lights.points.is_empty() || scene.materials.iter().any(Material::emits);
        let of_sky = match suns == 0 || others {
            true => FIRST_OF_SKY,
            false => suns,
        };
        let first = scene.lights.sky.is_some().then_some(of_sky);
        return Some(Settings {
            residual: preview.residual.max(settings.residual),
            budget: settings.budget,
            shots: [settings.shots, first].into_iter().flatten().min(),
            seed: settings.seed,
            ..quick(&preview)
        });
    }
    raises(scene, settings).then(|| quick(settings))
}

/// Without relief and near sources: to find these takes most of the time before the first picture.
fn quick(settings: &Settings) -> Settings {
    Settings {
        nearness: Nearness::NONE,
        ..flat(settings)
    }
}

/// The same without relief.
pub(super) fn flat(settings: &Settings) -> Settings {
    let mut settings = settings.clone();
    settings.relief.transport = Transport::Lambert;
    settings
}
