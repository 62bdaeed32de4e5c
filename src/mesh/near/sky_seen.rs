//! What a place sees of a sky, by rays that grow denser along the edges of what hides it.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::rays::blocked;
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::FAR;
use crate::scene::sky::{Sky, SkyPart};
use crate::structs::ShadowOccluder;

/// Bands of height and of azimuth that are looked at first: 1.5° each way at the horizon. What is
/// narrower may be missed.
const BANDS: usize = 120;
const COLUMNS: usize = 240;

/// Parts that are partly hidden are cut in four until they hold no more than this share of the
/// light, or so often: what is wrong with them is a small part of that.
const MIXED: f64 = 0.005;
const MOST_CUTS: usize = 12;

/// What a place sees of a part.
struct Seen {
    light: DVec3,
    /// Whether some of it is seen, and some hidden.
    mixed: bool,
}

struct Look<'a> {
    sky: &'a Sky,
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
        occluders,
        place,
        normal,
    };
    let node = |band: usize, column: usize| {
        let sine = (PI * (band as f64 / BANDS as f64 - 0.5)).sin();
        DVec2::new(sine, column as f64 / COLUMNS as f64)
    };
    // Of the first parts, corners are looked at once.
    let corners: Vec<Option<bool>> = (0..=BANDS)
        .flat_map(|band| (0..=COLUMNS).map(move |column| (band, column)))
        .map(|(band, column)| look.sees(sky.towards(node(band, column))))
        .collect();
    let part = |i: usize| SkyPart {
        low: node(i / COLUMNS, i % COLUMNS),
        high: node(i / COLUMNS + 1, i % COLUMNS + 1),
    };
    let first: Vec<Seen> = (0..BANDS * COLUMNS)
        .map(|i| {
            let low = i / COLUMNS * (COLUMNS + 1) + i % COLUMNS;
            let above = low + COLUMNS + 1;
            look.at(
                &part(i),
                [low, low + 1, above, above + 1].map(|i| corners[i]),
            )
        })
        .collect();
    // What an edge cuts is cut again, and so are its neighbours, where more of the edge may run.
    let mut parts = Vec::new();
    let mut sum = DVec3::ZERO;
    for (i, seen) in first.iter().enumerate() {
        let (band, column) = (i / COLUMNS, i % COLUMNS);
        let bands = band.saturating_sub(1)..(band + 2).min(BANDS);
        let is_mixed = |band: usize| {
            let columns = [column + COLUMNS - 1, column, column + 1];
            columns
                .iter()
                .any(|c| first[band * COLUMNS + c % COLUMNS].mixed)
        };
        match bands.into_iter().any(is_mixed) {
            true => parts.extend(part(i).quarters().map(|part| (part, look.corners(&part)))),
            false => sum += seen.light,
        }
    }
    for _ in 0..MOST_CUTS {
        let (mut mixed, mut of_mixed) = (Vec::new(), DVec3::ZERO);
        for (part, corners) in parts {
            let seen = look.at(&part, corners);
            match seen.mixed {
                true => {
                    of_mixed += seen.light;
                    let quarters = part.quarters().into_iter();
                    mixed.extend(quarters.map(|part| (part, look.corners(&part))));
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
    let left = parts.iter().map(|(part, _)| look.at(part, [None; 4]).light);
    sum + left.sum::<DVec3>()
}

impl Look<'_> {
    fn corners(&self, part: &SkyPart) -> [Option<bool>; 4] {
        let corners = part.corners();
        corners.map(|corner| self.sees(self.sky.towards(corner)))
    }

    /// By four places within the part, no two in one row or column, and what it sees of its corners:
    /// a straight edge across the part leaves some of these on either side.
    fn at(&self, part: &SkyPart, corners: [Option<bool>; 4]) -> Seen {
        let (mut open, mut hidden) = (false, false);
        let mut note = |sees: Option<bool>| {
            open |= sees == Some(true);
            hidden |= sees == Some(false);
        };
        corners.into_iter().for_each(&mut note);
        let mut light = DVec3::ZERO;
        for (x, y) in [(1.0, 5.0), (3.0, 1.0), (5.0, 7.0), (7.0, 3.0)] {
            let towards = self.sky.towards(part.at(DVec2::new(x, y) / 8.0));
            let sees = self.sees(towards);
            note(sees);
            if sees == Some(true) {
                let cosine = towards.dot(self.normal);
                light += self.sky.radiance(towards) * (cosine * part.solid_angle() / 4.0);
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
}
