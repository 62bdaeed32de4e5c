//! Where the sun stands: the algorithm of J. Meeus, "Astronomical Algorithms" (2nd edition, 1998),
//! chapter 25 (low accuracy), which NOAA's solar calculator uses too; good to 0.01°.

use glam::DVec3;

/// A moment of the Gregorian calendar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    pub year: i32,
    /// 1 to 12.
    pub month: u32,
    /// Days from the start of the month plus 1, with their fraction; UTC.
    pub day: f64,
}

/// Height above the horizon, and azimuth from north by east; degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunAngles {
    pub height: f64,
    pub azimuth: f64,
}

impl SunAngles {
    /// Unit vector; `up` and `north` are unit vectors at right angles.
    pub fn direction(self, up: DVec3, north: DVec3) -> DVec3 {
        let (sin_height, cos_height) = self.height.to_radians().sin_cos();
        let (sin, cos) = self.azimuth.to_radians().sin_cos();
        sin_height * up + cos_height * (cos * north + sin * north.cross(up))
    }
}

/// Seconds that uniform time is ahead of UTC, about 2000 to 2030. The sun moves 10⁻⁵ degrees a
/// second among the stars, so that a few do not matter.
const TIME_AHEAD: f64 = 69.0;

/// The sun's true place, without the refraction of the air, which lifts it by 0.1° at a height of
/// 10° and by half a degree at the horizon. Latitude north and longitude east are positive,
/// degrees.
pub fn sun_angles(instant: Instant, latitude: f64, longitude: f64) -> SunAngles {
    let days = days_since_2000(instant);
    let (right_ascension, declination) = apparent_place(days + TIME_AHEAD / 86400.0);
    // Mean sidereal time at Greenwich (Meeus 12.4).
    let sidereal = 280.460_618_37 + 360.985_647_366_29 * days;
    let hour_angle = (sidereal + longitude - right_ascension).to_radians();
    let (sin_latitude, cos_latitude) = latitude.to_radians().sin_cos();
    let (sin_declination, cos_declination) = declination.to_radians().sin_cos();
    let (sin_hour, cos_hour) = hour_angle.sin_cos();
    // Up, north and east.
    let up = sin_latitude * sin_declination + cos_latitude * cos_declination * cos_hour;
    let north = cos_latitude * sin_declination - sin_latitude * cos_declination * cos_hour;
    let east = -cos_declination * sin_hour;
    SunAngles {
        height: f64::atan2(up, north.hypot(east)).to_degrees(),
        azimuth: f64::atan2(east, north).to_degrees().rem_euclid(360.0),
    }
}

/// Days since noon of 1 January 2000, UTC (Meeus 7.1).
fn days_since_2000(instant: Instant) -> f64 {
    let (mut year, mut month) = (instant.year, instant.month as i32);
    if month <= 2 {
        year -= 1;
        month += 12;
    }
    let century = year.div_euclid(100);
    let leap = 2 - century + century.div_euclid(4);
    let of_years = (365.25 * f64::from(year + 4716)).floor();
    let of_months = (30.6001 * f64::from(month + 1)).floor();
    of_years + of_months + instant.day + f64::from(leap) - 1524.5 - 2_451_545.0
}

/// Right ascension and declination, degrees (Meeus 25.2 to 25.8).
fn apparent_place(days: f64) -> (f64, f64) {
    let t = days / 36525.0;
    let mean_longitude = 280.466_46 + t * (36_000.769_83 + t * 0.000_303_2);
    let anomaly = (357.529_11 + t * (35_999.050_29 - t * 0.000_153_7)).to_radians();
    let centre = (1.914_602 - t * (0.004_817 + t * 0.000_014)) * anomaly.sin()
        + (0.019_993 - t * 0.000_101) * (2.0 * anomaly).sin()
        + 0.000_289 * (3.0 * anomaly).sin();
    let node = (125.04 - 1934.136 * t).to_radians();
    let longitude = (mean_longitude + centre - 0.005_69 - 0.004_78 * node.sin()).to_radians();
    let mean_obliquity = 23.439_291_1 - t * (0.013_004_17 + t * (1.64e-7 - t * 5.036e-7));
    let obliquity = (mean_obliquity + 0.002_56 * node.cos()).to_radians();
    let right_ascension = f64::atan2(obliquity.cos() * longitude.sin(), longitude.cos());
    let declination = (obliquity.sin() * longitude.sin()).asin();
    (right_ascension.to_degrees(), declination.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// NREL's example: measured 0.0003° in height and 0.0012° in azimuth.
    const LIMIT: f64 = 0.003;

    #[test]
    fn the_example_of_meeus() {
        // Example 25.a: 1992 October 13, 0h of uniform time; 25.b by the complete theory.
        let days = days_since_2000(Instant {
            year: 1992,
            month: 10,
            day: 13.0,
        });
        let (ascension, declination) = apparent_place(days);
        assert!(
            (ascension.rem_euclid(360.0) - 198.380_83).abs() < 2e-5,
            "{ascension}"
        );
        assert!((declination + 7.785_07).abs() < 2e-5, "{declination}");
    }

    #[test]
    fn the_example_of_nrel() {
        // I. Reda and A. Andreas, "Solar position algorithm for solar radiation applications" (NREL
        // 2008), Appendix A.5: 17 October 2003, 12:30:30 at UTC − 7 h.
        let instant = Instant {
            year: 2003,
            month: 10,
            day: 17.0 + (19.0 + 30.0 / 60.0 + 30.0 / 3600.0) / 24.0,
        };
        let sun = sun_angles(instant, 39.742_476, -105.178_6);
        assert!((sun.height - 39.872_046).abs() < LIMIT, "{sun:?}");
        assert!((sun.azimuth - 194.340_24).abs() < LIMIT, "{sun:?}");
    }

    #[test]
    fn solstices_and_equinoxes() {
        // The sun is highest at 90° − latitude + declination; at the June solstice of 2024 (20
        // June, 20:51 UTC) the declination is the obliquity, 23.4383°. Noon is searched for. Steps
        // of a minute miss noon by 0.0001° and the year's obliquity by its nutation, 0.003°.
        const OBLIQUITY: f64 = 0.006;
        let highest = |month: u32, day: f64, latitude: f64| {
            let minutes = (0..1440).map(|minute| Instant {
                year: 2024,
                month,
                day: day + f64::from(minute) / 1440.0,
            });
            let heights = minutes.map(|instant| sun_angles(instant, latitude, 180.0));
            heights
                .max_by(|a, b| a.height.total_cmp(&b.height))
                .unwrap()
        };
        let june = highest(6, 20.5, 50.0);
        assert!(
            (june.height - (40.0 + 23.4383)).abs() < OBLIQUITY,
            "{june:?}"
        );
        let december = highest(12, 21.0, 50.0);
        assert!(
            (december.height - (40.0 - 23.4383)).abs() < OBLIQUITY,
            "{december:?}"
        );
        // At the equinox (20 March, 03:06 UTC) it rises in the east; at the equator it stands at
        // the zenith a little later.
        let minutes = (0..1440).map(|minute| Instant {
            year: 2024,
            month: 3,
            day: 19.6 + f64::from(minute) / 1440.0,
        });
        let rising = minutes
            .map(|instant| sun_angles(instant, 0.0, 90.0))
            .filter(|sun| sun.azimuth < 180.0)
            .min_by(|a, b| a.height.abs().total_cmp(&b.height.abs()))
            .unwrap();
        assert!((rising.azimuth - 90.0).abs() < 0.2, "{rising:?}");
    }

    #[test]
    fn azimuths_turn_by_east() {
        let up_and_north = (DVec3::Y, -DVec3::Z);
        let at = |height, azimuth| SunAngles { height, azimuth };
        let of = |angles: SunAngles| angles.direction(up_and_north.0, up_and_north.1);
        assert!((of(at(0.0, 0.0)) + DVec3::Z).length() < 1e-15);
        assert!((of(at(0.0, 90.0)) - DVec3::X).length() < 1e-15);
        assert!((of(at(90.0, 12.0)) - DVec3::Y).length() < 1e-15);
    }
}
