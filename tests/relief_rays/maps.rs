//! Height maps that rays are sent over.

use mesolux::scene::HeightMap;

use crate::common::random::Random;

pub fn map(width: u32, height: u32, value: impl Fn(u32, u32) -> f32) -> HeightMap {
    HeightMap {
        path: "test".into(),
        width,
        height,
        values: (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .map(|(column, row)| value(column, row))
            .collect(),
    }
}

/// A running bond of bricks with flat tops; the mortar lies deep, and its flanks are one texel
/// wide.
pub fn bricks() -> HeightMap {
    map(256, 256, |column, row| {
        let course = row / 32;
        let along = (column + 32 * (course % 2)) % 64;
        if row % 32 < 4 || along < 4 { 0.0 } else { 1.0 }
    })
}

/// Value noise in five octaves.
pub fn noise() -> HeightMap {
    let lattice = |octave: u32, i: u32, j: u32| {
        Random(u64::from(octave) << 40 | u64::from(i) << 20 | u64::from(j)).unit()
    };
    map(320, 192, |column, row| {
        let mut sum = 0.0;
        for octave in 0..5 {
            // The coarsest lattice has 5 × 3 knots.
            let size = 64 >> octave;
            let (i, j) = (column / size, row / size);
            let (columns, rows) = (320 / size, 192 / size);
            let smooth = |at: u32| {
                let f = f64::from(at % size) / f64::from(size);
                f * f * (3.0 - 2.0 * f)
            };
            let (x, y) = (smooth(column), smooth(row));
            let knot = |di, dj| lattice(octave, (i + di) % columns, (j + dj) % rows);
            let upper = knot(0, 0) + x * (knot(1, 0) - knot(0, 0));
            let lower = knot(0, 1) + x * (knot(1, 1) - knot(0, 1));
            sum += 0.5_f64.powi(octave as i32 + 1) * (upper + y * (lower - upper));
        }
        sum as f32
    })
}

/// Ridges one texel wide: across, along and slanting.
pub fn ridges() -> HeightMap {
    map(301, 211, |column, row| {
        if column % 43 == 7 || row % 37 == 11 || (column + 2 * row) % 101 == 5 {
            1.0
        } else {
            0.0
        }
    })
}

pub const ODD_SIZES: [(u32, u32); 9] = [
    (1, 1),
    (1, 5),
    (6, 1),
    (2, 2),
    (3, 2),
    (7, 13),
    (16, 4),
    (17, 33),
    (5, 64),
];

pub fn rough((width, height): (u32, u32), random: &mut Random) -> HeightMap {
    let values: Vec<_> = (0..width * height).map(|_| random.unit() as f32).collect();
    map(width, height, |column, row| {
        values[(row * width + column) as usize]
    })
}
