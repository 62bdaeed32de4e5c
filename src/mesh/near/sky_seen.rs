//! What a place sees of a sky, by rays that grow denser along the edges of what hides it.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::rays::{blocked_by, blocked_by_part};
use crate::mesh::shadow_tree::ShadowTree;
use crate::mesh::sources::FAR;
use crate::scene::sky::{Sky, SkyPart};
use crate::structs::ShadowOccluder;

/// Bands of height and of azimuth that are looked at first: 1.5° each way at the horizon.
const BANDS: usize = 120;
const COLUMNS: usize = 240;

/// Parts that are partly hidden are cut in four until they hold no more than this share of the
/// light, or so often: what is wrong with them is a small part of that.
const MIXED: f64 = 0.005;
const MOST_CUTS: usize = 12;

/// Parts that two surfaces hide together, neither of them all of it, are cut so often to find what
/// there may be between these: to 0.1°, with some 0.03° from one ray to the next.
const GAP_CUTS: usize = 3;

/// What a place sees in a direction: the sky, or the number of a connected part that hides it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum View {
    Open,
    Hidden(u32),
}

/// What a place sees of a part.
struct Seen {
    light: DVec3,
    /// Whether some of it is seen, and some hidden.
    mixed: bool,
    /// Whether all places that were looked at are hidden, but by no surface all of them.
    gap: bool,
}

struct Look<'a> {
    sky: &'a Sky,
    occluders: &'a ShadowTree<ShadowOccluder>,
    place: DVec3,
    normal: DVec3,
}

/// Irradiance by each part of the sky that a place with this normal sees, and the way to the middle
/// of the part; internal units, W·m⁻², RGB.
pub fn sky_seen(
    sky: &Sky,
    occluders: &ShadowTree<ShadowOccluder>,
    place: DVec3,
    normal: DVec3,
    mut each: impl FnMut(DVec3, DVec3),
) {
    let middle = |part: &SkyPart| sky.towards(part.at(DVec2::splat(0.5)));
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
    let corners: Vec<Option<View>> = (0..=BANDS)
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
        match seen.gap || bands.into_iter().any(is_mixed) {
            true => parts.extend(part(i).quarters().map(|part| (part, look.corners(&part)))),
            false => {
                sum += seen.light;
                each(middle(&part(i)), seen.light);
            }
        }
    }
    for cut in 0..MOST_CUTS {
        let (mut mixed, mut of_mixed) = (Vec::new(), DVec3::ZERO);
        let mut whole = Vec::new();
        let mut gaps = false;
        for (part, corners) in parts {
            let seen = look.at(&part, corners);
            let gap = seen.gap && cut < GAP_CUTS;
            gaps |= gap;
            match seen.mixed || gap {
                true => {
                    of_mixed += seen.light;
                    whole.push((middle(&part), seen.light));
                    let quarters = part.quarters().into_iter();
                    mixed.extend(quarters.map(|part| (part, look.corners(&part))));
                }
                false => {
                    sum += seen.light;
                    each(middle(&part), seen.light);
                }
            }
        }
        let is_little = of_mixed.element_sum() <= MIXED * (sum + of_mixed).element_sum();
        if is_little && !gaps {
            (whole.into_iter()).for_each(|(way, light)| each(way, light));
            return;
        }
        parts = mixed;
    }
    for (part, _) in parts {
        each(middle(&part), look.at(&part, [None; 4]).light);
    }
}

impl Look<'_> {
    fn corners(&self, part: &SkyPart) -> [Option<View>; 4] {
        let corners = part.corners();
        corners.map(|corner| self.sees(self.sky.towards(corner)))
    }

    /// By four places within the part, no two in one row or column, and what it sees of its
    /// corners: a straight edge across the part leaves some of these on either side.
    fn at(&self, part: &SkyPart, corners: [Option<View>; 4]) -> Seen {
        let inner = INNER.map(|(x, y)| self.sky.towards(part.at(DVec2::new(x, y) / 8.0)));
        let views = inner.map(|towards| self.sees(towards));
        let mut light = DVec3::ZERO;
        for (towards, view) in inner.into_iter().zip(views) {
            if view == Some(View::Open) {
                let cosine = towards.dot(self.normal);
                light += self.sky.radiance(towards) * (cosine * part.solid_angle() / 4.0);
            }
        }
        let all = || corners.into_iter().chain(views).flatten();
        let open = all().any(|view| view == View::Open);
        let hidden = all().any(|view| view != View::Open);
        let gap = !open && hidden && {
            let outer = part.corners().map(|corner| self.sky.towards(corner));
            let towards = outer.into_iter().chain(inner);
            let hidden = towards.zip(corners.into_iter().chain(views));
            let hidden: Vec<_> = hidden
                .filter_map(|(towards, view)| match view? {
                    View::Hidden(part) => Some((towards, part)),
                    View::Open => None,
                })
                .collect();
            self.may_leave_a_gap(&hidden)
        };
        Seen {
            light,
            mixed: open && hidden,
            gap,
        }
    }

    /// Whether none of the parts that hide these directions hides all of them.
    fn may_leave_a_gap(&self, hidden: &[(DVec3, u32)]) -> bool {
        let [(_, first), rest @ ..] = hidden else {
            return false;
        };
        if rest.iter().all(|(_, part)| part == first) {
            return false;
        }
        let hides = |part: u32, towards: DVec3| {
            blocked_by_part(self.occluders, part, self.place, self.beyond(towards))
        };
        let hides_all =
            |part: u32| (hidden.iter()).all(|&(towards, by)| by == part || hides(part, towards));
        let mut parts: Vec<u32> = hidden.iter().map(|&(_, part)| part).collect();
        parts.sort_unstable();
        parts.dedup();
        !parts.into_iter().any(hides_all)
    }

    /// What is seen in a direction; nothing below the horizon.
    fn sees(&self, towards: DVec3) -> Option<View> {
        let above = towards.dot(self.normal) > 0.0;
        above.then(|| {
            let part = blocked_by(self.occluders, self.place, self.beyond(towards));
            part.map_or(View::Open, View::Hidden)
        })
    }

    fn beyond(&self, towards: DVec3) -> DVec3 {
        self.place + FAR * towards
    }
}

/// Places within a part, in eighths of it.
const INNER: [(f64, f64); 4] = [(1.0, 5.0), (3.0, 1.0), (5.0, 7.0), (7.0, 3.0)];
