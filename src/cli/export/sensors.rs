//! Options of sensors.

use std::path::PathBuf;

use clap::Args;

use crate::cli::output::writable;
use crate::cli::progress::{Bar, catch_interrupts, interrupted};
use mesolux::error::{Error, Result};
use mesolux::export::sensors::{self, SensorFile, SensorGrid};
use mesolux::scene::Scene;
use mesolux::solver::{LightAt, Lit, Place};

#[derive(Args)]
#[command(next_help_heading = "Sensors")]
pub struct SensorOptions {
    /// Points with their normals, `x y z nx ny nz` a line, as Radiance reads them
    #[arg(long, value_name = "POINTS.pts", requires = "values")]
    sensors: Option<PathBuf>,
    /// Sensors on the mesh or material NAME, one each SPACING, HEIGHT above it, scene units; may be
    /// given several times
    #[arg(long, value_name = "NAME,SPACING[,HEIGHT]", value_parser = grid, requires = "values")]
    sensor_grid: Vec<SensorGrid>,
    /// Where to write the light at the sensors: .csv (lux and W/m², direct and indirect), .dat
    /// (W/m², red green blue), .ill (lux)
    #[arg(long, value_name = "OUT.csv|.dat|.ill")]
    pub values: Option<PathBuf>,
    /// Lumens of a watt, by which irradiance becomes lux: 179 as in Radiance; 683 gives the lux of
    /// lamps that are given in lumens, candelas or lux, and of IES files
    #[arg(long, value_name = "LM", default_value_t = sensors::RADIANCE_EFFICACY)]
    lumens_per_watt: f64,
}

fn grid(text: &str) -> std::result::Result<SensorGrid, String> {
    let wrong = || "must be like floor,0.5 or floor,0.5,0.85".to_owned();
    let words: Vec<&str> = text.split(',').collect();
    let (name, spacing, height) = match words.as_slice() {
        [name, spacing] => (name, spacing, "0"),
        [name, spacing, height] => (name, spacing, *height),
        _ => return Err(wrong()),
    };
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|n| n.is_finite());
    let spacing = number(spacing).filter(|&s| s > 0.0).ok_or_else(wrong)?;
    Ok(SensorGrid {
        name: (*name).to_owned(),
        spacing,
        height: number(height).ok_or_else(wrong)?,
    })
}

/// Most sensors of one grid.
const MOST_SENSORS: usize = 10_000_000;

impl SensorOptions {
    pub fn check(&self) -> Result<()> {
        let Some(values) = &self.values else {
            return Ok(());
        };
        if self.sensors.is_none() && self.sensor_grid.is_empty() {
            return Err(Error::Usage(format!(
                "--values {}: of which sensors? --sensors or --sensor-grid says",
                values.display()
            )));
        }
        if !(self.lumens_per_watt.is_finite() && self.lumens_per_watt > 0.0) {
            let given = self.lumens_per_watt;
            let what = format!("--lumens-per-watt {given}: must be a positive number");
            return Err(Error::Usage(what));
        }
        SensorFile::of(values)?;
        writable(values)
    }

    pub fn places(&self, scene: &Scene) -> Result<Vec<Place>> {
        let mut places = match &self.sensors {
            Some(path) => sensors::read_points(path)?,
            None => Vec::new(),
        };
        for grid in &self.sensor_grid {
            places.extend(sensors::on_grid(scene, grid, MOST_SENSORS)?);
        }
        Ok(places)
    }

    /// Writes the light at places, as far as there is time for before Ctrl-C.
    pub fn write(&self, lit: &Lit<'_>, places: &[Place]) -> Result<()> {
        let Some(path) = &self.values else {
            return Ok(());
        };
        let light = at_places(lit, places)?;
        let efficacy = self.lumens_per_watt;
        sensors::write_light(path, &places[..light.len()], &light, efficacy)?;
        tracing::info!("{}: {} sensors", path.display(), light.len());
        if light.len() < places.len() {
            let missing = places.len() - light.len();
            tracing::warn!("{missing} sensors are missing: stopped by Ctrl-C");
        }
        Ok(())
    }
}

/// Places that are looked at between two looks at the keyboard.
const AT_ONCE: usize = 512;

/// Light at places, of as many as there is time for before Ctrl-C.
fn at_places(lit: &Lit<'_>, places: &[Place]) -> Result<Vec<LightAt>> {
    catch_interrupts();
    let bar = Bar::new();
    let mut light = Vec::with_capacity(places.len());
    for some in places.chunks(AT_ONCE) {
        light.extend(lit.at(some)?);
        bar.show(format!(
            "light at {} of {} places",
            light.len(),
            places.len()
        ));
        if interrupted() {
            break;
        }
    }
    bar.finish();
    Ok(light)
}
