//! `[[sun]]`, and the sun of a sky.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use toml::value::{Datetime, Offset};

use super::super::Sun;
use super::super::sky::{Instant, SunAngles, sun_angles};
use super::{Amount, Compass, Strength, direction, one_of};

/// The sun's diameter as seen from the earth, degrees.
const ANGLE: f64 = 0.53;

#[derive(Debug, Default, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SunTable {
    pub name: Option<String>,
    pub towards: Option<[f64; 3]>,
    /// Degrees.
    pub elevation: Option<f64>,
    /// Degrees from north by east.
    pub azimuth: Option<f64>,
    /// Degrees, north and east positive.
    pub latitude: Option<f64>,
    pub longitude: Option<f64>,
    pub time: Option<Datetime>,
    /// W·m⁻² of a surface that faces it.
    pub irradiance: Option<Amount>,
    pub lux: Option<f64>,
    pub color: Option<[f64; 3]>,
    pub kelvin: Option<f64>,
    /// Diameter, degrees.
    pub angle: Option<f64>,
    pub up: Option<[f64; 3]>,
    pub north: Option<[f64; 3]>,
}

impl SunTable {
    /// A sun of its own; `compass` is the sky's.
    pub fn sun(&self, name: String, compass: Option<Compass>) -> Result<Sun, String> {
        let compass = match (compass, self.up.is_some() || self.north.is_some()) {
            (Some(compass), false) => compass,
            _ => Compass::of(self.up, self.north)?,
        };
        let towards = self.towards(compass)?;
        let irradiance = self.irradiance()?.ok_or("irradiance or lux is missing")?;
        self.shining(name, towards, irradiance)
    }

    pub fn shining(
        &self,
        name: String,
        towards: DVec3,
        irradiance: [f64; 3],
    ) -> Result<Sun, String> {
        let sun = Sun {
            name,
            towards,
            irradiance: irradiance.map(|c| c as f32),
            angle: self.angle.unwrap_or(ANGLE),
        };
        sun.check().map(|()| sun)
    }

    /// The direction towards it.
    pub fn towards(&self, compass: Compass) -> Result<DVec3, String> {
        let has_angles = self.elevation.is_some() || self.azimuth.is_some();
        let has_place = self.latitude.is_some() || self.longitude.is_some() || self.time.is_some();
        one_of([
            ("towards", self.towards.is_some()),
            ("elevation and azimuth", has_angles),
            ("a place and a time", has_place),
        ])?;
        if let Some(towards) = self.towards {
            return direction("towards", DVec3::from(towards));
        }
        let angles = if has_angles {
            let (Some(height), Some(azimuth)) = (self.elevation, self.azimuth) else {
                return Err("elevation and azimuth belong together".into());
            };
            if !(-90.0..=90.0).contains(&height) || !azimuth.is_finite() {
                let what = format!("elevation {height} must be in −90..=90, azimuth finite");
                return Err(what);
            }
            SunAngles { height, azimuth }
        } else {
            let (Some(latitude), Some(longitude), Some(time)) =
                (self.latitude, self.longitude, self.time)
            else {
                return Err(
                    "its place is missing: towards, elevation and azimuth, or latitude, longitude \
                     and time"
                        .into(),
                );
            };
            if !(-90.0..=90.0).contains(&latitude) || !(-180.0..=180.0).contains(&longitude) {
                return Err(format!(
                    "latitude {latitude} must be in −90..=90, longitude {longitude} in −180..=180"
                ));
            }
            let angles = sun_angles(instant(time)?, latitude, longitude);
            if angles.height < 0.0 {
                let below = -angles.height;
                return Err(format!(
                    "at {time} it stands {below:.1}° below the horizon there"
                ));
            }
            angles
        };
        Ok(angles.direction(compass.up, compass.north))
    }

    /// None where it is not given.
    pub fn irradiance(&self) -> Result<Option<[f64; 3]>, String> {
        let key = one_of([
            ("irradiance", self.irradiance.is_some()),
            ("lux", self.lux.is_some()),
        ])?;
        let amount = self.irradiance.or(self.lux.map(Amount::Grey));
        let (Some(key), Some(amount)) = (key, amount) else {
            return match self.color.is_some() || self.kelvin.is_some() {
                true => Err("a colour of the sun needs irradiance or lux".into()),
                false => Ok(None),
            };
        };
        let strength = Strength {
            key,
            amount,
            is_luminous: key == "lux",
            color: self.color,
            kelvin: self.kelvin,
        };
        strength.rgb().map(Some)
    }
}

/// A time with its offset from UTC.
fn instant(time: Datetime) -> Result<Instant, String> {
    let (Some(date), Some(clock), Some(offset)) = (time.date, time.time, time.offset) else {
        return Err(format!(
            "time {time} must be a date and a time with its offset from UTC, as in \
             2024-06-21T12:00:00+02:00"
        ));
    };
    // Beyond them the calendar and the earth's rotation differ from the algorithm's.
    if !(1800..=2200).contains(&date.year) {
        return Err(format!("the year {} must be in 1800..=2200", date.year));
    }
    let minutes = match offset {
        Offset::Z => 0.0,
        Offset::Custom { minutes } => f64::from(minutes),
    };
    let seconds = f64::from(clock.second.unwrap_or(0))
        + f64::from(clock.nanosecond.unwrap_or(0)) / 1e9
        + 60.0 * (f64::from(clock.minute) - minutes)
        + 3600.0 * f64::from(clock.hour);
    Ok(Instant {
        year: i32::from(date.year),
        month: u32::from(date.month),
        day: f64::from(date.day) + seconds / 86400.0,
    })
}
