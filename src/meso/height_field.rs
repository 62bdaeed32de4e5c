//! One tile of relief as a periodic triangulated surface.

use glam::{DVec2, DVec3};

use crate::scene::{HeightMap, Material};

/// Most points of the grid: 65,536 facets. A larger map is averaged down.
const MOST_POINTS: u32 = 1 << 15;
/// Most along a side of it.
const MOST_ALONG: u32 = 256;

/// Heights at the points of a periodic grid and the facets between them, mean height 0. Lengths are
/// in widths of a cell: the effect of a relief on light does not depend on its scale.
///
/// Point (i, j) stands at x = i along u and y = j · aspect along v. The cell above it has two
/// facets, cut along the diagonal from (i + 1, j) to (i, j + 1): `2 · (j · columns + i)` below the
/// diagonal, and one more above it.
#[derive(Debug, Clone, PartialEq)]
pub struct HeightField {
    pub columns: u32,
    pub rows: u32,
    /// Height of a cell over its width.
    pub aspect: f64,
    /// `[row][column]`, rows along v.
    pub heights: Vec<f32>,
}

/// A triangle of the surface.
#[derive(Debug, Clone, Copy)]
pub struct Facet {
    /// x and y in cells, z in widths of a cell.
    pub centre: DVec3,
    pub normal: DVec3,
    pub area: f64,
}

impl HeightField {
    /// The relief of a material on a surface where a repeat of the texture is `tile` scene units
    /// wide and high. None for a material without relief.
    pub fn new(material: &Material, tile: DVec2) -> Option<Self> {
        let map = material
            .map_height
            .as_deref()
            .filter(|_| material.has_relief())?;
        let [columns, rows] = points([map.width, map.height], tile);
        let mean = map.mean();
        let cell = tile / DVec2::new(f64::from(columns), f64::from(rows));
        let scale = f64::from(material.height_scale) / cell.x;
        let heights = (0..rows)
            .flat_map(|j| (0..columns).map(move |i| (i, j)))
            .map(|(i, j)| (scale * (average(map, columns, rows, i, j) - mean)) as f32)
            .collect();
        Some(Self {
            columns,
            rows,
            aspect: cell.y / cell.x,
            heights,
        })
    }

    pub fn facet_count(&self) -> usize {
        2 * (self.columns * self.rows) as usize
    }

    /// Height at a point of the grid; it repeats.
    pub fn point(&self, i: i64, j: i64) -> f64 {
        let column = i.rem_euclid(i64::from(self.columns)) as usize;
        let row = j.rem_euclid(i64::from(self.rows)) as usize;
        f64::from(self.heights[row * self.columns as usize + column])
    }

    /// Height of the surface at a place in cells.
    pub fn height(&self, at: DVec2) -> f64 {
        let low = at.floor();
        let (i, j) = (low.x as i64, low.y as i64);
        let f = at - low;
        let (right, up) = (self.point(i + 1, j), self.point(i, j + 1));
        if f.x + f.y <= 1.0 {
            let corner = self.point(i, j);
            corner + f.x * (right - corner) + f.y * (up - corner)
        } else {
            let corner = self.point(i + 1, j + 1);
            corner + (1.0 - f.x) * (up - corner) + (1.0 - f.y) * (right - corner)
        }
    }

    pub fn facet(&self, facet: usize) -> Facet {
        let cell = (facet / 2) as i64;
        let (i, j) = (
            cell % i64::from(self.columns),
            cell / i64::from(self.columns),
        );
        let (right, up) = (self.point(i + 1, j), self.point(i, j + 1));
        let (corner, share, slope) = if facet.is_multiple_of(2) {
            let corner = self.point(i, j);
            (corner, 1.0 / 3.0, [right - corner, up - corner])
        } else {
            let corner = self.point(i + 1, j + 1);
            (corner, 2.0 / 3.0, [corner - up, corner - right])
        };
        let upward = DVec3::new(-slope[0], -slope[1] / self.aspect, 1.0);
        Facet {
            centre: DVec3::new(
                i as f64 + share,
                j as f64 + share,
                (corner + right + up) / 3.0,
            ),
            normal: upward.normalize(),
            area: 0.5 * self.aspect * upward.length(),
        }
    }

    pub fn highest(&self) -> f64 {
        self.heights
            .iter()
            .map(|&h| f64::from(h))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    /// Sine of the angle of the steepest facet.
    pub fn steepest(&self) -> f64 {
        (0..self.facet_count())
            .map(|q| self.facet(q).normal)
            .map(|n| (1.0 - n.z * n.z).max(0.0).sqrt())
            .fold(0.0, f64::max)
    }

    /// Root mean square of the slope over the tile.
    pub fn rms_slope(&self) -> f64 {
        let sum: f64 = (0..self.facet_count())
            .map(|q| self.facet(q).normal)
            .map(|n| (1.0 - n.z * n.z) / (n.z * n.z))
            .sum();
        (sum / self.facet_count() as f64).sqrt()
    }
}

/// Points along the sides of the grid of a map of so many texels on a tile of that size: one for
/// each texel, or for as few as make them fit, averaged first where they lie closer together.
fn points(texels: [u32; 2], tile: DVec2) -> [u32; 2] {
    let mut each = texels.map(|side| side.div_ceil(MOST_ALONG));
    loop {
        let points = [0, 1].map(|axis| texels[axis] / each[axis]);
        if points[0] * points[1] <= MOST_POINTS {
            return points;
        }
        let width = |axis: usize| tile[axis] / f64::from(points[axis]);
        each[usize::from(width(1) < width(0))] += 1;
    }
}

/// Mean of the texels of point (i, j), rows counted from the bottom.
fn average(map: &HeightMap, columns: u32, rows: u32, i: u32, j: u32) -> f64 {
    let range = |at: u32, points: u32, size: u32| {
        let edge = |at: u32| (u64::from(at) * u64::from(size) / u64::from(points)) as u32;
        edge(at)..edge(at + 1)
    };
    let mut sum = 0.0;
    let mut count = 0;
    for row in range(rows - 1 - j, rows, map.height) {
        for column in range(i, columns, map.width) {
            sum += f64::from(map.values[(row * map.width + column) as usize]);
            count += 1;
        }
    }
    sum / f64::from(count)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A map that fits has a point for each texel; of another, as many are averaged along both
    /// sides of its cells as keep these square.
    #[test]
    fn large_maps_are_averaged_down() {
        let square = DVec2::ONE;
        for (texels, tile, expected) in [
            ([64, 64], square, [64, 64]),
            ([256, 128], DVec2::new(2.0, 1.0), [256, 128]),
            ([256, 128], square, [256, 128]),
            ([512, 8], square, [256, 8]),
            ([256, 256], square, [128, 256]),
            ([256, 256], DVec2::new(2.0, 1.0), [256, 128]),
            ([300, 200], DVec2::new(3.0, 2.0), [150, 200]),
            ([512, 512], square, [170, 170]),
            ([4096, 4096], square, [178, 178]),
            ([16384, 1], square, [256, 1]),
        ] {
            assert_eq!(points(texels, tile), expected, "{texels:?} on {tile}");
        }
    }
}
