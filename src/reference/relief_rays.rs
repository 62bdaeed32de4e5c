//! Twin of the march over a height map: cell by cell, in f64, without a pyramid.

use glam::{DVec2, DVec3};

use crate::scene::HeightMap;

/// Where a segment first passes below the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// 0 at the segment's start, 1 at its end.
    pub t: f64,
    /// ∂h/∂u and ∂h/∂v of the bilinear patch.
    pub gradient: DVec2,
}

/// The smallest t in 0..=1 where the straight segment between two places (u, v, height) goes from
/// above or on the bilinear surface to below it, 0 where it starts below it; and the number of
/// cells visited.
pub fn march(map: &HeightMap, from: DVec3, to: DVec3) -> (Option<Hit>, u32) {
    let mut cells = 0;
    for piece in pieces(map, from, to) {
        cells += 1;
        if let Some(r) = piece.crossing() {
            let at = piece.at + r * piece.along;
            let hit = Hit {
                t: piece.from + r * (piece.to - piece.from),
                gradient: (piece.slope + piece.twist * DVec2::new(at.y, at.x))
                    * DVec2::new(f64::from(map.width), -f64::from(map.height)),
            };
            return (Some(hit), cells);
        }
    }
    (None, cells)
}

/// The least height of the segment above the surface; negative below it.
pub fn clearance(map: &HeightMap, from: DVec3, to: DVec3) -> f64 {
    pieces(map, from, to)
        .map(|piece| {
            let [a, b, c] = piece.polynomial();
            let lowest = if a > 0.0 {
                (-b / (2.0 * a)).clamp(0.0, 1.0)
            } else {
                0.0
            };
            c.min(c + b + a).min(c + lowest * (b + lowest * a))
        })
        .fold(f64::INFINITY, f64::min)
}

/// The part of a segment over one cell.
struct Piece {
    from: f64,
    to: f64,
    /// Its start, in texels from the cell's low corner, with its height; and its end less its
    /// start.
    at: DVec3,
    along: DVec3,
    /// The patch: corner + slope · p + twist p.x p.y.
    corner: f64,
    slope: DVec2,
    twist: f64,
}

impl Piece {
    /// Height above the patch, a r² + b r + c for r in 0..=1.
    fn polynomial(&self) -> [f64; 3] {
        let (p, d) = (self.at, self.along);
        [
            -self.twist * d.x * d.y,
            d.z - self.slope.dot(d.truncate()) - self.twist * (p.x * d.y + p.y * d.x),
            p.z - self.corner - self.slope.dot(p.truncate()) - self.twist * p.x * p.y,
        ]
    }

    /// The first r where it goes below: 0 if it starts below, else the root at which the polynomial
    /// decreases.
    fn crossing(&self) -> Option<f64> {
        let [a, b, c] = self.polynomial();
        if c < 0.0 {
            return Some(0.0);
        }
        if a == 0.0 {
            return (c + b < 0.0).then(|| -c / b);
        }
        let discriminant = b * b - 4.0 * a * c;
        if discriminant < 0.0 || a > 0.0 && discriminant == 0.0 {
            return None;
        }
        // The polynomial decreases where 2 a r + b = −√(b² − 4 a c); the other form of the root
        // avoids cancellation.
        let root = discriminant.sqrt();
        let r = if b >= 0.0 {
            -(b + root) / (2.0 * a)
        } else {
            2.0 * c / (root - b)
        };
        (0.0..1.0).contains(&r).then_some(r)
    }
}

/// The segment cut where it crosses rows or columns of texel centres.
fn pieces(map: &HeightMap, from: DVec3, to: DVec3) -> impl Iterator<Item = Piece> + '_ {
    let (width, height) = (i64::from(map.width), i64::from(map.height));
    // To texels, rows downward.
    let place = |p: DVec3| {
        DVec3::new(
            p.x * width as f64 - 0.5,
            (1.0 - p.y) * height as f64 - 0.5,
            p.z,
        )
    };
    let (start, step) = (place(from), place(to) - place(from));
    let texel = move |column: i64, row: i64| {
        let at = row.rem_euclid(height) * width + column.rem_euclid(width);
        f64::from(map.values[at as usize])
    };
    let mut columns = lines(start.x, step.x).peekable();
    let mut rows = lines(start.y, step.y).peekable();
    let mut from = 0.0;
    let mut ended = false;
    std::iter::from_fn(move || {
        if ended {
            return None;
        }
        let column = columns.peek().copied().unwrap_or(1.0);
        let row = rows.peek().copied().unwrap_or(1.0);
        let to = column.min(row);
        if column <= row {
            columns.next();
        } else {
            rows.next();
        }
        ended = to >= 1.0;
        let middle = start + 0.5 * (from + to) * step;
        let (i, j) = (middle.x.floor() as i64, middle.y.floor() as i64);
        let (corner, right, down) = (texel(i, j), texel(i + 1, j), texel(i, j + 1));
        let piece = Piece {
            from,
            to,
            at: start + from * step - DVec3::new(i as f64, j as f64, 0.0),
            along: (to - from) * step,
            corner,
            slope: DVec2::new(right - corner, down - corner),
            twist: texel(i + 1, j + 1) - down - right + corner,
        };
        from = to;
        Some(piece)
    })
}

/// Each t in 0..1 where a coordinate is a whole number, in order; none if it is constant.
fn lines(start: f64, step: f64) -> impl Iterator<Item = f64> {
    let first = if step > 0.0 {
        start.floor() + 1.0
    } else {
        start.ceil() - 1.0
    };
    (0..)
        .map(move |n| (first + f64::from(n) * step.signum() - start) / step)
        .take_while(move |&t| step != 0.0 && t < 1.0)
}
