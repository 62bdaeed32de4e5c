//! Lines with fewer corners: two neighbours become one that keeps the area (Kronenfeld,
//! Stanislawski, Buttenfield and Brockmeyer 2020, "Simplification of polylines by segment
//! collapse").

use std::collections::HashMap;

use glam::{DVec2, IVec2};

use super::contours::Loop;

/// Lines of a repeating mask, in texels.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Lines {
    /// Within the first repeat.
    pub points: Vec<DVec2>,
    pub segments: Vec<Segment>,
}

/// From a point to another, with the opaque side to the left (see [`Loop`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Segment {
    pub from: u32,
    pub to: u32,
    /// Repeats from that of the one to that of the other.
    pub over: IVec2,
}

/// Shares of the tolerance, one after the other, so that small corners go first.
const ROUNDS: [f64; 5] = [1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0];

/// Passes over all lines in a round: each halves a straight line's corners.
const PASSES: usize = 24;

/// Side of the cells that points are found by, texels.
const CELL: f64 = 4.0;

/// Cells that are looked at for one corner; what needs more stays.
const MOST_CELLS: i64 = 4096;

/// Texels that two corners of a line are apart, at least.
const SHORT: f64 = 1e-3;

/// Corners that stay of a line that returns to where it began; one that goes on in the next repeat
/// may have one less.
const LEAST: u32 = 3;

/// Simplifies loops: no corner moves by more than about `tolerance` texels, each loop keeps its
/// area, and none crosses itself or another. A loop keeps three corners, so that no hole vanishes.
pub(super) fn simplified(loops: &[Loop], size: DVec2, tolerance: f64) -> Lines {
    let mut chains = Chains::new(loops, size);
    for round in ROUNDS {
        for _ in 0..PASSES {
            if !chains.pass(round * tolerance) {
                break;
            }
        }
    }
    chains.into_lines()
}

struct Chain {
    /// One of its points.
    first: u32,
    count: u32,
    /// Least that stay.
    least: u32,
}

/// All points, linked.
struct Chains {
    size: DVec2,
    /// Cells across and down.
    cells: [i64; 2],
    points: Vec<DVec2>,
    next: Vec<u32>,
    previous: Vec<u32>,
    /// What is added to the next point so that it is this one's neighbour.
    over: Vec<DVec2>,
    /// Bound of how far the line has moved here.
    moved: Vec<f64>,
    is_there: Vec<bool>,
    loops: Vec<Chain>,
    in_cells: HashMap<[i64; 2], Vec<u32>>,
}

impl Chains {
    fn new(loops: &[Loop], size: DVec2) -> Self {
        let cells = [size.x, size.y].map(|side| (side / CELL).floor().max(1.0) as i64);
        let mut chains = Self {
            size,
            cells,
            points: Vec::new(),
            next: Vec::new(),
            previous: Vec::new(),
            over: Vec::new(),
            moved: Vec::new(),
            is_there: Vec::new(),
            loops: Vec::new(),
            in_cells: HashMap::new(),
        };
        for of in loops {
            let (first, count) = (chains.points.len() as u32, of.points.len() as u32);
            chains.points.extend(&of.points);
            for k in 0..count {
                chains.next.push(first + (k + 1) % count);
                chains.previous.push(first + (k + count - 1) % count);
                let is_last = k + 1 == count;
                chains
                    .over
                    .push(if is_last { of.wrap } else { DVec2::ZERO });
            }
            let least = LEAST - u32::from(of.wrap != DVec2::ZERO);
            chains.loops.push(Chain {
                first,
                count,
                least,
            });
        }
        chains.moved = vec![0.0; chains.points.len()];
        chains.is_there = vec![true; chains.points.len()];
        for p in 0..chains.points.len() as u32 {
            let cell = chains.cell(chains.points[p as usize]);
            chains.enter(cell, p);
        }
        chains
    }

    /// The cell of a place, not wrapped.
    fn cell(&self, place: DVec2) -> [i64; 2] {
        let at = place / self.size;
        let along = |k: usize| (at[k] * self.cells[k] as f64).floor() as i64;
        [along(0), along(1)]
    }

    fn wrapped(&self, cell: [i64; 2]) -> [i64; 2] {
        [0, 1].map(|k| cell[k].rem_euclid(self.cells[k]))
    }

    fn enter(&mut self, cell: [i64; 2], point: u32) {
        let cell = self.wrapped(cell);
        self.in_cells.entry(cell).or_default().push(point);
    }

    fn leave(&mut self, point: u32) {
        let cell = self.wrapped(self.cell(self.points[point as usize]));
        if let Some(points) = self.in_cells.get_mut(&cell) {
            points.retain(|&p| p != point);
        }
    }

    /// Once about each loop; whether any corner went.
    fn pass(&mut self, tolerance: f64) -> bool {
        let mut has_changed = false;
        for l in 0..self.loops.len() {
            let Chain {
                first,
                count,
                least,
            } = self.loops[l];
            let (mut at, mut there, mut left) = (first, count, count);
            while left > 0 && there > least {
                left -= 1;
                if self.collapse(at, tolerance) {
                    has_changed = true;
                    there -= 1;
                    left = left.saturating_sub(1);
                }
                at = self.next[at as usize];
            }
            self.loops[l] = Chain {
                first: at,
                count: there,
                least,
            };
        }
        has_changed
    }

    /// Makes one of a point and the next, if nothing speaks against it.
    fn collapse(&mut self, b: u32, tolerance: f64) -> bool {
        let at = |p: u32| self.points[p as usize];
        let (a, c) = (self.previous[b as usize], self.next[b as usize]);
        let d = self.next[c as usize];
        let to_c = self.over[b as usize];
        let to_d = to_c + self.over[c as usize];
        let line = [
            at(a) - self.over[a as usize],
            at(b),
            at(c) + to_c,
            at(d) + to_d,
        ];
        let Some(middle) = same_area(line) else {
            return false;
        };
        let [pa, pb, pc, pd] = line;
        let off = to_line(pb, &[pa, middle, pd])
            .max(to_line(pc, &[pa, middle, pd]))
            .max(to_line(middle, &line));
        let moved = off + self.moved[b as usize].max(self.moved[c as usize]);
        let is_short = middle.distance(pa) <= SHORT || middle.distance(pd) <= SHORT;
        if moved > tolerance || is_short {
            return false;
        }
        // The line sweeps over these on its way.
        let own = [a, b, c, d];
        let swept = [[pa, pb, middle], [pb, pc, middle], [pc, pd, middle]];
        if !swept.iter().all(|&of| self.is_empty(of, own)) {
            return false;
        }
        self.leave(b);
        self.leave(c);
        self.points[b as usize] = middle;
        self.enter(self.cell(middle), b);
        self.moved[b as usize] = moved;
        self.is_there[c as usize] = false;
        self.next[b as usize] = d;
        self.previous[d as usize] = b;
        self.over[b as usize] = to_d;
        true
    }

    /// Whether no point lies in a triangle, besides these.
    fn is_empty(&self, triangle: [DVec2; 3], besides: [u32; 4]) -> bool {
        let [a, b, c] = triangle;
        let (low, high) = (self.cell(a.min(b).min(c)), self.cell(a.max(b).max(c)));
        let count = (high[0] - low[0] + 1).saturating_mul(high[1] - low[1] + 1);
        if count > MOST_CELLS {
            return false;
        }
        for y in low[1]..=high[1] {
            for x in low[0]..=high[0] {
                let Some(points) = self.in_cells.get(&self.wrapped([x, y])) else {
                    continue;
                };
                let repeat = [x, y].map(|of| of as f64);
                for &p in points.iter().filter(|p| !besides.contains(p)) {
                    let own = self.cell(self.points[p as usize]);
                    let over = DVec2::new(repeat[0] - own[0] as f64, repeat[1] - own[1] as f64);
                    let cells = DVec2::new(self.cells[0] as f64, self.cells[1] as f64);
                    let place = self.points[p as usize] + (over / cells).round() * self.size;
                    if holds(triangle, place) {
                        return false;
                    }
                }
            }
        }
        true
    }

    fn into_lines(self) -> Lines {
        let mut lines = Lines::default();
        let mut number = vec![0; self.points.len()];
        let repeat = |p: usize| (self.points[p] / self.size).floor();
        for p in (0..self.points.len()).filter(|&p| self.is_there[p]) {
            number[p] = lines.points.len() as u32;
            lines.points.push(self.points[p] - repeat(p) * self.size);
        }
        for p in (0..self.points.len()).filter(|&p| self.is_there[p]) {
            let next = self.next[p] as usize;
            let over = repeat(next) + (self.over[p] / self.size).round() - repeat(p);
            lines.segments.push(Segment {
                from: number[p],
                to: number[next],
                over: over.as_ivec2(),
            });
        }
        lines
    }
}

/// The point that takes the place of b and c between a and d and leaves as much area on either
/// side.
fn same_area([a, b, c, d]: [DVec2; 4]) -> Option<DVec2> {
    let base = d - a;
    let length = base.length();
    if length == 0.0 {
        return None;
    }
    let height = |p: DVec2| base.perp_dot(p - a) / length;
    let (of_b, of_c) = (height(b), height(c));
    // Twice the area between the line and its base.
    let area = (b - a).perp_dot(c - a) + (c - a).perp_dot(d - a);
    let wanted = -area / length;
    let flat = 1e-9 * length;
    if of_b.abs() <= flat && of_c.abs() <= flat {
        return Some(b.midpoint(c));
    }
    let on_first = match (of_b >= 0.0) == (of_c >= 0.0) {
        true => of_b.abs() > of_c.abs(),
        false => (wanted >= 0.0) == (of_b >= 0.0),
    };
    let place = match on_first {
        true => a + (b - a) * (wanted / of_b),
        false => d + (c - d) * (wanted / of_c),
    };
    place.is_finite().then_some(place)
}

/// Distance to a line of several segments.
fn to_line(p: DVec2, line: &[DVec2]) -> f64 {
    let to_segment = |of: &[DVec2]| {
        let along = of[1] - of[0];
        let square = along.length_squared();
        let share = match square > 0.0 {
            true => ((p - of[0]).dot(along) / square).clamp(0.0, 1.0),
            false => 0.0,
        };
        p.distance(of[0] + share * along)
    };
    line.windows(2)
        .map(to_segment)
        .fold(f64::INFINITY, f64::min)
}

/// Whether a triangle, its edges included, holds a place; a flat one holds none.
fn holds([a, b, c]: [DVec2; 3], p: DVec2) -> bool {
    let turns = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(p - from));
    let area = (b - a).perp_dot(c - a);
    area != 0.0 && turns.iter().all(|turn| turn * area.signum() >= 0.0)
}
