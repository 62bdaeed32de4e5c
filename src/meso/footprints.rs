//! The part of a tile that each element shows, where a repeat of the texture is larger than the
//! element.
//!
//! Elements that show the same texels share a footprint, in any repeat of the texture. Where a tile
//! has more footprints than it may have responses, those whose middles lie in one cell of a grid
//! are merged.

use std::collections::BTreeMap;

use glam::{DVec2, Vec3};

use super::{Facet, HeightField};
use crate::constants::NONE;

/// Corners of texture coordinates this close, in repeats, are the same place.
const SAME: f64 = 1.0 / 4096.0;
/// Samples per texel along a side of a triangle, and most samples along a side.
const SAMPLES: f64 = 2.0;
const MOST_SAMPLES: u32 = 256;
/// Largest mean overlap of the footprints of one tile, which bounds the work for their responses.
const MOST_OVERLAP: f64 = 8.0;

/// The footprints of a tile's elements.
#[derive(Debug, Clone)]
pub struct Footprints {
    /// Footprint of each element given, `[element given]`; NONE for one that shows a whole tile or
    /// more.
    pub of: Vec<u32>,
    /// `[footprint]`.
    cells: Vec<Cells>,
    /// Footprints over each cell of the height field, `[row · columns + column]`, with their
    /// density: that of each footprint has the mean 1 over the tile.
    pub(super) over: Vec<Vec<(u32, f32)>>,
    size: [u32; 2],
    aspect: f64,
}

/// Cells with the share of the footprint that lies in each; the shares sum to 1.
type Cells = BTreeMap<u32, f64>;

impl Footprints {
    /// The footprints of triangles with these texture coordinates, `[triangle][corner]`: at most
    /// `most`, and at least one where a triangle is smaller than the tile.
    pub fn new(field: &HeightField, triangles: &[[DVec2; 3]], most: usize) -> Self {
        let most = most.max(1);
        let mut kinds: BTreeMap<Vec<[i64; 2]>, u32> = BTreeMap::new();
        let mut shapes: Vec<[DVec2; 3]> = Vec::new();
        let mut weights: Vec<f64> = Vec::new();
        let mut of: Vec<u32> = triangles
            .iter()
            .map(|uv| {
                let area = area(uv);
                if area >= 1.0 || !area.is_finite() {
                    return NONE;
                }
                let home = (middle(uv) + SAME).floor();
                let shape = uv.map(|p| p - home);
                let mut key: Vec<[i64; 2]> = shape
                    .iter()
                    .map(|p| (*p / SAME).round().to_array().map(|x| x as i64))
                    .collect();
                key.sort_unstable();
                let kind = *kinds.entry(key).or_insert(shapes.len() as u32);
                if kind as usize == shapes.len() {
                    shapes.push(shape);
                    weights.push(0.0);
                }
                weights[kind as usize] += area;
                kind
            })
            .collect();
        let whole: Vec<Cells> = shapes.iter().map(|shape| covered(field, shape)).collect();
        let mut footprints = Self {
            of: Vec::new(),
            cells: Vec::new(),
            over: Vec::new(),
            size: [field.columns, field.rows],
            aspect: field.aspect,
        };
        // Each shape by itself if they are few, else merged by coarser and coarser grids; the last
        // merges all.
        let mut side = usize::MAX;
        loop {
            let class = if side == usize::MAX {
                (0..shapes.len() as u32).collect()
            } else {
                by_grid(&shapes, side)
            };
            let count = class.iter().max().map_or(0, |&c| c as usize + 1);
            if count <= most {
                footprints.cells = joined(&class, count, &whole, &weights);
                if side == 1 || footprints.overlap() <= MOST_OVERLAP {
                    for kind in of.iter_mut().filter(|kind| **kind != NONE) {
                        *kind = class[*kind as usize];
                    }
                    break;
                }
            }
            side = match side {
                usize::MAX => most.isqrt().max(1),
                side => (side / 2).max(1),
            };
        }
        footprints.of = of;
        let cells = (field.columns * field.rows) as usize;
        footprints.over = vec![Vec::new(); cells];
        for (footprint, shares) in (0_u32..).zip(&footprints.cells) {
            for (&cell, &share) in shares {
                let density = (share * cells as f64) as f32;
                footprints.over[cell as usize].push((footprint, density));
            }
        }
        footprints
    }

    pub fn count(&self) -> usize {
        self.cells.len()
    }

    /// The cell of the mesh's plane through which a facet is seen from a direction whose tangents
    /// to the normal, along u and v in widths of a cell, are `slope`.
    pub(crate) fn window(&self, facet: &Facet, slope: DVec2) -> usize {
        let at = |place: f64, size: u32| {
            let cut = place as i32;
            (cut - i32::from(place < f64::from(cut))).rem_euclid(size as i32)
        };
        let x = facet.centre.x - facet.centre.z * slope.x;
        let y = facet.centre.y - facet.centre.z * slope.y / self.aspect;
        let [columns, rows] = self.size;
        at(y, rows) as usize * columns as usize + at(x, columns) as usize
    }

    /// Shares of the facets in a footprint projected to the mesh's plane, `[facet]`; they sum to 1.
    pub fn shares(&self, footprint: usize) -> Vec<f32> {
        let mut shares = vec![0.0; 2 * self.over.len()];
        for (&cell, &share) in &self.cells[footprint] {
            let facets = &mut shares[2 * cell as usize..][..2];
            facets.fill((0.5 * share) as f32);
        }
        shares
    }

    /// Mean over a footprint of the facets' `values`, `[facet]`.
    pub(crate) fn mean(&self, footprint: usize, of_facet: &[Vec3]) -> Vec3 {
        self.cells[footprint]
            .iter()
            .map(|(&cell, &share)| {
                let of_cell = &of_facet[2 * cell as usize..][..2];
                (of_cell[0] + of_cell[1]) * (0.5 * share) as f32
            })
            .sum()
    }

    /// Mean number of footprints over a cell.
    fn overlap(&self) -> f64 {
        let covered: usize = self.cells.iter().map(BTreeMap::len).sum();
        covered as f64 / f64::from(self.size[0] * self.size[1])
    }
}

fn middle(uv: &[DVec2; 3]) -> DVec2 {
    (uv[0] + uv[1] + uv[2]) / 3.0
}

fn area(uv: &[DVec2; 3]) -> f64 {
    0.5 * (uv[1] - uv[0]).perp_dot(uv[2] - uv[0]).abs()
}

/// The cells that a triangle covers, by samples at the centroids of equal parts of it.
fn covered(field: &HeightField, uv: &[DVec2; 3]) -> Cells {
    let size = DVec2::new(f64::from(field.columns), f64::from(field.rows));
    // A point of the field is the middle of its texel.
    let [a, b, c] = uv.map(|p| p * size - 0.5);
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    let parts = ((SAMPLES * longest).ceil() as u32).clamp(2, MOST_SAMPLES);
    let share = 1.0 / f64::from(parts * parts);
    let mut cells = Cells::new();
    for i in 0..parts {
        for j in 0..parts - i {
            // The upright part at (i, j), and the inverted one beside it.
            for (third, exists) in [(1.0 / 3.0, true), (2.0 / 3.0, i + j + 1 < parts)] {
                if exists {
                    let s = (f64::from(i) + third) / f64::from(parts);
                    let t = (f64::from(j) + third) / f64::from(parts);
                    let at = (a + (b - a) * s + (c - a) * t).floor();
                    let column = (at.x as i64).rem_euclid(i64::from(field.columns));
                    let row = (at.y as i64).rem_euclid(i64::from(field.rows));
                    let cell = row * i64::from(field.columns) + column;
                    *cells.entry(cell as u32).or_insert(0.0) += share;
                }
            }
        }
    }
    cells
}

/// Numbers of the grid cells that contain the middles of the shapes, counted without empty cells.
fn by_grid(shapes: &[[DVec2; 3]], side: usize) -> Vec<u32> {
    let mut numbers: BTreeMap<[i64; 2], u32> = BTreeMap::new();
    shapes
        .iter()
        .map(|shape| {
            let at = ((middle(shape) - middle(shape).floor()) * side as f64).floor();
            let next = numbers.len() as u32;
            *numbers.entry([at.x as i64, at.y as i64]).or_insert(next)
        })
        .collect()
}

/// The footprints of classes of shapes, weighted by the area of each shape.
fn joined(class: &[u32], count: usize, shapes: &[Cells], weights: &[f64]) -> Vec<Cells> {
    let mut whole = vec![0.0; count];
    for (&class, weight) in class.iter().zip(weights) {
        whole[class as usize] += weight;
    }
    let mut cells = vec![Cells::new(); count];
    for ((&class, shape), weight) in class.iter().zip(shapes).zip(weights) {
        for (&cell, share) in shape {
            *cells[class as usize].entry(cell).or_insert(0.0) +=
                share * weight / whole[class as usize];
        }
    }
    cells
}
