//! `mesolux bench pictures`: the error of pictures of relief against path traced geometry.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::Serialize;

use super::relief_room::{ANGLES, CASES, room};
use crate::atomic_file::write_atomically;
use crate::bake;
use crate::error::{Error, Result};
use crate::meso::Options as ReliefOptions;
use crate::path_tracer::{PathTracer, Settings as Paths};
use crate::render::{Comparison, Flip, Light, Lighting, Picture, View, render, side_by_side};
use crate::scene::displace;
use crate::solver::Settings;
use crate::vk::Device;

/// What is drawn and how.
pub struct Options<'a> {
    /// Pixels a side.
    pub side: u32,
    /// Paths of each pixel, of direct and of indirect light each.
    pub paths: u32,
    /// Only this material; None draws all.
    pub material: Option<&'a str>,
    /// Shading, direct light and cache of the pictures; its light is ignored.
    pub lighting: Lighting<'a>,
}

/// One picture against its reference.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub material: String,
    /// Degrees from straight above.
    pub angle: f64,
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
    "material  angle  light     relMSE    (noise)   bias      rms     HDR-FLIP";

/// The reference, with the variance of its noise.
pub struct Reference {
    pub picture: Picture,
    /// RGB, `[pixel]`.
    variance: Vec<DVec3>,
}

impl Reference {
    /// # Errors
    /// As [`PathTracer::render`].
    pub fn new(tracer: &PathTracer<'_>, view: &View<'_>, light: Light, paths: u32) -> Result<Self> {
        let settings = Paths {
            paths,
            light,
            ..Paths::default()
        };
        let film = tracer.render(view, &settings, |_, _| true)?;
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

/// Bakes, draws and traces each material, prints a row a picture, writes the pictures beside their
/// reference and difference into `folder` and updates `pictures.csv` and `pictures.json` there.
/// `go_on` is called before each view; false stops.
///
/// # Errors
/// An unknown material; a device that fails; files that cannot be written.
pub fn run(
    device: &Arc<Device>,
    options: &Options<'_>,
    folder: &Path,
    mut go_on: impl FnMut() -> bool,
) -> Result<Vec<Row>> {
    let wanted = |name: &str| options.material.is_none_or(|only| only == name);
    if !CASES.iter().any(|case| wanted(case.name)) {
        let names: Vec<_> = CASES.iter().map(|case| case.name).collect();
        return Err(Error::Usage(format!(
            "no material \"{}\"; there is {}",
            options.material.unwrap_or_default(),
            names.join(", ")
        )));
    }
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let settings = Settings {
        relief: ReliefOptions {
            cache: options.lighting.cache.map(Path::to_owned),
            ..ReliefOptions::default()
        },
        ..Settings::default()
    };
    crate::say!("{HEADER}");
    let mut rows = Vec::new();
    for case in CASES.iter().filter(|case| wanted(case.name)) {
        let scene = room(case);
        let solution = bake::bake(device, &scene, &settings, |_| true)?;
        let fine = displace(&scene)?;
        let tracer = PathTracer::new(&fine)?;
        for (camera, angle) in scene.cameras.iter().zip(ANGLES) {
            if !go_on() {
                return Ok(rows);
            }
            let view = View {
                camera,
                width: options.side,
                height: options.side,
            };
            let direct = Reference::new(&tracer, &view, Light::Direct, options.paths)?;
            let indirect = Reference::new(&tracer, &view, Light::Indirect, options.paths)?;
            let global = direct.plus(&indirect);
            for (part, name, reference) in [
                (Light::Direct, "direct", &direct),
                (Light::Indirect, "indirect", &indirect),
                (Light::Global, "global", &global),
            ] {
                let lighting = Lighting {
                    part,
                    shading: options.lighting.shading,
                    direct: options.lighting.direct,
                    cache: options.lighting.cache,
                    ..Lighting::from(&solution)
                };
                let picture = render(device, &scene, lighting, &view)?;
                let found = Comparison::new(&picture, &reference.picture)?;
                let noise = reference.noise();
                let row = Row {
                    material: case.name.into(),
                    angle,
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
                beside.write(
                    &folder.join(format!("{}-{angle}-{name}.png", case.name)),
                    None,
                )?;
            }
            write(&rows, folder)?;
        }
    }
    Ok(rows)
}

fn line(row: &Row) -> String {
    format!(
        "{:<9} {:>5}  {:<8} {:>9.2e} ({:.1e}) {:>+7.2} % {:>6.2} % {:>9.4}",
        row.material,
        row.angle,
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
        writeln!(out, "material,angle,light,rel_mse,noise,bias,rms,hdr_flip")?;
        for r in rows {
            writeln!(
                out,
                "{},{},{},{},{},{},{},{}",
                r.material, r.angle, r.light, r.rel_mse, r.noise, r.bias, r.rms, r.flip
            )?;
        }
        Ok(())
    })
}
