//! Parts of triangles that see all of each light, or none: what is drawn there follows no shadow
//! rays.
//!
//! A triangle that is neither as a whole is cut along lines of equal shares of its corners a, b and
//! c, each side in 2^level. Parts are judged from coarse to fine.

use glam::DVec3;

use super::shaft_starts::Starts;
use super::shafts::{Blockers, Shafts};
use crate::constants::PART_UNSURE;
use crate::passes::types::LitTriangle;

/// Most cuts of a side in two.
const MOST_LEVELS: u32 = 7;
/// Pixels along a side of a part. With 4 fewer places follow shadow rays, but to judge the parts
/// took longer: `cornell-box` 1.38 s in place of 1.26, `fruit-platter` 4.30 in place of 4.21.
const PART_PIXELS: f64 = 8.0;
/// Parts are judged so much larger than they are: the shares of a drawn place are rounded.
const LARGER: f64 = 1.03;
/// Most parts of a view, all triangles taken together.
const MOST_PARTS: u64 = 1 << 24;

/// How often the sides of each triangle are to be cut in two at most, by its size in pixels, whose
/// angle is `pixel`.
pub fn levels(triangles: &[LitTriangle], pixel: f64) -> Vec<u32> {
    let wanted = triangles.iter().map(|t| {
        let [a, b, c] = [t.a, t.b, t.c].map(|v| v.as_dvec3());
        let area = (b - a).cross(c - a).length() / 2.0;
        let nearest = a.length().min(b.length()).min(c.length());
        let parts = area / (PART_PIXELS * pixel * nearest).powi(2);
        (parts.max(1.0).log2() / 2.0)
            .ceil()
            .min(f64::from(MOST_LEVELS)) as u32
    });
    let mut wanted: Vec<u32> = wanted.collect();
    while wanted.iter().map(|l| 2_u64 << (2 * l)).sum::<u64>() > MOST_PARTS {
        wanted.iter_mut().for_each(|l| *l = l.saturating_sub(1));
        if wanted.iter().all(|&l| l == 0) {
            break;
        }
    }
    wanted
}

/// PART_… of a triangle: one if it is not cut, or those of the parts of a triangle that is cut
/// `level` times, `[row along c][column along b][2]`, the lower part of a cell first.
pub fn states(shafts: &Shafts, triangle: &LitTriangle, level: u32) -> Vec<u8> {
    let whole = Part {
        column: 0,
        row: 0,
        level: 0,
        upper: false,
    };
    let mut blockers = Blockers::default();
    let state = whole.state(shafts, triangle, &mut blockers);
    if level == 0 || state != PART_UNSURE || shafts.is_empty() {
        return vec![state as u8];
    }
    let mut states = vec![PART_UNSURE as u8; 2 << (2 * level)];
    for child in whole.children() {
        child.judge((shafts, &mut blockers), triangle, level, &mut states);
    }
    states
}

/// Number of parts in each state, `[PART_…]`, of a triangle with sides cut in 2^level. States of
/// cells beyond the third side are of no part.
pub fn count(states: &[u8], level: u32) -> [usize; 3] {
    let mut counts = [0; 3];
    let side = 1_usize << level;
    for (i, &state) in states.iter().enumerate() {
        let (cell, upper) = (i / 2, i % 2);
        if cell % side + cell / side + upper < side {
            counts[usize::from(state)] += 1;
        }
    }
    counts
}

/// One of the two halves of a cell.
#[derive(Clone, Copy)]
struct Part {
    column: u32,
    row: u32,
    level: u32,
    upper: bool,
}

impl Part {
    /// Judges it, or its parts down to a level.
    fn judge(
        self,
        (shafts, blockers): (&Shafts, &mut Blockers),
        triangle: &LitTriangle,
        level: u32,
        states: &mut [u8],
    ) {
        let state = self.state(shafts, triangle, blockers);
        if state != PART_UNSURE {
            self.set(level, state as u8, states);
        } else if self.level < level {
            for child in self.children() {
                child.judge((shafts, blockers), triangle, level, states);
            }
        }
    }

    fn set(self, level: u32, state: u8, states: &mut [u8]) {
        if self.level < level {
            for child in self.children() {
                child.set(level, state, states);
            }
        } else {
            let cell = (self.row << level) + self.column;
            states[2 * cell as usize + usize::from(self.upper)] = state;
        }
    }

    /// Three like it about one that is turned.
    fn children(self) -> [Self; 4] {
        let middle = u32::from(self.upper);
        [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| {
            let turned = (column, row) == (1 - middle, 1 - middle);
            let (column, row) = if turned {
                (middle, middle)
            } else {
                (column, row)
            };
            Self {
                column: 2 * self.column + column,
                row: 2 * self.row + row,
                level: self.level + 1,
                upper: self.upper != turned,
            }
        })
    }

    /// Shares of b and c at its corners, and so of a: a little larger than it is, within the
    /// triangle.
    fn shares(self) -> [DVec3; 3] {
        let side = f64::from(1_u32 << self.level);
        let (low, high) = (0.0, 1.0);
        let corners = match self.upper {
            false => [[low, low], [high, low], [low, high]],
            true => [[high, high], [low, high], [high, low]],
        };
        let shares = corners.map(|[b, c]| {
            let b = (f64::from(self.column) + b) / side;
            let c = (f64::from(self.row) + c) / side;
            DVec3::new(1.0 - b - c, b, c)
        });
        let middle = (shares[0] + shares[1] + shares[2]) / 3.0;
        shares.map(|share| {
            let inside = (middle + (share - middle) * LARGER).max(DVec3::ZERO);
            inside / inside.element_sum()
        })
    }

    fn state(self, shafts: &Shafts, triangle: &LitTriangle, blockers: &mut Blockers) -> u32 {
        let [a, b, c] = [triangle.a, triangle.b, triangle.c].map(|v| v.as_dvec3());
        let corners = self.shares().map(|s| a * s.x + b * s.y + c * s.z);
        shafts.state(&Starts::on_part(triangle, corners), blockers)
    }
}
