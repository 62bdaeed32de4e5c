//! Which of a view's triangles or prisms a tile may show: those of blocks that reach into it.

use std::ops::Range;

use glam::Vec3;
use rayon::prelude::*;

use super::Cuts;
use crate::picture::{Projection, Tile};

/// Triangles or prisms of a block.
const BLOCK: usize = 64;

/// Pixels by which a tile is taken to be larger: more than an edge is moved by rounding.
const MARGIN: f64 = 1.0;

/// Blocks of consecutive triangles or prisms, and how far each reaches in the picture.
pub struct Blocks(Vec<Reach>);

/// Part of a picture, in pixels from its left top corner: from `low` to `high`.
#[derive(Debug, Clone, Copy)]
struct Reach {
    low: [f64; 2],
    high: [f64; 2],
}

impl Blocks {
    /// Of items with so many corners each; `corners` from the eye, internal units.
    pub fn new(projection: &Projection, corners: &[Vec3], of_item: usize) -> Self {
        let reach = |corners: &[Vec3]| {
            let mut reach = Reach {
                low: [f64::INFINITY; 2],
                high: [f64::NEG_INFINITY; 2],
            };
            for item in corners.chunks(of_item) {
                reach.add(projection, item);
            }
            reach
        };
        Self(corners.par_chunks(BLOCK * of_item).map(reach).collect())
    }

    /// Of a range of items, runs of those that a tile may show.
    pub fn shown(&self, items: Range<u32>, tile: Tile, cuts: Cuts) -> Vec<Range<u32>> {
        if !cuts.by_tile {
            return vec![items];
        }
        let mut runs: Vec<Range<u32>> = Vec::new();
        let mut first = items.start;
        while first < items.end {
            let block = first as usize / BLOCK;
            let end = (((block + 1) * BLOCK) as u32).min(items.end);
            if self.0[block].meets(tile) {
                match runs.last_mut() {
                    Some(last) if last.end == first => last.end = end,
                    _ => runs.push(first..end),
                }
            }
            first = end;
        }
        runs
    }

    /// Items of some ranges that a tile draws, and all.
    pub fn drawn<'a>(
        &self,
        ranges: impl Iterator<Item = &'a Range<u32>>,
        tile: Tile,
        cuts: Cuts,
    ) -> [usize; 2] {
        let mut counts = [0; 2];
        for range in ranges {
            let runs = self.shown(range.clone(), tile, cuts);
            counts[0] += runs.iter().map(Range::len).sum::<usize>();
            counts[1] += range.len();
        }
        counts
    }
}

impl Reach {
    /// Of the hull of some corners too.
    fn add(&mut self, projection: &Projection, corners: &[Vec3]) {
        let places = corners.iter().map(|&corner| projection.place(corner));
        let (mut before, mut behind) = (0, 0);
        let mut own = *self;
        for place in places {
            match place {
                Some(place) => {
                    before += 1;
                    for (axis, at) in place.into_iter().enumerate() {
                        own.low[axis] = own.low[axis].min(at);
                        own.high[axis] = own.high[axis].max(at);
                    }
                }
                None => behind += 1,
            }
        }
        match (before, behind) {
            (_, 0) => *self = own,
            // All of it lies behind the near plane.
            (0, _) => {}
            _ => {
                self.low = [f64::NEG_INFINITY; 2];
                self.high = [f64::INFINITY; 2];
            }
        }
    }

    fn meets(self, tile: Tile) -> bool {
        let first = [tile.column, tile.row].map(f64::from);
        let size = [tile.width, tile.height].map(f64::from);
        (0..2).all(|axis| {
            self.low[axis] <= first[axis] + size[axis] + MARGIN
                && self.high[axis] >= first[axis] - MARGIN
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::math::form_factor::spread_in_triangle;
    use crate::math::sampling::Random;
    use crate::picture::tests::seen_from;

    /// Every place that a tile shows is of a triangle that it draws; most tiles draw few.
    #[test]
    fn a_tile_draws_what_it_shows() {
        let (width, height) = (160, 90);
        let projection = seen_from(DVec3::new(0.3, 0.2, 0.8), (width, height));
        let mut random = Random::new(1, 0, 0);
        let mut next = || random.unit() as f32 - 0.5;
        // Each block is of one triangle, so that no other one reaches where it does. Many cross the
        // plane of the eye.
        let mut corners = Vec::new();
        for k in 0..600 {
            let (spread, size) = if k % 2 == 0 { (3.0, 0.3) } else { (0.3, 1.0) };
            let middle = spread * Vec3::new(next(), next(), next());
            let triangle = [(); 3].map(|()| middle + size * Vec3::new(next(), next(), next()));
            corners.extend(triangle.repeat(BLOCK));
        }
        let count = corners.len() as u32 / 3;
        let blocks = Blocks::new(&projection, &corners, 3);
        let (mut drawn, mut all, mut seen) = (0, 0, 0);
        for tile in Tile::of((width, height), 20) {
            // From within a block to within another.
            let runs = blocks.shown(5..count - 7, tile, Cuts::default());
            assert!(runs.windows(2).all(|two| two[0].end < two[1].start));
            assert!(
                runs.iter()
                    .all(|run| run.start >= 5 && run.end <= count - 7)
            );
            drawn += runs.iter().map(Range::len).sum::<usize>();
            all += count as usize - 12;
            let [x, y, w] = projection.rows(tile);
            for item in (5..count - 7).step_by(BLOCK) {
                let [a, b, c] = [0, 1, 2].map(|k| corners[3 * item as usize + k]);
                for step in 0..36 {
                    let [u, v] = spread_in_triangle(step).map(|share| share as f32);
                    let place = a + u * (b - a) + v * (c - a);
                    let (x, y, w) = (x.dot(place), y.dot(place), w.dot(place));
                    if w > 0.0 && x.abs() <= w && y.abs() <= w {
                        seen += 1;
                        assert!(runs.iter().any(|run| run.contains(&item)));
                    }
                }
            }
        }
        println!("{seen} places seen, {drawn} of {all} triangles drawn");
        assert!(seen > 1000 && drawn < all / 2);
    }
}
