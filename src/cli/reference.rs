//! `mesolux render --reference`.

use std::time::Duration;

use clap::Args;

use super::progress::{Bar, catch_interrupts, interrupted};
use mesolux::error::Result;
use mesolux::path_tracer::{Film, PathTracer, Settings};
use mesolux::render::{Light, View};
use mesolux::scene::{Scene, displace};

/// Options of the path tracer.
#[derive(Args)]
pub struct ReferenceOptions {
    /// Trace paths on the CPU instead of baking: unbiased, relief as geometry, no Vulkan device
    ///
    /// Prints the picture's mean with its 95 % confidence interval. Ctrl-C, or --budget, keeps the
    /// paths so far.
    #[arg(long, conflicts_with_all = [
        "estimator", "quality", "hemicube", "residual", "source_elements", "source_area",
        "source_power", "shots", "visibility_memory", "no_normalise", "no_carry", "directions", "transport",
        "cache", "no_cache", "device", "validate",
    ])]
    pub reference: bool,
    /// Paths of each pixel [default: 256]
    #[arg(long, value_name = "N", requires = "reference")]
    paths: Option<u32>,
}

impl ReferenceOptions {
    pub fn settings(&self, budget: Option<Duration>, seed: u64, light: Light) -> Settings {
        let default = Settings::default();
        Settings {
            paths: self.paths.unwrap_or(default.paths),
            budget,
            seed,
            light,
        }
    }
}

/// The scene with its relief as geometry.
pub fn tessellated(scene: Scene) -> Result<Scene> {
    if !scene.materials.iter().any(|m| m.has_relief()) {
        return Ok(scene);
    }
    let fine = displace(&scene)?;
    tracing::info!(
        "relief as geometry: {} triangles instead of {}",
        fine.triangles.len(),
        scene.triangles.len()
    );
    Ok(fine)
}

/// Traces the picture and prints its confidence interval.
pub fn draw(scene: &Scene, view: &View<'_>, settings: &Settings) -> Result<Film> {
    let tracer = PathTracer::new(scene)?;
    catch_interrupts();
    let bar = Bar::new();
    let film = tracer.render(view, settings, |progress, _| {
        bar.show(format!(
            "{} of {} paths a pixel in {:.0} s",
            progress.paths,
            progress.of,
            progress.elapsed.as_secs_f64()
        ));
        !interrupted()
    });
    bar.finish();
    let film = film?;
    let (mean, half) = film.mean();
    tracing::info!(
        "{} paths a pixel in {:.1} s; mean radiance {:.6} {:.6} {:.6} ± {:.2e} {:.2e} {:.2e} (95 %); \
         rms relative standard error of a pixel {:.2} %",
        film.paths,
        film.elapsed.as_secs_f64(),
        mean.x,
        mean.y,
        mean.z,
        half.x,
        half.y,
        half.z,
        100.0 * film.relative_error()
    );
    Ok(film)
}
