//! Where alpha equals the cutoff: marching squares (Lorensen and Cline 1987) over the texels of a
//! mask that repeats.

use glam::DVec2;

use super::AlphaMask;

/// A closed line, the opaque side to the left of x right and y down seen as x right and y up: the
/// side to which the cross product with its direction is positive.
pub(super) struct Loop {
    /// In texels; those of neighbours are not wrapped.
    pub points: Vec<DVec2>,
    /// From the first point to the one after the last: whole repeats, 0 of most.
    pub wrap: DVec2,
}

/// Of the way between two texels: as close a crossing comes to either, so that no line shrinks to a
/// point where a texel lies just at the cutoff.
const OFF_TEXELS: f64 = 1.0 / 32.0;

/// Texels that a line bends within a cell, at least.
const LEAST_BEND: f64 = 1.0 / 64.0;

/// Of the way to the bend: the two lines of a saddle meet where its middle is at the cutoff.
const SHORT_OF_BEND: f64 = 0.95;

/// Corners of a cell and the way from each to the next. Edge k leads from corner k to the next.
const CORNERS: [[i64; 2]; 4] = [[0, 0], [1, 0], [1, 1], [0, 1]];

struct Cells<'a> {
    mask: &'a AlphaMask,
    width: i64,
    height: i64,
}

/// The lines of a mask; none where all of it is opaque, or nothing.
pub(super) fn loops(mask: &AlphaMask) -> Vec<Loop> {
    let cells = Cells {
        mask,
        width: i64::from(mask.map.width),
        height: i64::from(mask.map.height),
    };
    let mut passed = vec![false; 2 * mask.map.alpha.len()];
    let mut loops = Vec::new();
    for y in 0..cells.height {
        for x in 0..cells.width {
            for k in 0..4 {
                let starts = cells.leaves([x, y], k) && !passed[cells.number([x, y], k)];
                if starts {
                    loops.push(cells.walk([x, y], k, &mut passed));
                }
            }
        }
    }
    loops
}

impl Cells<'_> {
    fn value(&self, [x, y]: [i64; 2]) -> f64 {
        let (x, y) = (x.rem_euclid(self.width), y.rem_euclid(self.height));
        self.mask.texel(x as usize, y as usize)
    }

    fn corner(&self, [x, y]: [i64; 2], k: usize) -> [i64; 2] {
        let [right, down] = CORNERS[k % 4];
        [x + right, y + down]
    }

    fn is_opaque(&self, cell: [i64; 2], k: usize) -> bool {
        self.value(self.corner(cell, k)) >= 0.0
    }

    /// Whether a line of this cell starts on edge k: it leads out of what is opaque.
    fn leaves(&self, cell: [i64; 2], k: usize) -> bool {
        self.is_opaque(cell, k) && !self.is_opaque(cell, k + 1)
    }

    /// Ends of edge k, the left or upper one first.
    fn ends(&self, cell: [i64; 2], k: usize) -> [[i64; 2]; 2] {
        let ends = [self.corner(cell, k), self.corner(cell, k + 1)];
        match k % 4 {
            0 | 1 => ends,
            _ => [ends[1], ends[0]],
        }
    }

    /// A number for each edge of the repeating mask.
    fn number(&self, cell: [i64; 2], k: usize) -> usize {
        let [[x, y], _] = self.ends(cell, k);
        let (x, y) = (x.rem_euclid(self.width), y.rem_euclid(self.height));
        let texel = (y * self.width + x) as usize;
        2 * texel + k % 2
    }

    fn crossing(&self, cell: [i64; 2], k: usize) -> DVec2 {
        let [a, b] = self.ends(cell, k);
        let (at_a, at_b) = (self.value(a), self.value(b));
        let share = (at_a / (at_a - at_b)).clamp(OFF_TEXELS, 1.0 - OFF_TEXELS);
        let place = |[x, y]: [i64; 2]| DVec2::new(x as f64, y as f64);
        place(a).lerp(place(b), share)
    }

    /// The edge on which the line ends that starts on edge k.
    fn end(&self, cell: [i64; 2], k: usize) -> usize {
        let enters = |m: usize| !self.is_opaque(cell, m) && self.is_opaque(cell, m + 1);
        let ends: Vec<usize> = (k + 1..k + 4).filter(|&m| enters(m)).collect();
        let saddle = ends.len() > 1;
        let middle: f64 = (0..4).map(|c| self.value(self.corner(cell, c))).sum();
        // What is opaque is joined across the cell where its middle is.
        match saddle && middle < 0.0 {
            true => k + 3,
            false => ends.first().copied().unwrap_or(k + 2),
        }
    }

    /// Where the line between two crossings of a cell bends most: on the hyperbola where bilinear
    /// alpha is the cutoff, across from the middle of its chord; None where it is straight.
    fn bend(&self, cell: [i64; 2], from: DVec2, to: DVec2) -> Option<DVec2> {
        let low = DVec2::new(cell[0] as f64, cell[1] as f64);
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| self.value(self.corner(cell, k)));
        let (of_x, of_y, of_both) = (b - a, d - a, a - b + c - d);
        let (middle, across) = (from.midpoint(to) - low, (to - from).perp());
        let at_middle = a + of_x * middle.x + of_y * middle.y + of_both * middle.x * middle.y;
        let slope = of_x * across.x
            + of_y * across.y
            + of_both * (middle.x * across.y + middle.y * across.x);
        let square = of_both * across.x * across.y;
        let root = (slope * slope - 4.0 * square * at_middle).max(0.0).sqrt();
        // The root nearer to the chord.
        let share = -2.0 * at_middle / (slope + slope.signum() * root);
        let bend = middle + SHORT_OF_BEND * share * across;
        let is_within = bend.cmpgt(DVec2::ZERO).all() && bend.cmplt(DVec2::ONE).all();
        (is_within && bend.distance(middle) > LEAST_BEND).then_some(low + bend)
    }

    fn walk(&self, cell: [i64; 2], k: usize, passed: &mut [bool]) -> Loop {
        let (mut at, mut on) = (cell, k);
        let mut points = Vec::new();
        loop {
            let number = self.number(at, on);
            if passed[number] {
                break;
            }
            passed[number] = true;
            points.push(self.crossing(at, on));
            let end = self.end(at, on) % 4;
            points.extend(self.bend(at, points[points.len() - 1], self.crossing(at, end)));
            let [right, down] = [[0, -1], [1, 0], [0, 1], [-1, 0]][end];
            at = [at[0] + right, at[1] + down];
            on = (end + 2) % 4;
        }
        Loop {
            points,
            wrap: DVec2::new((at[0] - cell[0]) as f64, (at[1] - cell[1]) as f64),
        }
    }
}
