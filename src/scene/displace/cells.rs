//! A convex polygon cut along the lines of whole coordinates.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

/// Points nearer to a line than this, in cells, lie on it.
pub const ON_LINE: f64 = 0.01;

/// A corner of a polygon in a triangle.
#[derive(Clone, Copy)]
pub struct Point {
    pub vertex: u32,
    /// Place in cells.
    pub at: DVec2,
    /// Barycentric coordinates.
    pub weights: DVec3,
}

/// The parts of a polygon, one in each cell that it reaches.
///
/// Each crossing of a line by the polygon's own edges must be one of its points, within half of
/// [`ON_LINE`]; `vertex` makes the others, where two lines cross, each once.
pub fn cells(polygon: Vec<Point>, mut vertex: impl FnMut(DVec3) -> u32) -> Vec<Vec<Point>> {
    let mut corners = HashMap::new();
    let mut meet = |from: &Point, to: &Point, share: f64| {
        let at = from.at.lerp(to.at, share);
        let weights = from.weights.lerp(to.weights, share);
        let corner = at.round().to_array().map(|x| x as i64);
        *corners.entry(corner).or_insert_with(|| Point {
            vertex: vertex(weights),
            at,
            weights,
        })
    };
    let (mut open, mut done) = (vec![polygon], Vec::new());
    while let Some(polygon) = open.pop() {
        match (0..2).find_map(|axis| Some((axis, middle_line(&polygon, axis)?))) {
            Some((axis, line)) => open.extend(halves(&polygon, axis, line, &mut meet)),
            None => done.push(polygon),
        }
    }
    done
}

/// The line nearest to the middle of a polygon that lies on both sides of it.
fn middle_line(polygon: &[Point], axis: usize) -> Option<f64> {
    let along = || polygon.iter().map(|p| p.at[axis]);
    let low = along().fold(f64::INFINITY, f64::min);
    let high = along().fold(f64::NEG_INFINITY, f64::max);
    let line = ((low + high) / 2.0).round();
    (low < line - ON_LINE && line + ON_LINE < high).then_some(line)
}

/// What of a polygon lies below and above a line. The two share no more than two points.
fn halves(
    polygon: &[Point],
    axis: usize,
    line: f64,
    meet: &mut impl FnMut(&Point, &Point, f64) -> Point,
) -> [Vec<Point>; 2] {
    let above = |p: &Point| match p.at[axis] - line {
        apart if apart.abs() <= ON_LINE => None,
        apart => Some(apart > 0.0),
    };
    let count = polygon.len();
    let first = (0..count).find(|&k| above(&polygon[k]).is_some());
    let turned = |k: usize| &polygon[(first.unwrap_or(0) + k) % count];
    let mut halves = [Vec::new(), Vec::new()];
    let mut side = above(turned(0)).unwrap_or(false);
    let mut k = 0;
    while k < count {
        halves[usize::from(side)].push(*turned(k));
        // The next points lie on the line; the boundary crosses it at the first of them, or not.
        let on = (k + 1..count)
            .take_while(|&k| above(turned(k)).is_none())
            .count();
        let next = turned(k + 1 + on);
        let crosses = above(next) != Some(side);
        if crosses {
            let shared = match on {
                0 => {
                    let from = turned(k);
                    let share = (line - from.at[axis]) / (next.at[axis] - from.at[axis]);
                    meet(from, next, share)
                }
                _ => *turned(k + 1),
            };
            halves[usize::from(side)].push(shared);
            side = !side;
            halves[usize::from(side)].push(shared);
        }
        let kept = usize::from(crosses).min(on);
        halves[usize::from(side)].extend((kept..on).map(|i| *turned(k + 1 + i)));
        k += 1 + on;
    }
    halves
}
