//! A height map's maxima over larger and larger blocks, with which a ray skips blocks that it
//! cannot hit.

use std::iter::successors;

use super::factors::CORNERS;
use crate::scene::HeightMap;

/// The texels of a periodic height map and the maxima of its bilinear surface, level by level, for
/// `shaders/shared/height_march.glsl`.
///
/// Cell (i, j) lies between the centres of the texels (i, j), (i + 1, j), (i, j + 1) and
/// (i + 1, j + 1), each index modulo the map's size, so that a period has as many cells as texels.
/// A bilinear surface is highest in a corner: level 0 is the greatest of the four texels. Level n
/// holds the maxima over blocks of 2ⁿ × 2ⁿ cells, counted from cell (0, 0); the last block of a row
/// or column ends at the period's border and may be smaller. The last level is one block.
///
/// A maximum is one of the stored f32 values, so that no bound is rounded down.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightPyramid {
    /// Texels.
    pub width: u32,
    pub height: u32,
    /// The highest texel.
    pub highest: f32,
    /// `[row][column][corner]` of the cells, heights in the map's units, rows from the top, corners
    /// in the order above; then `[level][row][column]` of the maxima; then zeros, to whole fours.
    pub values: Vec<f32>,
    /// Where each level starts in `values`.
    pub offsets: Vec<usize>,
}

impl HeightPyramid {
    pub fn new(map: &HeightMap) -> Self {
        let (width, height) = (map.width as usize, map.height as usize);
        assert!(
            width * height > 0 && map.values.len() == width * height,
            "a height map has a value for each of its texels"
        );
        let texel = |column: usize, row: usize| map.values[row % height * width + column % width];
        let mut values: Vec<f32> = (0..height)
            .flat_map(|row| (0..width).map(move |column| (column, row)))
            .flat_map(|(i, j)| [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)])
            .map(|(i, j)| texel(i, j))
            .collect();
        let highest = |corners: &[f32]| corners.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        let maxima: Vec<f32> = values.chunks_exact(CORNERS).map(highest).collect();
        values.extend(maxima);
        let sizes: Vec<_> = successors(Some((width, height)), |&(columns, rows)| {
            (columns.max(rows) > 1).then(|| (columns.div_ceil(2), rows.div_ceil(2)))
        })
        .collect();
        let mut offsets = vec![CORNERS * width * height];
        for pair in sizes.windows(2) {
            let [(columns, rows), (next_columns, next_rows)] = [pair[0], pair[1]];
            let from = offsets[offsets.len() - 1];
            offsets.push(values.len());
            for row in 0..next_rows {
                for column in 0..next_columns {
                    let highest = (2 * row..rows.min(2 * row + 2))
                        .flat_map(|j| {
                            (2 * column..columns.min(2 * column + 2)).map(move |i| (i, j))
                        })
                        .map(|(i, j)| values[from + j * columns + i])
                        .fold(f32::NEG_INFINITY, f32::max);
                    values.push(highest);
                }
            }
        }
        let highest = values[values.len() - 1];
        values.resize(values.len().next_multiple_of(CORNERS), 0.0);
        Self {
            width: map.width,
            height: map.height,
            highest,
            values,
            offsets,
        }
    }

    /// The level of one block.
    pub fn top(&self) -> u32 {
        self.offsets.len() as u32 - 1
    }

    /// Columns and rows of blocks at a level.
    pub fn blocks(&self, level: u32) -> (u32, u32) {
        let side = 1 << level;
        (self.width.div_ceil(side), self.height.div_ceil(side))
    }
}
