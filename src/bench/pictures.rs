//! `mesolux bench pictures`: the error of pictures of relief against path traced geometry.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::relief_room::{CASES, room};
use crate::atomic_file::write_atomically;
use crate::bake;
use crate::error::{Error, Result};
use crate::path_tracer::{PathTracer, Settings as Paths};
use crate::render::{Comparison, Flip, Light, Lighting, Picture, Renderer, View, side_by_side};
use crate::scene::{Scene, displace};
use crate::solver::Settings;
use crate::vk::Device;

/// What is drawn and how.
pub struct Options<'a> {
    /// Pixels a side.
    pub side: u32,
    /// Paths of each pixel, of direct and of indirect light each.
    pub paths: u32,
    /// Samples along a pixel's side, as [`Renderer::new`] takes them.
    pub samples: u32,
    pub settings: &'a Settings,
}

/// One picture against its reference.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub scene: String,
    /// The camera's name.
    pub view: String,
    /// direct, indirect or global.
    pub light: &'static str,
    /// [`Comparison::rel_mse`] less `noise`.
    pub rel_mse: f64,
    /// The contribution of the reference's noise to relMSE.
    pub noise: f64,
    pub bias: f64,
    pub rms: f64,
    /// Mean HDR-ꟻLIP, in which the reference's noise counts as a difference.
    pub flip: f64,
}

pub const HEADER: &str =
    "scene          view         light       relMSE  (noise)     bias      rms  HDR-FLIP";

/// The reference, with the variance of its noise.
pub struct Reference {
    pub picture: Picture,
    /// RGB, `[pixel]`.
    variance: Vec<DVec3>,
}

impl Reference {
    /// `go_on` gets the paths a pixel that are traced now and then; false stops with those.
    ///
    /// # Errors
    /// As [`PathTracer::render`].
    pub fn new(
        tracer: &PathTracer<'_>,
        view: &View<'_>,
        light: Light,
        paths: u32,
        go_on: impl Fn(u32) -> bool,
    ) -> Result<Self> {
        let settings = Paths {
            paths,
            light,
            ..Paths::default()
        };
        let film = tracer.render(view, &settings, |progress, _| go_on(progress.paths))?;
        Ok(Self {
            picture: film.picture(),
            variance: film.standard_error().iter().map(|e| e * e).collect(),
        })
    }

    /// The sum of two independent parts of the light.
    pub fn plus(&self, other: &Self) -> Self {
        let pairs = self.picture.radiance.iter().zip(&other.picture.radiance);
        let radiance: Vec<[f32; 3]> = pairs
            .map(|(a, b)| std::array::from_fn(|c| a[c] + b[c]))
            .collect();
        let metered = vec![true; radiance.len()];
        let variance = self.variance.iter().zip(&other.variance);
        Self {
            picture: Picture::new(
                (self.picture.width, self.picture.height),
                radiance,
                &metered,
            ),
            variance: variance.map(|(a, b)| a + b).collect(),
        }
    }

    /// [`Comparison::rel_mse`] of a perfect picture against the noisy reference.
    pub fn noise(&self) -> f64 {
        let values = self.picture.radiance.as_flattened();
        let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / values.len() as f64;
        let variance = self.variance.iter().flat_map(DVec3::to_array);
        variance
            .zip(values)
            .map(|(variance, &b)| variance / (f64::from(b).powi(2) + (0.01 * mean).powi(2)))
            .sum::<f64>()
            / values.len() as f64
    }
}

/// The room with a flat floor and those with a relief, or the one with this material.
///
/// # Errors
/// An unknown material.
pub fn rooms(material: Option<&str>) -> Result<Vec<Scene>> {
    let wanted = |name: &str| material.is_none_or(|only| only == name);
    let cases = CASES.iter().filter(|case| wanted(case.name));
    let rooms: Vec<Scene> = cases.map(room).collect();
    match material {
        Some(unknown) if rooms.is_empty() => Err(Error::Usage(format!(
            "no material \"{unknown}\"; there is {}",
            CASES.map(|case| case.name).join(", ")
        ))),
        _ => Ok(rooms),
    }
}

/// Bakes, draws and traces each scene by all of its cameras, prints a row a picture, writes the
/// pictures beside their reference and difference into `folder` and updates `pictures.csv` and
/// `pictures.json` there. `go_on` gets a line on what is under way, often; false stops, and leaves
/// out what was not finished.
///
/// # Errors
/// A device that fails; files that cannot be written.
pub fn run(
    device: &Arc<Device>,
    scenes: &[Scene],
    options: &Options<'_>,
    folder: &Path,
    go_on: impl Fn(String) -> bool,
) -> Result<Vec<Row>> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    crate::say!("{HEADER}");
    let mut rows = Vec::new();
    let go_on = &go_on;
    for scene in scenes {
        let solution = bake::bake(device, scene, options.settings, |update| {
            let unshot = 100.0 * update.unshot_share;
            go_on(format!("{}: baking, unshot {unshot:.3} %", scene.name))
        })?;
        if !go_on(format!("{}: displacing the reference", scene.name)) {
            return Ok(rows);
        }
        let fine = displace(scene)?;
        let tracer = PathTracer::new(&fine)?;
        for camera in &scene.cameras {
            let view = View {
                camera,
                width: options.side,
                height: options.side,
            };
            let name = format!("{}, {}", scene.name, camera.name);
            let trace = |light, of| {
                Reference::new(&tracer, &view, light, options.paths, |paths| {
                    let all = options.paths;
                    go_on(format!(
                        "{name}: tracing {of} light, {paths} of {all} paths"
                    ))
                })
            };
            let direct = trace(Light::Direct, "direct")?;
            let indirect = trace(Light::Indirect, "indirect")?;
            if !go_on(format!("{name}: drawing")) {
                return Ok(rows);
            }
            let global = direct.plus(&indirect);
            for (part, name, reference) in [
                (Light::Direct, "direct", &direct),
                (Light::Indirect, "indirect", &indirect),
                (Light::Global, "global", &global),
            ] {
                let lighting = Lighting {
                    part,
                    cache: options.settings.relief.cache.as_deref(),
                    ..Lighting::from(&solution)
                };
                let renderer = Renderer::new(device, scene, lighting, &view, options.samples)?;
                let picture = renderer.picture()?;
                let found = Comparison::new(&picture, &reference.picture)?;
                let noise = reference.noise();
                let row = Row {
                    scene: scene.name.clone(),
                    view: camera.name.clone(),
                    light: name,
                    rel_mse: found.rel_mse - noise,
                    noise,
                    bias: found.bias,
                    rms: found.rms,
                    flip: Flip::new(&picture, &reference.picture)?.mean(),
                };
                crate::say!("{}", line(&row));
                rows.push(row);
                let beside = side_by_side(&picture, &reference.picture)?;
                beside.write(&folder.join(file_name(rows.last().expect("pushed"))), None)?;
            }
            write(&rows, folder)?;
        }
    }
    Ok(rows)
}

/// Name of the file with a row's picture.
pub fn file_name(row: &Row) -> String {
    let name = format!("{}-{}-{}", row.scene, row.view, row.light);
    name.replace(|c: char| !c.is_alphanumeric(), "-") + ".png"
}

fn line(row: &Row) -> String {
    format!(
        "{:<14} {:<12} {:<8} {:>9.2e} ({:.1e}) {:>+6.2} % {:>6.2} %   {:.4}",
        row.scene,
        row.view,
        row.light,
        row.rel_mse,
        row.noise,
        100.0 * row.bias,
        100.0 * row.rms,
        row.flip
    )
}

fn write(rows: &[Row], folder: &Path) -> Result<()> {
    let json = folder.join("pictures.json");
    let text = serde_json::to_string_pretty(rows).map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("pictures.csv"), |out| {
        writeln!(out, "scene,view,light,rel_mse,noise,bias,rms,hdr_flip")?;
        for r in rows {
            writeln!(
                out,
                "{},{},{},{},{},{},{},{}",
                r.scene, r.view, r.light, r.rel_mse, r.noise, r.bias, r.rms, r.flip
            )?;
        }
        Ok(())
    })
}
