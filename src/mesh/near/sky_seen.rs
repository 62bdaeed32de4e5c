//! What a place sees of a sky, by rays that grow denser along the edges of what hides it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::rays::blocked;
use crate::mesh::shadow_tree::ShadowTree;
use crate::scene::sky::Sky;
use crate::structs::ShadowOccluder;

/// Bands of height and of azimuth that are looked at first: 6° each way at the horizon.
const BANDS: u32 = 30;
const COLUMNS: u32 = 60;

/// Each of these is cut in four so often, and up to so often where it is partly hidden.
const LEAST_CUTS: u32 = 1;
const MOST_CUTS: u32 = 6;

/// Longer than any way through a scene, internal units.
const FAR: f64 = 4.0;

/// Irradiance by the sky at a place with this normal, internal units, W·m⁻², RGB.
pub fn sky_seen(
    sky: &Sky,
    occluders: &ShadowTree<ShadowOccluder>,
    place: DVec3,
    normal: DVec3,
) -> DVec3 {
    let look = Look {
        sky,
        east: sky.north.cross(sky.up),
        occluders,
        place,
        normal,
    };
    let mut sum = DVec3::ZERO;
    for band in 0..BANDS {
        let sine = |band: u32| (PI * (f64::from(band) / f64::from(BANDS) - 0.5)).sin();
        for column in 0..COLUMNS {
            let turn = |column: u32| f64::from(column) / f64::from(COLUMNS);
            let low = DVec2::new(sine(band), turn(column));
            let high = DVec2::new(sine(band + 1), turn(column + 1));
            sum += look.part(low, high, 0);
        }
    }
    sum
}

struct Look<'a> {
    sky: &'a Sky,
    east: DVec3,
    occluders: &'a ShadowTree<ShadowOccluder>,
    place: DVec3,
    normal: DVec3,
}

impl Look<'_> {
    /// Light of a part of the sphere: sine of the height and turns of the azimuth, low to high.
    fn part(&self, low: DVec2, high: DVec2, cuts: u32) -> DVec3 {
        let middle = low.midpoint(high);
        let quarters = [
            (low, middle),
            (DVec2::new(middle.x, low.y), DVec2::new(high.x, middle.y)),
            (DVec2::new(low.x, middle.y), DVec2::new(middle.x, high.y)),
            (middle, high),
        ];
        let mut sum = DVec3::ZERO;
        let (mut open, mut hidden) = (false, false);
        if cuts >= LEAST_CUTS {
            // A straight edge across the part leaves some of its corners on either side.
            for corner in [
                low,
                high,
                DVec2::new(low.x, high.y),
                DVec2::new(high.x, low.y),
            ] {
                match self.sees(self.direction(corner)) {
                    Some(true) => open = true,
                    Some(false) => hidden = true,
                    None => {}
                }
            }
            for (low, high) in quarters {
                let towards = self.direction(low.midpoint(high));
                match self.sees(towards) {
                    Some(true) => open = true,
                    Some(false) => {
                        hidden = true;
                        continue;
                    }
                    None => continue,
                }
                let solid_angle = TAU * (high.x - low.x) * (high.y - low.y);
                let cosine = towards.dot(self.normal);
                sum += self.sky.radiance(towards) * (cosine * solid_angle);
            }
        }
        if cuts >= LEAST_CUTS && (!(open && hidden) || cuts == MOST_CUTS) {
            return sum;
        }
        let parts = quarters.map(|(low, high)| self.part(low, high, cuts + 1));
        parts.into_iter().sum()
    }

    /// Whether nothing hides a direction; none below the horizon.
    fn sees(&self, towards: DVec3) -> Option<bool> {
        let above = towards.dot(self.normal) > 0.0;
        above.then(|| !blocked(self.occluders, self.place, self.place + FAR * towards))
    }

    fn direction(&self, DVec2 { x: sine, y: turn }: DVec2) -> DVec3 {
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        let (sin, cos) = (TAU * turn).sin_cos();
        sine * self.sky.up + cosine * (cos * self.sky.north + sin * self.east)
    }
}
