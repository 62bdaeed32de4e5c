//! What a place sees of a sky, by rays that grow denser along the edges of what hides it.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::rays::blocked;
use crate::mesh::shadow_tree::ShadowTree;
use crate::scene::sky::Sky;
use crate::structs::ShadowOccluder;

/// Bands of height and of azimuth that are looked at first: 3° each way at the horizon.
const BANDS: u32 = 60;
const COLUMNS: u32 = 120;

/// Parts that are partly hidden are cut in four until they hold no more than this share of the
/// light, or so often: what is wrong with them is a small part of that.
const MIXED: f64 = 0.03;
const MOST_CUTS: usize = 12;

/// Longer than any way through a scene, internal units.
const FAR: f64 = 4.0;

/// A part of the sphere: sine of the height and turns of the azimuth, low to high.
#[derive(Clone, Copy)]
struct Part {
    low: DVec2,
    high: DVec2,
}

/// What a place sees of a part.
struct Seen {
    light: DVec3,
    /// Whether some of it is seen, and some hidden.
    mixed: bool,
}

struct Look<'a> {
    sky: &'a Sky,
    east: DVec3,
    occluders: &'a ShadowTree<ShadowOccluder>,
    place: DVec3,
    normal: DVec3,
}

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
    let sine = |band: u32| (PI * (f64::from(band) / f64::from(BANDS) - 0.5)).sin();
    let turn = |column: u32| f64::from(column) / f64::from(COLUMNS);
    let part = |i: u32| Part {
        low: DVec2::new(sine(i / COLUMNS), turn(i % COLUMNS)),
        high: DVec2::new(sine(i / COLUMNS + 1), turn(i % COLUMNS + 1)),
    };
    let mut parts: Vec<Part> = (0..BANDS * COLUMNS).map(part).collect();
    let mut sum = DVec3::ZERO;
    for _ in 0..MOST_CUTS {
        let (mut mixed, mut of_mixed) = (Vec::new(), DVec3::ZERO);
        for part in parts {
            let seen = look.at(&part);
            match seen.mixed {
                true => {
                    of_mixed += seen.light;
                    mixed.extend(part.quarters());
                }
                false => sum += seen.light,
            }
        }
        let is_little = of_mixed.element_sum() <= MIXED * (sum + of_mixed).element_sum();
        if is_little {
            return sum + of_mixed;
        }
        parts = mixed;
    }
    // The last parts by their middles.
    let left = parts.iter().map(|part| look.at(part).light);
    sum + left.sum::<DVec3>()
}

impl Part {
    fn quarters(&self) -> [Self; 4] {
        let (low, high) = (self.low, self.high);
        let middle = low.midpoint(high);
        [
            (low, middle),
            (DVec2::new(middle.x, low.y), DVec2::new(high.x, middle.y)),
            (DVec2::new(low.x, middle.y), DVec2::new(middle.x, high.y)),
            (middle, high),
        ]
        .map(|(low, high)| Self { low, high })
    }

    fn solid_angle(&self) -> f64 {
        TAU * (self.high.x - self.low.x) * (self.high.y - self.low.y)
    }
}

impl Look<'_> {
    /// By the middles of the part's quarters, and its corners: a straight edge across the part
    /// leaves some of these on either side.
    fn at(&self, part: &Part) -> Seen {
        let Part { low, high } = *part;
        let corners = [
            low,
            high,
            DVec2::new(low.x, high.y),
            DVec2::new(high.x, low.y),
        ];
        let (mut open, mut hidden) = (false, false);
        let mut note = |sees: Option<bool>| {
            open |= sees == Some(true);
            hidden |= sees == Some(false);
        };
        for corner in corners {
            note(self.sees(self.direction(corner)));
        }
        let mut light = DVec3::ZERO;
        for quarter in part.quarters() {
            let towards = self.direction(quarter.low.midpoint(quarter.high));
            let sees = self.sees(towards);
            note(sees);
            if sees == Some(true) {
                let cosine = towards.dot(self.normal);
                light += self.sky.radiance(towards) * (cosine * quarter.solid_angle());
            }
        }
        Seen {
            light,
            mixed: open && hidden,
        }
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
