//! Height maps made by code: tiles that repeat without a seam.
//!
//! Nothing but sums, products and square roots is used, so that every machine gives the same texels.

use crate::scene::HeightMap;

/// Texels along a side of the maps of the built-in scenes.
pub const SIZE: u32 = 64;

/// Overlapping round dents with softened ridges between them.
pub fn hammered_metal(size: u32) -> HeightMap {
    let dents = Points::new(4, 0.7, 0x68_61_6d);
    tile("hammered-metal.png", size, |u, v| {
        let [nearest, second] = dents.nearest(u, v);
        // Bowls are square in the distance; where two meet, the ridge is rounded off.
        smooth_min(nearest * nearest, second * second, 0.25)
    })
}

/// A smooth skin with pores, wavy between them.
pub fn orange_peel(size: u32) -> HeightMap {
    let pores = Points::new(5, 0.55, 0x6f_72_61);
    let waves = Points::new(3, 0.8, 0x70_65_65);
    tile("orange-peel.png", size, |u, v| {
        let [pore, _] = pores.nearest(u, v);
        let [wave, _] = waves.nearest(u, v);
        0.35 * bump(wave / 0.9) - bump(pore / 0.55)
    })
}

/// Plain knitting: columns of stitches, each a V of two strands.
pub fn knit(size: u32) -> HeightMap {
    const WALES: f64 = 3.0;
    const COURSES: f64 = 4.0;
    /// Courses that a strand climbs from the middle of a stitch to its side.
    const CLIMB: f64 = 0.9;
    tile("knit.png", size, |u, v| {
        let across = 2.0 * (u * WALES).fract() - 1.0;
        let along = (v * COURSES - CLIMB * across.abs()).rem_euclid(1.0);
        arch(across.abs()) * (0.35 + 0.65 * arch(along))
    })
}

/// Bricks in running bond, rounded at the edges, with deeper mortar.
pub fn brick(size: u32) -> HeightMap {
    const BRICKS: f64 = 2.0;
    const COURSES: f64 = 4.0;
    /// From the joint's middle to the brick's full height, over the height of a course.
    const EDGE: f64 = 0.3;
    tile("brick.png", size, |u, v| {
        let course = (v * COURSES).floor();
        let along = (u * BRICKS + 0.5 * (course % 2.0)).fract();
        let up = (v * COURSES).fract();
        let to_end = along.min(1.0 - along) * COURSES / BRICKS;
        let to_bed = up.min(1.0 - up);
        step(to_end / EDGE) * step(to_bed / EDGE)
    })
}

/// Heights of a tile, u and v up in 0..1 at the centres of the texels, brought to the codes 0 to 65535.
fn tile(name: &str, size: u32, height: impl Fn(f64, f64) -> f64) -> HeightMap {
    let at = |texel: u32| (f64::from(texel) + 0.5) / f64::from(size);
    let heights: Vec<f64> = (0..size)
        .flat_map(|row| (0..size).map(move |column| (column, row)))
        .map(|(column, row)| height(at(column), at(size - 1 - row)))
        .collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let scale = 65_535.0 / (high - low).max(f64::MIN_POSITIVE);
    HeightMap {
        path: name.into(),
        width: size,
        height: size,
        values: heights
            .iter()
            // An image of 16 bits holds these values exactly.
            .map(|h| ((h - low) * scale).round() as u16)
            .map(|code| f32::from(code) / 65_535.0)
            .collect(),
    }
}

/// One at 0, zero from 1 on, smooth.
fn bump(x: f64) -> f64 {
    let rest = (1.0 - x * x).max(0.0);
    rest * rest
}

/// Zero at 0 and 1, one in the middle.
fn arch(x: f64) -> f64 {
    4.0 * x * (1.0 - x)
}

/// From 0 at 0 to 1 from 1 on, smooth.
fn step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Polynomial smooth minimum, Quilez.
fn smooth_min(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - h * h * width / 4.0
}

/// Points scattered over the tile, one in each cell of a coarse grid; they repeat with it.
struct Points {
    cells: i64,
    /// `[row][column]`, in cells.
    places: Vec<[f64; 2]>,
}

impl Points {
    /// `jitter`: how far of a cell a point may be moved.
    fn new(cells: i64, jitter: f64, seed: u64) -> Self {
        let mut state = seed;
        let mut random = || {
            // SplitMix64 (Steele et al. 2014).
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let places = (0..cells)
            .flat_map(|row| (0..cells).map(move |column| [column, row]))
            .map(|cell| cell.map(|c| c as f64 + 0.5 + jitter * (random() - 0.5)))
            .collect();
        Self { cells, places }
    }

    /// Distances to the nearest two points, in cells.
    fn nearest(&self, u: f64, v: f64) -> [f64; 2] {
        let at = [u, v].map(|c| c * self.cells as f64);
        let mut nearest = [f64::INFINITY; 2];
        for place in &self.places {
            let mut squared = 0.0;
            for k in 0..2 {
                let apart = (at[k] - place[k]).abs();
                let around = apart.min(self.cells as f64 - apart);
                squared += around * around;
            }
            let distance = squared.sqrt();
            if distance < nearest[0] {
                nearest = [distance, nearest[0]];
            } else if distance < nearest[1] {
                nearest[1] = distance;
            }
        }
        nearest
    }
}
