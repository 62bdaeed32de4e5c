//! `[[point_light]]`: points, spots and luminaires.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::super::ies::Luminaire;
use super::super::lights::across;
use super::super::{Beam, PointLight, Web};
use super::{Amount, Problem, Strength, direction, one_of};

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointLightTable {
    pub name: Option<String>,
    pub position: [f64; 3],
    /// W·sr⁻¹; of a beam in its strongest direction, as `candela`.
    pub intensity: Option<Amount>,
    pub candela: Option<f64>,
    pub lumens: Option<f64>,
    pub watts: Option<f64>,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
    pub spot: Option<SpotTable>,
    pub ies: Option<String>,
    pub axis: Option<[f64; 3]>,
    /// A place that the axis goes through.
    pub towards: Option<[f64; 3]>,
    /// Where φ is 0.
    pub zero: Option<[f64; 3]>,
    /// That turns φ = 0 about the axis, degrees.
    pub rotation: Option<f64>,
}

/// Half angles, degrees.
#[derive(Debug, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SpotTable {
    #[serde(default)]
    pub inner: f64,
    pub outer: f64,
}

impl PointLightTable {
    /// The light, with the warnings of the files that it names.
    pub fn light(&self, name: String, path: &Path) -> Result<(PointLight, Vec<String>), Problem> {
        let position = DVec3::from(self.position);
        if !position.is_finite() {
            return Err(Problem::Table("position must be finite".into()));
        }
        let mut warnings = Vec::new();
        let mut of_file = None;
        let web = match (&self.spot, &self.ies) {
            (Some(_), Some(_)) => {
                return Err(Problem::Table("spot and ies contradict each other".into()));
            }
            (Some(spot), None) => Some(spot.web()?),
            (None, Some(file)) => {
                let luminaire = Luminaire::read(&path.with_file_name(file.replace('\\', "/")))?;
                warnings = luminaire.warnings;
                of_file = Some(luminaire.candela);
                Some(luminaire.web)
            }
            (None, None) => None,
        };
        let beam = self.beam(web, position)?;
        let mut light = PointLight {
            name,
            position,
            intensity: [0.0; 3],
            beam,
        };
        let rgb = self.strength(light.solid_angle(), of_file)?;
        light.intensity = rgb.map(|c| c as f32);
        light.check()?;
        Ok((light, warnings))
    }

    /// The intensity; `of_file` is that of the luminaire's file, cd.
    fn strength(&self, solid_angle: f64, of_file: Option<f64>) -> Result<[f64; 3], String> {
        let key = one_of([
            ("intensity", self.intensity.is_some()),
            ("candela", self.candela.is_some()),
            ("lumens", self.lumens.is_some()),
            ("watts", self.watts.is_some()),
        ])?;
        let (amount, is_luminous, over) = match (self.intensity, self.candela, self.lumens) {
            (Some(amount), ..) => (amount, false, 1.0),
            (_, Some(candela), _) => (Amount::Grey(candela), true, 1.0),
            (.., Some(lumens)) => (Amount::Grey(lumens), true, solid_angle),
            _ => match (self.watts, of_file) {
                (Some(watts), _) => (Amount::Grey(watts), false, solid_angle),
                (None, Some(candela)) => (Amount::Grey(candela), true, 1.0),
                (None, None) => {
                    return Err("intensity, candela, lumens or watts is missing".into());
                }
            },
        };
        let strength = Strength {
            key: key.unwrap_or("the intensity of the file"),
            amount,
            is_luminous,
            color: self.color,
            kelvin: self.kelvin,
        };
        let rgb = strength.rgb()?.map(|c| c / over);
        match rgb.iter().all(|c| c.is_finite()) {
            true => Ok(rgb),
            false => Err("no light leaves it, so that its power means nothing".into()),
        }
    }

    fn beam(&self, web: Option<Web>, position: DVec3) -> Result<Option<Beam>, String> {
        let given = [
            ("axis", self.axis.is_some()),
            ("towards", self.towards.is_some()),
            ("zero", self.zero.is_some()),
            ("rotation", self.rotation.is_some()),
        ];
        let Some(web) = web else {
            return match given.iter().find(|(_, given)| *given) {
                Some((key, _)) => Err(format!("{key} belongs to a spot or to ies")),
                None => Ok(None),
            };
        };
        one_of([given[0], given[1]])?;
        let axis = match (self.axis, self.towards) {
            (Some(axis), _) => direction("axis", DVec3::from(axis))?,
            (None, Some(place)) => direction(
                "the way from position towards its place",
                DVec3::from(place) - position,
            )?,
            // Luminaires hang.
            (None, None) => -DVec3::Y,
        };
        let wanted = self.zero.map(DVec3::from);
        if let Some(wanted) = wanted {
            let wanted = direction("zero", wanted)?;
            if wanted.cross(axis).length() < 1e-6 {
                return Err("zero is parallel to the axis".into());
            }
        }
        let mut zero = across(axis, wanted);
        if let Some(degrees) = self.rotation {
            if !degrees.is_finite() {
                return Err("rotation must be finite".into());
            }
            let (sin, cos) = degrees.to_radians().sin_cos();
            zero = across(axis, Some(cos * zero + sin * axis.cross(zero)));
        }
        Ok(Some(Beam {
            axis,
            zero,
            web: Arc::new(web),
        }))
    }
}

impl SpotTable {
    fn web(&self) -> Result<Web, String> {
        let SpotTable { inner, outer } = *self;
        match 0.0 <= inner && inner <= outer && outer <= 180.0 && outer > 0.0 {
            true => Ok(Web::spot(inner.to_radians(), outer.to_radians())),
            false => Err(format!(
                "spot: inner {inner} and outer {outer} must be 0 ≤ inner ≤ outer ≤ 180 degrees, \
                 outer above 0"
            )),
        }
    }
}
