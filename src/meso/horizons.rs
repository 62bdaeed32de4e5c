//! How steeply a relief can rise in the way of a ray that leaves its surface. A ray to a light that
//! rises more steeply needs no march over the height map.

use std::f32::consts::FRAC_PI_8;
use std::ops::Range;

use rayon::prelude::*;

use crate::constants::{HORIZON_SECTORS, HORIZON_UNKNOWN};
use crate::scene::HeightMap;

/// Upper bounds of the slope at which a height map rises, seen from its own surface, by place and
/// direction, for `shaders/shared/horizons.glsl`.
///
/// A straight way from any place on the surface over a block, in any direction of a sector, does
/// not meet the surface again if it rises by more than the bound: heights of the map for a texel
/// across. The map repeats without end.
///
/// Sector Σ 2ⁱ bᵢ, x along columns, y down the rows: b₀: x < 0; b₁: y < 0; b₂: |y| > |x|; b₃: the
/// lesser of the two is more than tan(π/8) times the greater.
#[derive(Debug, Clone, PartialEq)]
pub struct Horizons {
    /// Blocks of a period, across and down; block (0, 0) begins at the centre of texel (0, 0).
    pub columns: u32,
    pub rows: u32,
    /// Slope of a step of the bounds.
    pub step: f32,
    /// In steps, `[row][column][sector]`; [`HORIZON_UNKNOWN`] for no bound.
    pub bounds: Vec<[u8; SECTORS]>,
}

const SECTORS: usize = HORIZON_SECTORS as usize;
/// Cells are cut into blocks, up to so many of them in all, and joined to blocks above.
const CUT_BLOCKS: usize = 1 << 16;
const MOST_BLOCKS: usize = 1 << 18;
/// Columns of blocks looked at one by one; those behind are looked at in groups.
const NEAR: usize = 8;
/// Bounds are raised by this share for the rounding of what they are found from.
const ROUNDING: f32 = 1e-5;

impl Horizons {
    /// Without bounds: of maps that are not looked at.
    pub fn unknown() -> Self {
        Self {
            columns: 1,
            rows: 1,
            step: 1.0,
            bounds: vec![[HORIZON_UNKNOWN as u8; SECTORS]],
        }
    }

    /// Of a map of more than 2¹⁸ texels with sides that cannot be halved, nothing is known.
    pub fn new(map: &HeightMap) -> Self {
        let Some((blocks, per_texel)) = Blocks::new(map) else {
            return Self::unknown();
        };
        let bounds: Vec<Vec<f32>> = (0..SECTORS)
            .into_par_iter()
            .map(|sector| blocks.bounds(&Sector::new(sector)))
            .collect();
        let greatest = bounds.iter().flatten().fold(0.0_f32, |m, &b| m.max(b));
        let most = (HORIZON_UNKNOWN - 1) as f32;
        let step = (greatest / most * (1.0 + ROUNDING)).max(f32::MIN_POSITIVE);
        let of_block = |i: usize| {
            std::array::from_fn(|sector| (bounds[sector][i] / step).ceil().min(most) as u8)
        };
        Self {
            columns: blocks.columns as u32,
            rows: blocks.rows as u32,
            step: step * per_texel,
            bounds: (0..blocks.lowest.len())
                .into_par_iter()
                .map(of_block)
                .collect(),
        }
    }
}

/// A period of a surface in blocks, `[row][column]`. Lengths across are in blocks.
struct Blocks {
    columns: usize,
    rows: usize,
    /// Slopes of the cells: along x on the upper and lower sides, along y on the left and right.
    slopes: Vec<[f32; 4]>,
    /// Cells along a side of a block.
    joined: usize,
    lowest: Vec<f32>,
    /// Greatest heights over windows of 2ⁿ × 2ⁿ blocks that begin at a block, `[n]`.
    highest: Vec<Vec<f32>>,
}

impl Blocks {
    /// With how many blocks a texel is wide.
    fn new(map: &HeightMap) -> Option<(Self, f32)> {
        let (width, height) = (map.width as usize, map.height as usize);
        let (mut cut, mut joined) = (1, 1);
        while width * height * (2 * cut) * (2 * cut) <= CUT_BLOCKS {
            cut *= 2;
        }
        while width * height > MOST_BLOCKS * joined * joined {
            joined *= 2;
            if !width.is_multiple_of(joined) || !height.is_multiple_of(joined) {
                return None;
            }
        }
        let (across, down) = (width * cut, height * cut);
        let texel = |i: usize, j: usize| map.values[j % height * width + i % width];
        // Parts of a bilinear cell are bilinear.
        let height_at = |i: usize, j: usize| {
            let (column, row) = (i / cut, j / cut);
            let share = |at: usize| (at % cut) as f32 / cut as f32;
            let upper = mix(texel(column, row), texel(column + 1, row), share(i));
            let lower = mix(texel(column, row + 1), texel(column + 1, row + 1), share(i));
            mix(upper, lower, share(j))
        };
        let corners: Vec<[f32; 4]> = (0..across * down)
            .into_par_iter()
            .map(|at| {
                let (i, j) = (at % across, at / across);
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(x, y)| height_at(i + x, j + y))
            })
            .collect();
        let of_block = |start: f32, find: fn(f32, f32) -> f32| {
            let ends: Vec<f32> = (corners.par_iter())
                .map(|c| c.iter().copied().fold(start, find))
                .collect();
            join(&ends, across, joined, find)
        };
        let (columns, rows) = (across / joined, down / joined);
        let mut highest = vec![of_block(f32::NEG_INFINITY, f32::max)];
        for side in (0..).map(|n| 1_usize << n) {
            if side >= columns.max(rows) {
                break;
            }
            highest.push(doubled(&highest[highest.len() - 1], columns, side));
        }
        let lowest = of_block(f32::INFINITY, f32::min);
        let slopes = corners
            .into_par_iter()
            .map(|[a, b, c, d]| [b - a, d - c, c - a, d - b].map(|rise| rise * joined as f32))
            .collect();
        let blocks = Self {
            columns,
            rows,
            slopes,
            joined,
            lowest,
            highest,
        };
        Some((blocks, cut as f32 / joined as f32))
    }

    /// Bounds for one sector, `[row][column]`.
    fn bounds(&self, sector: &Sector) -> Vec<f32> {
        let steepest: Vec<f32> = self.slopes.iter().map(|s| sector.steepest(s)).collect();
        let steepest = join(&steepest, self.columns * self.joined, self.joined, f32::max);
        let rows = (0..self.rows).into_par_iter();
        rows.flat_map_iter(|row| self.row(sector, &steepest, row))
            .collect()
    }

    /// Bounds of one row. A way that begins in a block and has come to the k-th column of blocks in
    /// the sector's main direction has risen at most by the steepest of the slopes in the blocks
    /// that it can have passed, and no higher than the highest of those it may be over.
    fn row(&self, sector: &Sector, steepest: &[f32], row: usize) -> Vec<f32> {
        let low = &self.lowest[row * self.columns..][..self.columns];
        let unseen = || vec![f32::NEG_INFINITY; self.columns];
        let mut bounds = vec![0.0_f32; self.columns];
        let mut rise = unseen();
        for k in 0..NEAR {
            let blocks = || sector.across(k, 1).map(|c| sector.window(k, c, 1));
            blocks().for_each(|by| self.raise(&mut rise, steepest, row, by));
            let mut high = unseen();
            blocks().for_each(|by| self.raise(&mut high, &self.highest[0], row, by));
            let distance = sector.distance(k);
            for (i, bound) in bounds.iter_mut().enumerate() {
                // No slope where the distance may be 0.
                let slope = match distance > 0.0 {
                    true => (high[i] - low[i]) / distance,
                    false => f32::INFINITY,
                };
                *bound = bound.max(rise[i].min(slope));
            }
        }
        let top = self.highest[self.highest.len() - 1][0];
        for (n, highest) in self.highest.iter().enumerate().skip(1) {
            let side = 1 << n;
            for k in (NEAR / 2 * side..NEAR * side).step_by(side) {
                let distance = sector.distance(k);
                let mut rest = bounds.iter().zip(low);
                if rest.all(|(bound, low)| (top - low) / distance <= *bound) {
                    return bounds;
                }
                let mut high = unseen();
                let Range { start, end } = sector.across(k, side);
                for c in (start..end).step_by(side) {
                    let c = c.min(end.saturating_sub(side).max(start));
                    self.raise(&mut high, highest, row, sector.window(k, c, side));
                }
                for ((bound, high), low) in bounds.iter_mut().zip(&high).zip(low) {
                    *bound = bound.max((high - low) / distance);
                }
            }
        }
        let distance = sector.distance(NEAR << (self.highest.len() - 1));
        for (bound, low) in bounds.iter_mut().zip(low) {
            *bound = bound.max((top - low) / distance);
        }
        bounds
    }

    /// Raises the values of a row to those of the blocks so many columns and rows on.
    fn raise(&self, row: &mut [f32], values: &[f32], at: usize, [x, y]: [isize; 2]) {
        let wrap = |at: usize, by: isize, size: usize| {
            (at as isize + by).rem_euclid(size as isize) as usize
        };
        let others = &values[wrap(at, y, self.rows) * self.columns..][..self.columns];
        let (first, rest) = others.split_at(wrap(0, x, self.columns));
        let (before, after) = row.split_at_mut(rest.len());
        // One instruction, where `max` minds numbers that are none.
        let raise = |(value, other): (&mut f32, &f32)| {
            *value = if *other > *value { *other } else { *value };
        };
        before.iter_mut().zip(rest).for_each(raise);
        after.iter_mut().zip(first).for_each(raise);
    }
}

fn mix(a: f32, b: f32, share: f32) -> f32 {
    a + (b - a) * share
}

/// One value for each square of `side` × `side`, in rows of `columns`.
fn join(values: &[f32], columns: usize, side: usize, find: fn(f32, f32) -> f32) -> Vec<f32> {
    let squares = values.par_chunks(columns * side).flat_map_iter(|rows| {
        (0..columns / side).map(move |i| {
            let within = |row: &[f32]| row[i * side..][..side].iter().copied().reduce(find);
            let all = rows.chunks(columns).filter_map(within).reduce(find);
            all.unwrap_or_default()
        })
    });
    squares.collect()
}

/// Maxima over windows of twice the side.
fn doubled(values: &[f32], columns: usize, side: usize) -> Vec<f32> {
    let rows = values.len() / columns;
    let at = |i: usize, j: usize| values[j % rows * columns + i % columns];
    (0..values.len())
        .into_par_iter()
        .map(|k| {
            let (i, j) = (k % columns, k / columns);
            let upper = at(i, j).max(at(i + side, j));
            upper.max(at(i, j + side).max(at(i + side, j + side)))
        })
        .collect()
}

/// Directions (a, t a), a along the main axis and `from` <= t <= `to`.
struct Sector {
    signs: [isize; 2],
    /// Whether the main axis is y.
    steep: bool,
    from: f32,
    to: f32,
    /// Lengths of the two directions.
    lengths: [f32; 2],
}

impl Sector {
    fn new(sector: usize) -> Self {
        let bit = |i: usize| sector >> i & 1 == 1;
        let sign = |i| if bit(i) { -1 } else { 1 };
        let middle = FRAC_PI_8.tan();
        let (from, to) = if bit(3) { (middle, 1.0) } else { (0.0, middle) };
        Self {
            signs: [sign(0), sign(1)],
            steep: bit(2),
            from,
            to,
            lengths: [from, to].map(|t| t.hypot(1.0)),
        }
    }

    /// The steepest rise of a cell in these directions.
    fn steepest(&self, &[upper, lower, left, right]: &[f32; 4]) -> f32 {
        let slopes = [(upper, left), (upper, right), (lower, left), (lower, right)];
        let rise = |(x, y): (f32, f32)| {
            let [x, y] = [x * self.signs[0] as f32, y * self.signs[1] as f32];
            let (main, other) = if self.steep { (y, x) } else { (x, y) };
            if main > 0.0 && (self.from * main..=self.to * main).contains(&other) {
                let squares = [main, other].map(|s| f64::from(s) * f64::from(s));
                return (squares[0] + squares[1]).sqrt() as f32;
            }
            let [first, last] = self.lengths;
            ((main + self.from * other) / first).max((main + self.to * other) / last)
        };
        slopes
            .into_iter()
            .map(rise)
            .fold(f32::NEG_INFINITY, f32::max)
    }

    /// The least distance from a block to those k to the side of it.
    fn distance(&self, k: usize) -> f32 {
        k.saturating_sub(1) as f32 * self.lengths[0]
    }

    /// Rows of blocks, along the other axis, that ways reach over columns k to k + side - 1.
    fn across(&self, k: usize, side: usize) -> Range<usize> {
        let first = (self.from * k.saturating_sub(1) as f32).floor();
        let end = (1.0 + self.to * (k + side) as f32).ceil();
        first as usize..end as usize
    }

    /// Where the window of that side begins whose blocks nearest along both axes are these.
    fn window(&self, main: usize, other: usize, side: usize) -> [isize; 2] {
        let begin = |by: usize, sign: isize| match sign {
            1 => by as isize,
            _ => 1 - (by + side) as isize,
        };
        let (x, y) = if self.steep {
            (other, main)
        } else {
            (main, other)
        };
        [begin(x, self.signs[0]), begin(y, self.signs[1])]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::math::sampling::Random;

    fn map(width: u32, height: u32, value: impl Fn(f64, f64) -> f64) -> HeightMap {
        let values = (0..width * height)
            .map(|k| value(f64::from(k % width), f64::from(k / width)) as f32)
            .collect();
        HeightMap {
            path: "map".into(),
            width,
            height,
            values,
        }
    }

    /// Height at a place counted in texels from the centre of texel (0, 0), rows down.
    fn height(map: &HeightMap, at: DVec2) -> f64 {
        let size = DVec2::new(f64::from(map.width), f64::from(map.height));
        map.sample((at.x + 0.5) / size.x, 1.0 - (at.y + 0.5) / size.y)
    }

    fn sector(way: DVec2) -> usize {
        let (x, y) = (way.x.abs(), way.y.abs());
        let bits = [
            way.x < 0.0,
            way.y < 0.0,
            y > x,
            x.min(y) > f64::from(FRAC_PI_8).tan() * x.max(y),
        ];
        bits.iter()
            .rev()
            .fold(0, |sum, &bit| 2 * sum + usize::from(bit))
    }

    /// At random places in random directions no surface rises above the bound. On average bounds
    /// are 1.6 to 2.1 times what is seen.
    #[test]
    fn nothing_rises_above_the_horizon() {
        let noise = |x: f64, y: f64| Random::new(7, x as u64, y as u64).unit();
        let wave = |x: f64, y: f64| (x * 0.39).sin() * (y * 0.26).cos();
        let step = |x: f64, _: f64| if x < 5.0 { 3.0 } else { 0.0 };
        let maps = [
            (map(48, 48, wave), 2.4),
            (map(24, 5, noise), 2.4),
            (map(640, 480, wave), 3.2),
            (map(1, 9, noise), 2.6),
            (map(13, 11, step), 2.2),
        ];
        for (map, most) in maps {
            let horizons = Horizons::new(&map);
            assert!(horizons.columns > 1 || horizons.rows > 1);
            let per_texel = f64::from(horizons.rows) / f64::from(map.height);
            let (mut bound_sum, mut seen_sum) = (0.0, 0.0);
            let mut random = Random::new(1, 2, 3);
            for _ in 0..2000 {
                let at = DVec2::new(
                    random.unit() * f64::from(map.width),
                    random.unit() * f64::from(map.height),
                );
                let angle = random.unit() * std::f64::consts::TAU;
                let way = DVec2::new(angle.cos(), angle.sin());
                let block = at * per_texel;
                let place = block.y as usize * horizons.columns as usize + block.x as usize;
                let steps = horizons.bounds[place][sector(way)];
                assert_ne!(u32::from(steps), HORIZON_UNKNOWN);
                let bound = f64::from(steps) * f64::from(horizons.step);
                let from = height(&map, at);
                let seen = (1..400)
                    .map(|k| 0.002 * 1.03_f64.powi(k))
                    .map(|r| (height(&map, at + r * way) - from) / r)
                    .fold(0.0, f64::max);
                assert!(
                    seen <= bound + 1e-3,
                    "{}x{} at {at} along {way}: {seen} > {bound}",
                    map.width,
                    map.height
                );
                bound_sum += bound;
                seen_sum += seen;
            }
            assert!(bound_sum <= most * seen_sum, "{}", bound_sum / seen_sum);
        }
    }
}
