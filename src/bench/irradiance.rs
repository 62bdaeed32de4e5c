//! `mesolux bench irradiance`: irradiance of a bake against the path tracer, which knows nothing of
//! hemicubes, sources or slots and sees relief as geometry.

use std::path::{Path, PathBuf};

use glam::Vec3;
use serde::Serialize;

use super::measure::Measure;
use super::truth::{Truth, Wanted};
use crate::atomic_file::write_atomically;
use crate::bake::solution::{Bake, corner_light};
use crate::error::{Error, Result};
use crate::scene::{Scene, displace};

/// A bake and its error.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub bake: PathBuf,
    pub places: usize,
    /// Standard error of the reference at a centroid over the mean; the errors are without it.
    pub noise: f64,
    #[serde(flatten)]
    pub measure: Measure,
}

/// The truth of a scene, as [`Truth::of`] gives it.
///
/// # Errors
/// A scene without elements that can be compared, a folder that cannot be written.
pub fn truth(
    scene: &Scene,
    wanted: &Wanted,
    folder: Option<&Path>,
    go_on: &impl Fn() -> bool,
) -> Result<Option<Truth>> {
    Truth::of(scene, &displace(scene)?, wanted, folder, go_on)
}

/// Error of the irradiance of elements, `[triangle]`, linear between corners as a bake's is; None
/// when `go_on` returned false.
///
/// # Errors
/// A scene without elements that can be compared.
pub fn of_elements(
    scene: &Scene,
    irradiance: &[Vec3],
    wanted: &Wanted,
    go_on: &impl Fn() -> bool,
) -> Result<Option<Measure>> {
    let truth = truth(scene, wanted, None, go_on)?;
    Ok(truth.map(|truth| Measure::of_elements(scene, irradiance, &truth)))
}

impl Row {
    pub fn new(path: &Path, scene: &Scene, bake: &Bake, truth: &Truth) -> Self {
        let made;
        let corners = match &bake.corner_irradiance {
            Some(corners) => corners,
            None => {
                made = corner_light(scene, &bake.irradiance);
                &made
            }
        };
        Self {
            bake: path.to_owned(),
            places: truth.places.len(),
            noise: truth.noise(),
            measure: Measure::new(&bake.irradiance, corners, truth),
        }
    }

    pub fn print(&self) {
        let Self { bake, places, .. } = self;
        let noise = 100.0 * self.noise;
        crate::say!(
            "{}: {places} places without relief and emission, noise of a reference {noise:.2} %, taken off",
            bake.display()
        );
        let measured = [
            ("centroids", self.measure.centroids),
            ("random points", self.measure.points),
        ];
        for (at, m) in measured {
            let [low, high] = m.rms_interval.map(|rms| 100.0 * rms);
            crate::say!(
                "  {at}: rms {:.2} % ({low:.2} to {high:.2}), bias {:+.2} % ± {:.2} (95 %), {} % of the squared error in the worst 0.1 % of the area",
                100.0 * m.rms,
                100.0 * m.bias,
                100.0 * m.bias_interval,
                m.worst_percent()
            );
        }
    }
}

/// Writes `irradiance.csv` and `irradiance.json` into `folder`.
///
/// # Errors
/// A folder that cannot be written.
pub fn write(rows: &[Row], folder: &Path) -> Result<()> {
    let json = folder.join("irradiance.json");
    let text = serde_json::to_string_pretty(rows).map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("irradiance.csv"), |out| {
        writeln!(
            out,
            "bake,places,noise,rms,rms_low,rms_high,bias,bias_interval,worst_share,points_rms,points_rms_low,points_rms_high,points_bias,points_bias_interval,points_worst_share"
        )?;
        for row in rows {
            let (bake, measure) = (row.bake.display(), &row.measure);
            let [centroids, points] = [measure.centroids, measure.points].map(|m| m.cells());
            writeln!(
                out,
                "{bake},{},{},{centroids},{points}",
                row.places, row.noise
            )?;
        }
        Ok(())
    })
}
