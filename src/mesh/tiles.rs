//! Elements with a relief grouped by tile: a material at one size of its texture's repeat.

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};

use super::elements::Elements;
use crate::error::{Error, Result};
use crate::meso::{HeightField, Shading};
use crate::scene::Scene;

/// Octaves by which the width or height of a tile may vary within a class.
const CLASS_OCTAVES: f64 = 0.5;
/// Steepest rms slope accepted: a steeper relief is a mistake in the scale of its heights.
const MOST_SLOPE: f64 = 1e3;

/// One material at one size of its tiles.
pub struct Tile {
    /// Index into the scene's materials.
    pub material: u32,
    /// Width and height of a repeat of the texture, mean over the members, scene units.
    pub size: DVec2,
    /// Elements.
    pub members: Vec<usize>,
    pub field: HeightField,
    pub shading: Shading,
}

/// The tiles of a scene and the frames of its elements, `[element]`, None for an element without
/// relief.
///
/// # Errors
/// A relief whose scale is implausibly steep.
pub fn tiles(scene: &Scene, elements: &Elements) -> Result<(Vec<Tile>, Vec<Option<Frame>>)> {
    let frames: Vec<Option<Frame>> = (0..elements.len())
        .map(|e| Frame::new(scene, elements, e))
        .collect();
    // Width and height of a tile in steps of CLASS_OCTAVES decide the class.
    let mut members: BTreeMap<(u32, i64, i64), Vec<usize>> = BTreeMap::new();
    for (e, frame) in frames.iter().enumerate() {
        if let Some(frame) = frame {
            let step = |size: f64| (size.log2() / CLASS_OCTAVES).round() as i64;
            let key = (elements.material[e], step(frame.tile.x), step(frame.tile.y));
            members.entry(key).or_default().push(e);
        }
    }
    let mut tiles = Vec::new();
    for ((material, _, _), members) in members {
        let area: f64 = members.iter().map(|&e| elements.area[e]).sum();
        let size = members
            .iter()
            .map(|&e| frames[e].as_ref().map_or(DVec2::ZERO, |f| f.tile) * elements.area[e])
            .sum::<DVec2>()
            / area;
        let of = &scene.materials[material as usize];
        let Some(field) = HeightField::new(of, size) else {
            continue;
        };
        let rms_slope = field.rms_slope();
        if rms_slope.is_nan() || rms_slope > MOST_SLOPE {
            return Err(Error::Scene {
                scene: scene.name.clone(),
                what: format!(
                    "material \"{}\": its relief has an rms slope of {rms_slope:.3e}: height_scale or the texture coordinates are wrong",
                    of.name
                ),
            });
        }
        tiles.push(Tile {
            material,
            size,
            members,
            shading: Shading::new(of, &field),
            field,
        });
    }
    Ok((tiles, frames))
}

/// Tangent frame of an element by its texture coordinates.
pub struct Frame {
    pub tangent: DVec3,
    pub bitangent: DVec3,
    /// Length of a repeat of the texture along tangent and bitangent, scene units.
    pub tile: DVec2,
}

impl Frame {
    /// None for an element without relief, or whose texture coordinates span no area.
    fn new(scene: &Scene, elements: &Elements, e: usize) -> Option<Self> {
        let triangle = &scene.triangles[elements.input_index[e] as usize];
        if !scene.materials[triangle.material as usize].has_relief() {
            return None;
        }
        let [a, b, c] = elements.triangle(e);
        let uv = triangle
            .uv
            .map(|[u, v]| DVec2::new(f64::from(u), f64::from(v)));
        let (along, across) = (uv[1] - uv[0], uv[2] - uv[0]);
        let turn = along.perp_dot(across);
        let along_u = ((b - a) * across.y - (c - a) * along.y) / turn;
        let along_v = ((c - a) * along.x - (b - a) * across.x) / turn;
        let tangent = along_u.try_normalize()?;
        let bitangent = elements.normal[e].cross(tangent) * turn.signum();
        let tile = DVec2::new(along_u.length(), along_v.dot(bitangent)) * elements.unit;
        (tile.is_finite() && tile.min_element() > 0.0).then_some(Self {
            tangent,
            bitangent,
            tile,
        })
    }
}
