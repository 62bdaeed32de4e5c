//! `[sky]`.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::super::light_units::luminance;
use super::super::sky::{Dome, Form, Gradation, Panorama, Perez, Sky};
use super::super::{Sun, Texture};
use super::{Amount, Compass, Problem, Strength, SunTable, one_of};

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SkyTable {
    pub model: Option<Model>,
    /// a to e of the models "cie" and "perez".
    pub coefficients: Option<[f64; 5]>,
    pub picture: Option<String>,
    /// Of the zenith, W·m⁻²·sr⁻¹.
    pub radiance: Option<Amount>,
    /// Of the zenith, cd·m⁻².
    pub luminance: Option<f64>,
    /// Of the open ground by the sky, W·m⁻².
    pub irradiance: Option<Amount>,
    pub lux: Option<f64>,
    /// That a picture is multiplied by.
    pub scale: Option<Amount>,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
    /// W·m⁻², of Perez' sky: of a surface that faces the sun, by the sun; of the open ground, by
    /// the sky.
    pub direct: Option<f64>,
    pub diffuse: Option<f64>,
    pub up: Option<[f64; 3]>,
    pub north: Option<[f64; 3]>,
    /// Of the middle of a picture, degrees.
    pub azimuth: Option<f64>,
    pub sun: Option<SunTable>,
}

#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(untagged, expecting = "the name of a sky, or a number in 1..=16")]
pub(crate) enum Model {
    Number(u32),
    Name(String),
}

/// A sky by its name.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Uniform,
    TraditionalOvercast,
    /// Of CIE S 011 by its number.
    Cie(u32),
    Coefficients(Form),
    Perez,
    Picture,
}

/// Azimuth of the middle of a picture in Blender and three.js: x.
const MIDDLE: f64 = 90.0;

impl SkyTable {
    /// The sky, and the sun that goes with it.
    pub fn sky(&self, compass: Compass, path: &Path) -> Result<(Sky, Option<Sun>), Problem> {
        let kind = self.kind()?;
        self.check_keys(kind)?;
        let sun = (self.sun.as_ref())
            .map(|sun| sun.towards(compass))
            .transpose()?;
        let mut sky = Sky {
            up: compass.up,
            north: compass.north,
            scale: [1.0; 3],
            dome: self.dome(kind, compass, sun, path)?,
        };
        if kind == Kind::Picture {
            let left = self.azimuth.unwrap_or(MIDDLE) - 180.0;
            if !left.is_finite() {
                return Err(Problem::Table("azimuth must be finite".into()));
            }
            if left != 0.0 {
                let (sin, cos) = left.to_radians().sin_cos();
                let east = compass.north.cross(compass.up);
                sky.north = super::super::lights::across(
                    compass.up,
                    Some(cos * compass.north + sin * east),
                );
            }
        }
        sky.scale = self.scale(kind, &sky)?.map(|c| c as f32);
        sky.check()?;
        Ok((sky, self.shining_sun(kind, sun)?))
    }

    fn kind(&self) -> Result<Kind, String> {
        let model = match (&self.model, &self.picture) {
            (Some(_), Some(_)) => return Err("model and picture contradict each other".into()),
            (None, Some(_)) => return Ok(Kind::Picture),
            (None, None) => return Err("model or picture is missing".into()),
            (Some(model), None) => model,
        };
        let name = match model {
            Model::Number(number @ 1..=15) => return Ok(Kind::Cie(*number)),
            Model::Number(16) => return Ok(Kind::TraditionalOvercast),
            Model::Number(number) => {
                return Err(format!("model {number} must be in 1..=16"));
            }
            Model::Name(name) => name.as_str(),
        };
        Ok(match (name, self.coefficients) {
            ("cie", Some(_)) => Kind::Coefficients(Form::Cie),
            ("perez", Some(_)) => Kind::Coefficients(Form::Perez),
            ("uniform", _) => Kind::Uniform,
            ("traditional overcast", _) => Kind::TraditionalOvercast,
            ("cie overcast", _) => Kind::Cie(1),
            ("cie intermediate", _) => Kind::Cie(7),
            ("cie clear", _) => Kind::Cie(12),
            ("perez", None) => Kind::Perez,
            ("cie", None) => return Err("model \"cie\" needs its coefficients".into()),
            _ => {
                return Err(format!(
                    "model \"{}\" is none of \"uniform\", \"cie overcast\", \"cie intermediate\", \
                     \"cie clear\", \"traditional overcast\", \"perez\" and 1 to 16",
                    name.escape_debug()
                ));
            }
        })
    }

    /// Whether each key goes with the kind of sky.
    fn check_keys(&self, kind: Kind) -> Result<(), String> {
        let has_coefficients = matches!(kind, Kind::Coefficients(_));
        for (key, is_given, goes) in [
            (
                "coefficients",
                self.coefficients.is_some(),
                has_coefficients,
            ),
            ("direct", self.direct.is_some(), kind == Kind::Perez),
            ("diffuse", self.diffuse.is_some(), kind == Kind::Perez),
            ("scale", self.scale.is_some(), kind == Kind::Picture),
            ("azimuth", self.azimuth.is_some(), kind == Kind::Picture),
            ("radiance", self.radiance.is_some(), kind != Kind::Picture),
            ("luminance", self.luminance.is_some(), kind != Kind::Picture),
        ] {
            if is_given && !goes {
                return Err(format!("{key} does not go with this sky"));
            }
        }
        let of_sun = self.sun.as_ref();
        match of_sun.is_some_and(|sun| sun.up.is_some() || sun.north.is_some()) {
            true => Err("the sun of a sky has the sky's up and north".into()),
            false => Ok(()),
        }
    }

    fn dome(
        &self,
        kind: Kind,
        compass: Compass,
        sun: Option<DVec3>,
        path: &Path,
    ) -> Result<Dome, Problem> {
        let up = compass.up;
        let needs_sun = match kind {
            Kind::Cie(number) => Gradation::cie_needs_sun(number),
            kind => matches!(kind, Kind::Coefficients(_) | Kind::Perez),
        };
        if needs_sun && sun.is_none() {
            return Err(Problem::Table("this sky needs its sun".into()));
        }
        let towards = sun.unwrap_or(up);
        let height = f64::atan2(towards.dot(up), towards.cross(up).length()).to_degrees();
        if needs_sun && height < 0.0 {
            let what = format!("its sun stands {:.1}° below the horizon", -height);
            return Err(Problem::Table(what));
        }
        let gradation = match kind {
            Kind::Uniform => return Ok(Dome::Uniform),
            Kind::TraditionalOvercast => return Ok(Dome::TraditionalOvercast),
            Kind::Picture => {
                let file = self.picture.as_deref().unwrap_or_default();
                return picture(&path.with_file_name(file.replace('\\', "/")));
            }
            Kind::Cie(number) => Gradation::cie(number, up, towards),
            Kind::Coefficients(form) => {
                let coefficients = self.coefficients.unwrap_or_default();
                Gradation::new(form, coefficients, up, towards)
            }
            Kind::Perez => {
                let coefficients = self.perez(height)?.coefficients();
                Gradation::new(Form::Perez, coefficients, up, towards)
            }
        };
        let what = "with these values this sky is brighter than every number";
        let gradation = gradation.ok_or_else(|| what.to_owned())?;
        Ok(Dome::Gradation(gradation))
    }

    fn perez(&self, sun_height: f64) -> Result<Perez, String> {
        let (Some(direct_normal), Some(diffuse_horizontal)) = (self.direct, self.diffuse) else {
            return Err("Perez' sky needs direct and diffuse irradiance".into());
        };
        let direct_is_right = (0.0..=2000.0).contains(&direct_normal);
        match direct_is_right && diffuse_horizontal > 0.0 && diffuse_horizontal <= 2000.0 {
            true => Ok(Perez {
                direct_normal,
                diffuse_horizontal,
                sun_height,
            }),
            false => Err(
                "direct must be in 0..=2000 W/m² and diffuse above 0 and up to 2000 W/m²".into(),
            ),
        }
    }

    /// What the dome is multiplied by; `sky` is that with 1.
    fn scale(&self, kind: Kind, sky: &Sky) -> Result<[f64; 3], String> {
        let key = one_of([
            ("radiance", self.radiance.is_some()),
            ("luminance", self.luminance.is_some()),
            ("irradiance", self.irradiance.is_some()),
            ("lux", self.lux.is_some()),
            ("scale", self.scale.is_some()),
        ])?;
        let given = (self.radiance.or(self.irradiance).or(self.scale))
            .or(self.luminance.or(self.lux).map(Amount::Grey));
        let (key, amount) = match (key, given, kind) {
            (Some(key), Some(amount), _) => (key, amount),
            (.., Kind::Perez) => ("irradiance", Amount::Grey(self.diffuse.unwrap_or_default())),
            (.., Kind::Picture) => ("scale", Amount::Grey(1.0)),
            _ => return Err("radiance, luminance, irradiance or lux is missing".into()),
        };
        let strength = Strength {
            key,
            amount,
            is_luminous: key == "luminance" || key == "lux",
            color: self.color,
            kelvin: self.kelvin,
        };
        let rgb = strength.rgb()?;
        let over = match key {
            "irradiance" | "lux" => luminance(sky.horizontal()),
            _ => 1.0,
        };
        let scale = rgb.map(|c| c / over);
        match scale.iter().all(|&c| (c as f32).is_finite()) {
            true => Ok(scale),
            false => Err("no light falls from it, so that its irradiance means nothing".into()),
        }
    }

    /// The sun in the sky, where it shines.
    fn shining_sun(&self, kind: Kind, towards: Option<DVec3>) -> Result<Option<Sun>, String> {
        let (Some(table), Some(towards)) = (&self.sun, towards) else {
            return Ok(None);
        };
        let direct = self
            .direct
            .filter(|&direct| kind == Kind::Perez && direct > 0.0);
        let irradiance = table.irradiance()?.or(direct.map(|direct| [direct; 3]));
        let name = table.name.clone().unwrap_or_else(|| "sun".into());
        match irradiance {
            Some(irradiance) => table.shining(name, towards, irradiance).map(Some),
            None if table.angle.is_some() => {
                Err("the sun's angle needs its irradiance or lux".into())
            }
            None => Ok(None),
        }
    }
}

fn picture(path: &Path) -> Result<Dome, Problem> {
    let ending = super::super::mesh_file::ending(path);
    if ending != "hdr" && ending != "exr" {
        let what = format!("a sky's picture is .hdr or .exr: {}", path.display());
        return Err(Problem::Table(what));
    }
    let Texture {
        width,
        height,
        texels,
        ..
    } = Texture::load(path)?;
    Ok(Dome::Picture(Arc::new(Panorama {
        width,
        height,
        texels,
    })))
}
