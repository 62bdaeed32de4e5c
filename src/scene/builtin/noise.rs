//! Random patterns that repeat over a tile.

use crate::math::random;

/// A number in 0..1 that belongs to a cell of a grid.
pub(super) fn of_cell(x: i64, y: i64, seed: u64) -> f64 {
    let mixed =
        (x as u64).wrapping_mul(0x8cb9_2ba7_2f3d_8dd7) ^ (y as u64).wrapping_mul(random::STEP);
    let mut state = mixed.wrapping_add(seed.wrapping_mul(0xd1b5_4a32_d192_ed03));
    random::next(&mut state);
    random::unit(&mut state)
}

/// Smooth noise in −1..1 of `cells` cells across and up the tile.
pub(super) fn smooth([u, v]: [f64; 2], cells: [i64; 2], seed: u64) -> f64 {
    let (x, y) = (u * cells[0] as f64, v * cells[1] as f64);
    let ease = |t: f64| t * t * t * (t * (6.0 * t - 15.0) + 10.0);
    let (low_x, low_y) = (floor(x), floor(y));
    let (s, t) = (ease(x - low_x as f64), ease(y - low_y as f64));
    let at = |i: i64, j: i64| {
        let column = (low_x + i).rem_euclid(cells[0]);
        let row = (low_y + j).rem_euclid(cells[1]);
        2.0 * of_cell(column, row, seed) - 1.0
    };
    let below = at(0, 0) + s * (at(1, 0) - at(0, 0));
    let above = at(0, 1) + s * (at(1, 1) - at(0, 1));
    below + t * (above - below)
}

/// Of coordinates of a tile; `f64::floor` is a call.
fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero - i64::from(x < toward_zero as f64)
}

/// A sum of smooth noise, each of `octaves` half as strong and twice as fine as the one before;
/// about −1..1.
pub(super) fn rough(at: [f64; 2], cells: [i64; 2], octaves: u32, seed: u64) -> f64 {
    let octave = |k: u32| {
        let cells = cells.map(|n| n << k);
        0.5_f64.powi(k as i32) * smooth(at, cells, seed + u64::from(k))
    };
    (0..octaves).map(octave).sum()
}
