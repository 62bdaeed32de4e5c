//! How bright a light is, in any unit, and its colour.

use serde::{Deserialize, Serialize};

use super::super::light_units::{KELVINS, LUMENS_OF_A_WATT, of_luminance_1, planckian};

/// One value for all channels, or one for each.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
#[serde(untagged, expecting = "a number or [r, g, b]")]
pub(crate) enum Amount {
    Grey(f64),
    Rgb([f64; 3]),
}

/// A value with the colour that it is given.
#[derive(Clone, Copy)]
pub(crate) struct Strength<'a> {
    pub key: &'a str,
    pub amount: Amount,
    /// Whether it is in units of luminous flux, which 683 of make a watt.
    pub is_luminous: bool,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
}

impl Strength<'_> {
    /// RGB in radiant units. One number with a colour is the luminance.
    pub fn rgb(&self) -> Result<[f64; 3], String> {
        let key = self.key;
        let colour = colour(self.color, self.kelvin)?;
        let rgb = match (self.amount, colour) {
            (Amount::Grey(value), colour) => colour.map_or([value; 3], |c| c.map(|c| c * value)),
            (Amount::Rgb(rgb), None) => rgb,
            (Amount::Rgb(_), Some(_)) => {
                return Err(format!(
                    "a colour goes with one number, and {key} has three"
                ));
            }
        };
        let factor = if self.is_luminous {
            1.0 / LUMENS_OF_A_WATT
        } else {
            1.0
        };
        let rgb = rgb.map(|c| c * factor);
        match rgb.iter().all(|&c| c >= 0.0 && (c as f32).is_finite()) {
            true => Ok(rgb),
            false => Err(format!("{key} must be finite and not negative")),
        }
    }
}

/// Linear RGB of luminance 1.
fn colour(color: Option<[f64; 3]>, kelvin: Option<f64>) -> Result<Option<[f64; 3]>, String> {
    match (color, kelvin) {
        (Some(_), Some(_)) => {
            Err("color and kelvin contradict each other: give one of them".into())
        }
        (Some(rgb), None) => {
            let usable = rgb.iter().all(|&c| (0.0..1e30).contains(&c)) && rgb != [0.0; 3];
            match usable {
                true => Ok(Some(of_luminance_1(rgb))),
                false => Err("color must be finite, not negative and not black".into()),
            }
        }
        (None, Some(kelvin)) if KELVINS.contains(&kelvin) => Ok(Some(planckian(kelvin))),
        (None, Some(kelvin)) => Err(format!(
            "kelvin {kelvin} must be in {}..={}",
            KELVINS.start(),
            KELVINS.end()
        )),
        (None, None) => Ok(None),
    }
}

/// The power of a lamp that is a surface.
pub(crate) struct Power {
    /// Over the area of the lamp and π it is the radiance; where false it is that already.
    pub is_flux: bool,
    pub rgb: [f64; 3],
}
