//! Lights of a scene that is written out: tables, with a file for each beam and for a sky's
//! picture.

use std::path::Path;

use image::{DynamicImage, ImageBuffer, ImageFormat, Rgb};
use toml::Spanned;

use super::ies::web_text;
use super::light_tables::{Amount, Model, PointLightTable, SkyTable, SunTable};
use super::map_files::encode;
use super::sky::{Dome, Form, Panorama, Sky};
use super::write::bare;
use super::{Lights, Sun};
use crate::atomic_file::write_atomically;
use crate::error::Result;

pub(super) struct LightTables {
    pub points: Vec<Spanned<PointLightTable>>,
    pub suns: Vec<Spanned<SunTable>>,
    pub sky: Option<Spanned<SkyTable>>,
}

/// Writes the files and returns the tables.
///
/// # Errors
/// A file that cannot be written.
pub(super) fn write(lights: &Lights, dir: &Path) -> Result<LightTables> {
    let mut points = Vec::with_capacity(lights.points.len());
    for (number, light) in lights.points.iter().enumerate() {
        let mut table = PointLightTable {
            name: Some(light.name.clone()),
            position: light.position.to_array(),
            intensity: Some(exactly(light.intensity)),
            ..PointLightTable::default()
        };
        if let Some(beam) = &light.beam {
            let name = format!("light-{number}.ies");
            let text = web_text(&beam.web);
            write_atomically(&dir.join(&name), |out| out.write_all(text.as_bytes()))?;
            table.ies = Some(name);
            table.axis = Some(beam.axis.to_array());
            table.zero = Some(beam.zero.to_array());
        }
        points.push(bare(table));
    }
    Ok(LightTables {
        points,
        suns: lights.suns.iter().map(|sun| bare(of_sun(sun))).collect(),
        sky: (lights.sky.as_ref())
            .map(|sky| of_sky(sky, dir).map(bare))
            .transpose()?,
    })
}

fn of_sun(sun: &Sun) -> SunTable {
    SunTable {
        name: Some(sun.name.clone()),
        towards: Some(sun.towards.to_array()),
        irradiance: Some(exactly(sun.irradiance)),
        angle: Some(sun.angle),
        ..SunTable::default()
    }
}

fn of_sky(sky: &Sky, dir: &Path) -> Result<SkyTable> {
    let mut table = SkyTable {
        up: Some(sky.up.to_array()),
        north: Some(sky.north.to_array()),
        ..SkyTable::default()
    };
    let scale = Some(exactly(sky.scale));
    let named = |name: &str| Some(Model::Name(name.into()));
    match &sky.dome {
        Dome::Picture(picture) => {
            let name = "sky.exr";
            let (_, bytes) = picture_bytes(picture, name)?;
            write_atomically(&dir.join(name), |out| out.write_all(&bytes))?;
            table.picture = Some(name.into());
            // The picture begins at azimuth 0.
            table.azimuth = Some(180.0);
            table.scale = scale;
            return Ok(table);
        }
        Dome::Uniform => table.model = named("uniform"),
        Dome::TraditionalOvercast => table.model = named("traditional overcast"),
        Dome::Gradation(gradation) => {
            table.model = named(match gradation.form() {
                Form::Cie => "cie",
                Form::Perez => "perez",
            });
            table.coefficients = Some(gradation.coefficients());
            table.sun = Some(SunTable {
                towards: Some(gradation.sun().to_array()),
                ..SunTable::default()
            });
        }
    }
    table.radiance = scale;
    Ok(table)
}

fn picture_bytes(picture: &Panorama, name: &str) -> Result<(&'static str, Vec<u8>)> {
    let texels = picture.texels.as_flattened().to_vec();
    let image = ImageBuffer::<Rgb<f32>, Vec<f32>>::from_raw(picture.width, picture.height, texels);
    encode(
        Path::new(name),
        image.map(DynamicImage::from),
        ImageFormat::OpenExr,
    )
}

/// An f64 holds each f32.
fn exactly(rgb: [f32; 3]) -> Amount {
    Amount::Rgb(rgb.map(f64::from))
}
