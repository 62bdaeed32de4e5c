//! Relief as the window's surfaces show it: the slopes of its heights, and how open its places are.

use glam::{DVec2, DVec3, Vec2};
use rayon::prelude::*;

use crate::scene::{HeightMap, Material, Scene, Triangle};

/// Vectors along a triangle that, times the slopes of its relief along u and v, are what its normal
/// turns by: the relief's normal is along n − s_u a_u − s_v a_v. Zero without relief or texture
/// coordinates.
pub fn slope_axes(scene: &Scene, triangle: &Triangle) -> [DVec3; 2] {
    let material = &scene.materials[triangle.material as usize];
    if !material.has_relief() {
        return [DVec3::ZERO; 2];
    }
    let [of_u, of_v] = growth_of_uv(scene, triangle);
    let axes = match (&material.map_normal, &material.map_height) {
        (None, Some(_)) => {
            let scale = f64::from(material.height_scale);
            [of_u * scale, of_v * scale]
        }
        // Normals are in the frame of the texture.
        _ => {
            let [a, b, c] = scene.corners(triangle);
            let normal = (b - a).cross(c - a);
            let along_u = of_v.cross(normal).normalize_or_zero();
            let along_u = along_u * of_u.dot(along_u).signum();
            let along_v = normal.cross(along_u).normalize_or_zero();
            [along_u, along_v * of_v.dot(along_v).signum()]
        }
    };
    match axes.iter().all(|axis| axis.is_finite()) {
        true => axes,
        false => [DVec3::ZERO; 2],
    }
}

/// What u and v grow by along a triangle, a scene unit.
fn growth_of_uv(scene: &Scene, triangle: &Triangle) -> [DVec3; 2] {
    let [a, b, c] = scene.corners(triangle);
    let normal = (b - a).cross(c - a);
    let of_b = normal.cross(a - c) / normal.length_squared();
    let of_c = normal.cross(b - a) / normal.length_squared();
    let [uv_a, uv_b, uv_c] = triangle.uv.map(|uv| Vec2::from(uv).as_dvec2());
    let (to_b, to_c) = (uv_b - uv_a, uv_c - uv_a);
    [of_b * to_b.x + of_c * to_c.x, of_b * to_b.y + of_c * to_c.y]
}

/// A material's relief at its texels, as a texture.
pub struct Slopes {
    /// Texels across and down.
    pub size: (u32, u32),
    /// Slopes along u and v, of the height map's values a repeat or of its normals; the openness.
    pub texels: Vec<[f32; 3]>,
}

/// Azimuths in which the openness of a texel is found, and texels of the steps along each.
const AZIMUTHS: u32 = 8;
const STEPS: [f32; 8] = [1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 18.0, 27.0];

impl Slopes {
    /// None without relief. `tile` is the length of a repeat of the texture along u and v, scene
    /// units.
    pub fn new(material: &Material, tile: DVec2) -> Option<Self> {
        if !material.has_relief() {
            return None;
        }
        let map = material.map_height.as_deref()?;
        let openness = Openness {
            map,
            scale: material.height_scale,
            tile,
        };
        if let Some(normals) = &material.map_normal {
            let size = (normals.width, normals.height);
            let places = (0..size.0 * size.1).into_par_iter().zip(&normals.normals);
            let texel = |(i, &[x, y, z]): (u32, &[f32; 3])| {
                let at = Vec2::new((i % size.0) as f32 + 0.5, (i / size.0) as f32 + 0.5);
                let at = at / Vec2::new(size.0 as f32, size.1 as f32);
                [-x / z, -y / z, openness.at(at)]
            };
            return Some(Self {
                size,
                texels: places.map(texel).collect(),
            });
        }
        let HeightMap { width, height, .. } = *map;
        let texel = |i: u32| {
            let (column, row) = (i % width, i / width);
            let value = |column: u32, row: u32| value(map, column, row);
            let across = value(column + 1, row) - value(column + width - 1, row);
            let up = value(column, row + height - 1) - value(column, row + 1);
            let at = Vec2::new(column as f32 + 0.5, row as f32 + 0.5);
            [
                0.5 * across * width as f32,
                0.5 * up * height as f32,
                openness.at(at / Vec2::new(width as f32, height as f32)),
            ]
        };
        Some(Self {
            size: (width, height),
            texels: (0..width * height).into_par_iter().map(texel).collect(),
        })
    }
}

/// A texel of a map that repeats.
fn value(map: &HeightMap, column: u32, row: u32) -> f32 {
    map.values[((row % map.height) * map.width + column % map.width) as usize]
}

/// How open places of a relief are.
struct Openness<'a> {
    map: &'a HeightMap,
    /// Scene units.
    scale: f32,
    tile: DVec2,
}

impl Openness<'_> {
    /// The share of an even sky's light on the level at a place of the image, 0..1 across and down,
    /// that nothing about it hides: of the azimuths, the mean of cos² of the horizon's height.
    fn at(&self, place: Vec2) -> f32 {
        let (width, height) = (self.map.width as f32, self.map.height as f32);
        let own = place * Vec2::new(width, height);
        let height_at = |at: Vec2| {
            let at = Vec2::new(at.x.rem_euclid(width), at.y.rem_euclid(height));
            value(self.map, at.x as u32, at.y as u32)
        };
        let level = height_at(own);
        let texel = self.tile.as_vec2() / Vec2::new(width, height);
        let open = |azimuth: u32| {
            let turn = Vec2::from_angle(azimuth as f32 / AZIMUTHS as f32 * std::f32::consts::TAU);
            let tangent = STEPS.iter().map(|step| {
                let to = turn * *step;
                self.scale * (height_at(own + to) - level) / (to * texel).length()
            });
            let steepest = tangent.fold(0.0, f32::max);
            1.0 / (1.0 + steepest * steepest)
        };
        (0..AZIMUTHS).map(open).sum::<f32>() / AZIMUTHS as f32
    }
}

/// The mean length of a repeat of the texture along u and v over the triangles of a material, scene
/// units, by area.
pub fn mean_tile(scene: &Scene, material: usize) -> DVec2 {
    let of_material = scene.triangles.iter();
    let of_material = of_material.filter(|t| t.material as usize == material);
    let (mut growth, mut areas) = (DVec2::ZERO, 0.0);
    for triangle in of_material {
        let [a, b, c] = scene.corners(triangle);
        let area = (b - a).cross(c - a).length();
        let [u, v] = growth_of_uv(scene, triangle);
        if u.is_finite() && v.is_finite() {
            growth += DVec2::new(u.length(), v.length()) * area;
            areas += area;
        }
    }
    areas / growth
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane that rises by its height map has the normal of the plane that it rises to, whatever
    /// the triangle's place and texture coordinates; so has a normal map of the same plane.
    #[test]
    fn the_relief_turns_the_normal_as_its_heights_do() {
        let height = |at: DVec2| 0.25 * at.x - 0.5 * at.y;
        let uv = [[0.1, 0.3], [0.6, 0.2], [0.3, 0.9]];
        // Scene units of a repeat of the texture.
        let tile = DVec2::new(2.0, 3.0);
        let vertices: Vec<DVec3> = uv
            .iter()
            .map(|&[u, v]| DVec3::new(f64::from(u) * tile.x, f64::from(v) * tile.y, 7.0))
            .collect();
        let triangle = Triangle {
            vertices: [0, 1, 2],
            uv,
            emission_uv: None,
            light_uv: None,
            material: 0,
        };
        let map = HeightMap {
            path: "ramp".into(),
            width: 8,
            height: 8,
            values: (0..64)
                .map(|i| {
                    let (column, row) = (f64::from(i % 8) + 0.5, f64::from(i / 8) + 0.5);
                    height(DVec2::new(column, 8.0 - row) / 8.0) as f32
                })
                .collect(),
        };
        let upward = DVec3::new(-0.25 * 3.0 / tile.x, 0.5 * 3.0 / tile.y, 1.0).normalize();
        let normals = crate::scene::NormalMap {
            path: "plane".into(),
            width: 1,
            height: 1,
            normals: vec![upward.as_vec3().to_array()],
        };
        let heights = Material {
            map_height: Some(map.into()),
            height_scale: 3.0,
            ..Material::default()
        };
        let materials = [
            heights.clone(),
            Material {
                map_normal: Some(normals.into()),
                ..heights
            },
        ];
        for material in materials {
            let slopes = Slopes::new(&material, tile).expect("it has relief");
            // In the middle, where the ramp does not repeat.
            let middle = slopes.texels.len() / 2 + slopes.size.0 as usize / 2;
            let [along_u, along_v, _] = slopes.texels[middle];
            let scene = Scene {
                vertices: vertices.clone(),
                triangles: vec![triangle],
                materials: vec![material],
                ..Scene::default()
            };
            let [u, v] = slope_axes(&scene, &scene.triangles[0]);
            let found = DVec3::Z - u * f64::from(along_u) - v * f64::from(along_v);
            let off = (found.normalize() - upward).length();
            assert!(off < 1e-5, "{found}, not along {upward}");
        }
    }

    /// At the bottom of a groove, walls hide what their angle says; on the level, nothing is hidden.
    #[test]
    fn a_groove_is_as_open_as_its_walls_let_it_be() {
        // One column of 64 is low: walls 0.5 high, 1 away on either side.
        let map = HeightMap {
            path: "groove".into(),
            width: 64,
            height: 64,
            values: (0..64 * 64)
                .map(|i| if i % 64 == 20 { 0.0 } else { 0.5 })
                .collect(),
        };
        let openness = Openness {
            map: &map,
            scale: 1.0,
            tile: DVec2::splat(64.0),
        };
        let at = |column: f32| openness.at(Vec2::new((column + 0.5) / 64.0, 0.5));
        assert_eq!(at(40.0), 1.0);
        // Two azimuths along the groove, two across, four at 45°.
        let across = 1.0 / (1.0 + 0.25);
        let aslant = at(20.0) * 8.0 - 2.0 - 2.0 * across;
        assert!((0.5..1.0).contains(&(aslant / 4.0)), "{aslant}");
        assert!(at(20.0) < 0.95 && at(20.0) > across, "{}", at(20.0));
    }
}
