//! `mesolux bench figure3`: the paper's Figure 3, direct, indirect and global light of two scenes.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use crate::bake;
use crate::error::{Error, Result};
use crate::picture::{Light, Picture};
use crate::render::{Lighting, Renderer, SAMPLES, View};
use crate::scene::{LoadOptions, load};
use crate::solver::{Settings, StopReason, Update};
use crate::vk::Device;

/// The rows: a point light and a bunny with relief; an area light and a horse with relief.
const SCENES: [&str; 2] = ["bowl-and-bunny", "cornell-relief"];

/// How both rows are made.
pub struct Options {
    /// The file's name.
    pub name: &'static str,
    /// Pixels a side of each of the six pictures.
    pub side: u32,
    /// Elements of each scene, the paper's numbers if not given.
    pub patches: Option<usize>,
    pub settings: Settings,
}

/// Bakes, draws, and writes one picture into `folder`: columns of direct, indirect and global
/// light, a row a scene, each exposed by its global light. `watch` hears how far a bake is; none is
/// written where it says no.
pub fn run(
    device: &Arc<Device>,
    options: &Options,
    folder: &Path,
    mut watch: impl FnMut(&Update) -> bool,
) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let path = folder.join(options.name);
    let mut rows = Vec::new();
    for name in SCENES {
        let builtin = LoadOptions {
            patches: options.patches,
            ..LoadOptions::default()
        };
        let scene = load(name, &builtin)?;
        let start = Instant::now();
        let solution = bake::bake(device, &scene, &options.settings, &mut watch)?;
        if solution.report.stop == StopReason::Interrupted {
            return Ok(());
        }
        let baked = start.elapsed().as_secs_f64();
        let Some(camera) = scene.cameras.first() else {
            unreachable!("the built-in scenes have cameras");
        };
        let view = View {
            camera,
            width: options.side,
            height: options.side,
        };
        let parts = [Light::Direct, Light::Indirect, Light::Global].map(|part| {
            let lighting = Lighting {
                part,
                cache: options.settings.relief.cache.as_deref(),
                ..Lighting::from(&solution)
            };
            Renderer::new(device, &scene, lighting, &view, SAMPLES)?.picture()
        });
        let parts: Vec<Picture> = parts.into_iter().collect::<Result<_>>()?;
        rows.push(Picture::side_by_side(&parts)?);
        let report = &solution.report;
        crate::say!(
            "{}: {name}, {} elements, {} hemicubes, error bound {:.2} %, baked in {baked:.1} s, \
             drawn in {:.1} s",
            path.display(),
            report.elements,
            report.hemicubes,
            100.0 * report.error_bound.unwrap_or(f64::NAN),
            start.elapsed().as_secs_f64() - baked
        );
    }
    Picture::stacked(&rows)?.write(&path, None)
}
