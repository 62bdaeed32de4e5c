//! Height maps and factors of a scene's relief in the form that the relief pass reads.

use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::Zeroable;
use glam::DVec2;
use rayon::prelude::*;

use super::factor_texels::PackedFactors;
use crate::constants::HORIZON_SECTORS;
use crate::mesh::tiles::Tile;
use crate::meso::{Factors, HeightPyramid, Horizons};
use crate::passes::types::{HeightTile, ReliefSurface};
use crate::scene::{HeightMap, Material, Scene};

/// Prisms reach beyond the relief's range by this share of it, so that every ray begins above it.
const MARGIN: f64 = 1e-3;

/// Ways to lights through a relief that rises by no more texels are followed from cell to cell: of
/// 2.5 texels that takes a frame of `cornell-relief` 4 to 8 % less time, of 10 as much as with
/// levels.
const SHORT: f64 = 4.0;

/// Heights of a relief's prisms, in the map's values with the sign of their scale.
pub struct HeightRange {
    pub lowest: f64,
    pub highest: f64,
    mean: f64,
    /// Scene units for a unit of height, positive.
    scale: f64,
}

impl HeightRange {
    fn new(map: &HeightMap, scale: f64) -> Self {
        let (low, high) = map
            .values
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
                (low.min(f64::from(v)), high.max(f64::from(v)))
            });
        let margin = MARGIN * (high - low);
        Self {
            lowest: low - margin,
            highest: high + margin,
            mean: map.mean(),
            scale,
        }
    }

    /// From the lowest to the highest, scene units.
    pub fn rise(&self) -> f64 {
        self.scale * (self.highest - self.lowest)
    }

    /// Scene units above the mesh.
    pub fn above(&self, height: f64) -> f64 {
        self.scale * (height - self.mean)
    }
}

/// Structure of arrays, `[surface]`: one surface for each tile.
#[derive(Default)]
pub struct Surfaces {
    pub list: Vec<ReliefSurface>,
    pub tiles: Vec<HeightTile>,
    pub ranges: Vec<HeightRange>,
    /// Whether a relief rises by many texels, so that ways to lights pass many of them.
    pub long_ways: bool,
    /// Sine of the steepest slope's angle: a ray that rises more steeply meets the relief only from
    /// below.
    pub steepest: Vec<f64>,
    /// Values of the tiles' pyramids, one pyramid for each material.
    pub pyramids: Vec<f32>,
    /// Bounds of the tiles' horizons, those of one material after the other's.
    pub horizons: Vec<[u8; HORIZON_SECTORS as usize]>,
    /// Texels of the factors of the surfaces, one surface after the other.
    pub factors: Vec<[u32; 4]>,
    pub packed: Vec<PackedFactors>,
}

impl Surfaces {
    /// `tiles` and `factors` are `[surface]`. Without `horizons`, every way to a light is marched.
    pub fn new(scene: &Scene, tiles: &[Tile], factors: &[Arc<Factors>], horizons: bool) -> Self {
        let mut all = Self::default();
        let mut pyramids: HashMap<u32, HeightTile> = HashMap::new();
        for (tile, factors) in tiles.iter().zip(factors) {
            let material = &scene.materials[tile.material as usize];
            let Some(map) = upward(material) else {
                continue;
            };
            let (values, bounds) = (&mut all.pyramids, &mut all.horizons);
            let height_tile = *pyramids.entry(tile.material).or_insert_with(|| {
                let pyramid = HeightPyramid::new(&map);
                let horizons = match horizons {
                    true => Horizons::new(&map),
                    false => Horizons::unknown(),
                };
                let tile = HeightTile::new(
                    (&pyramid, values.len() as u32),
                    (&horizons, bounds.len() as u32),
                );
                values.extend(&pyramid.values);
                bounds.extend(&horizons.bounds);
                tile
            });
            let range = HeightRange::new(&map, f64::from(material.height_scale.abs()));
            let mut packed = PackedFactors::new(factors);
            all.list.push(ReliefSurface {
                lowest: range.lowest as f32,
                top: range.highest as f32,
                mean: range.mean as f32,
                columns: tile.field.columns,
                rows: tile.field.rows,
                rank: packed.rank,
                first_factor: all.factors.len() as u32,
                slope: (range.scale / tile.size).as_vec2(),
                ..ReliefSurface::zeroed()
            });
            let texel = tile.size / DVec2::new(f64::from(map.width), f64::from(map.height));
            all.long_ways |= range.rise() > SHORT * texel.min_element();
            all.steepest.push(tile.field.steepest());
            all.tiles.push(height_tile);
            all.ranges.push(range);
            all.factors.append(&mut packed.texels);
            all.packed.push(packed);
        }
        all
    }

    /// Texels of a surface's height map, across and down.
    pub fn size(&self, surface: u32) -> DVec2 {
        let tile = &self.tiles[surface as usize];
        DVec2::new(f64::from(tile.width), f64::from(tile.height))
    }
}

/// The height map with the sign of its scale, so that higher is further out.
fn upward(material: &Material) -> Option<HeightMap> {
    let map = material.map_height.as_deref()?;
    let sign = material.height_scale.signum();
    Some(HeightMap {
        values: map.values.par_iter().map(|v| sign * v).collect(),
        ..map.clone()
    })
}
