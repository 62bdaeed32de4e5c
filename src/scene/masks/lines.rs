//! The lines of a mask, found by place.

use std::collections::HashMap;

use glam::{DVec2, IVec2};

use super::simplify::{Lines, Segment};

/// Cells across and down, at most, and the least texels across one.
const MOST: f64 = 512.0;
const LEAST_TEXELS: f64 = 8.0;

/// Cells that one triangle may cover, and segments in them.
const MOST_LOOKED_AT: f64 = 4e6;
const MOST_FOUND: usize = 4_000_000;

/// The repeating plane with the lines of a mask.
pub(super) struct Plane {
    size: DVec2,
    lines: Lines,
    /// Cells in a repeat.
    cells: DVec2,
    /// Segments, and the repeat that each is moved to.
    in_cells: HashMap<IVec2, Vec<(u32, IVec2)>>,
}

/// An end of a segment: a point of the lines in a repeat.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct PointAt {
    pub point: u32,
    pub repeat: IVec2,
}

impl Plane {
    pub fn new(size: DVec2, lines: Lines) -> Self {
        let mut plane = Self {
            size,
            lines,
            cells: (size / LEAST_TEXELS)
                .floor()
                .clamp(DVec2::ONE, DVec2::splat(MOST)),
            in_cells: HashMap::new(),
        };
        for (s, segment) in plane.lines.segments.iter().enumerate() {
            let [from, to] = plane.ends(segment, IVec2::ZERO).map(|at| plane.place(at));
            let (low, high) = (plane.cell(from.min(to)), plane.cell(from.max(to)));
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let (cell, repeat) = plane.wrapped(IVec2::new(x, y));
                    let own = plane.in_cells.entry(cell).or_default();
                    own.push((s as u32, -repeat));
                }
            }
        }
        plane
    }

    pub fn is_empty(&self) -> bool {
        self.lines.segments.is_empty()
    }

    fn ends(&self, segment: &Segment, repeat: IVec2) -> [PointAt; 2] {
        let at = |point, repeat| PointAt { point, repeat };
        [
            at(segment.from, repeat),
            at(segment.to, repeat + segment.over),
        ]
    }

    /// Texels.
    pub fn place(&self, at: PointAt) -> DVec2 {
        self.lines.points[at.point as usize] + at.repeat.as_dvec2() * self.size
    }

    /// Not wrapped.
    fn cell(&self, place: DVec2) -> IVec2 {
        (place / self.size * self.cells).floor().as_ivec2()
    }

    /// A cell of the first repeat, and the repeat that the given one lies in.
    fn wrapped(&self, cell: IVec2) -> (IVec2, IVec2) {
        let cells = self.cells.as_ivec2();
        let repeat = IVec2::new(cell.x.div_euclid(cells.x), cell.y.div_euclid(cells.y));
        (cell - repeat * cells, repeat)
    }

    /// Segments that may lie in a box, in the same order for the same box; None where it covers too
    /// many repeats to look at.
    pub fn about(&self, low: DVec2, high: DVec2) -> Option<Vec<[PointAt; 2]>> {
        let across = (high - low) / self.size * self.cells + 2.0;
        let furthest = low.abs().max(high.abs()) / self.size * self.cells;
        let is_far = furthest.max_element() > f64::from(i32::MAX / 4);
        if across.x * across.y > MOST_LOOKED_AT || is_far {
            return None;
        }
        let (low, high) = (self.cell(low), self.cell(high));
        let mut found = Vec::new();
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                let (cell, repeat) = self.wrapped(IVec2::new(x, y));
                let own = self.in_cells.get(&cell).into_iter().flatten();
                found.extend(own.map(|&(s, moved)| (s, (repeat + moved).to_array())));
                if found.len() > MOST_FOUND {
                    return None;
                }
            }
        }
        found.sort_unstable();
        found.dedup();
        let ends = |(s, repeat): (u32, [i32; 2])| {
            self.ends(&self.lines.segments[s as usize], IVec2::from_array(repeat))
        };
        Some(found.into_iter().map(ends).collect())
    }
}
