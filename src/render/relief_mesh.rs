//! What the relief pass draws: prisms over the triangles with relief, their height maps, factors and light.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::relief_scene::ReliefScene;
use super::slots::slot_colour;
use super::{Light, Lighting, Projection, ReliefShading, Show};
use crate::constants::{MOST_RANK, WIDEST_SAMPLE};
use crate::directions::Directions;
use crate::error::Result;
use crate::meso::{Cluster, FaceClusters, Factors, HeightPyramid, Tile};
use crate::passes::relief::{Buffers, Parts};
use crate::passes::types::{HeightTile, ParallelLight, Prism, ReliefSurface};
use crate::scene::{HeightMap, Material, Scene, relief_normals};
use crate::solution::DirectionalLight;
use crate::vk::Device;

/// Prisms reach this share of the relief's range beyond it, so that a ray begins above it for certain.
const MARGIN: f64 = 1e-3;

/// The relief of a scene on the device.
pub struct ReliefMesh {
    pub buffers: Buffers,
    pub directions: Directions,
    /// Material, first prism, count.
    pub ranges: Vec<(u32, u32, u32)>,
    pub rest: FlatRelief,
}

/// Triangles with relief that need no rays, `[triangle]`.
pub struct FlatRelief {
    /// Those that are drawn as prisms.
    pub prism: Vec<bool>,
    /// Of those that turn away, at the relief's lowest, so that no ray slips between them and a prism beside them.
    pub away: HashMap<usize, [DVec3; 3]>,
    /// Of those so far away that a sample is wider than their texels: what they send to the eye, as radiosity, by corner.
    pub far: HashMap<usize, [Vec3; 3]>,
}

/// Vertices with light, each as a surface sees it.
#[derive(Default)]
struct LightVertices {
    coefficients: Vec<[Vec3; 2]>,
    exits: Vec<Vec3>,
    /// By vertex and surface.
    known: HashMap<(u32, u32), u32>,
}

impl ReliefMesh {
    /// For so many samples along a pixel's side.
    pub fn new(
        device: &Arc<Device>,
        scene: &Scene,
        lighting: &Lighting<'_>,
        (light, kept): (&DirectionalLight, &ReliefScene),
        (projection, samples): (&Projection, u32),
    ) -> Result<Self> {
        let ReliefScene {
            tiles,
            surface_of,
            factors,
            surfaces,
            vertices,
            all,
            direct,
            ..
        } = kept;
        let directions = kept.directions;
        let indirect: Vec<[Vec3; 3]> = all
            .iter()
            .zip(direct)
            .map(|(all, direct)| [0, 1, 2].map(|c| all[c] - direct[c]))
            .collect();
        // Light that has bounced inside the relief is indirect, wherever it came from.
        let sharp = lighting.sharp() && lighting.shading == ReliefShading::Factored;
        let inside = (lighting.part != Light::Direct).then_some(all);
        let arriving = match (lighting.part, sharp) {
            (Light::Global, false) => Some(all),
            (Light::Global, true) | (Light::Indirect, _) => Some(&indirect),
            (Light::Direct, false) => Some(direct),
            (Light::Direct, true) => None,
        };
        let clustered = arriving.filter(|_| lighting.shading == ReliefShading::Clusters);
        let arriving = arriving.filter(|_| clustered.is_none());
        let shown = lighting.part.of(
            &light.incident_moment,
            &light.incident_moment_direct,
            |all, direct| [0, 1, 2].map(|c| all[c] - direct[c]),
        );
        let exits = vertices.mean(&lighting.exits(scene, light), directions.count());
        let mut lit = LightVertices::default();
        let normals = relief_normals(scene);
        let widest = f64::from(WIDEST_SAMPLE) / f64::from(projection.sample_angle(samples));
        let averaged = lighting.shading.is_displaced() && lighting.show == Show::Shaded;
        let mut rest = FlatRelief {
            prism: vec![false; scene.triangles.len()],
            away: HashMap::new(),
            far: HashMap::new(),
        };
        let mut order: Vec<usize> = Vec::new();
        for (m, &e) in light.elements.iter().enumerate() {
            let e = e as usize;
            let Some(tile) = tiles.get(surface_of[e] as usize) else {
                continue;
            };
            let triangle = &scene.triangles[e];
            let steepest = surfaces.steepest[surface_of[e] as usize];
            let away = |&v: &u32| {
                let way = (scene.vertices[v as usize] - projection.eye).normalize_or_zero();
                way.dot(normals[v as usize]) > steepest
            };
            if triangle.vertices.iter().all(away) {
                let range = &surfaces.ranges[surface_of[e] as usize];
                let down = triangle.vertices.map(|v| {
                    scene.vertices[v as usize] + normals[v as usize] * range.above(range.lowest)
                });
                rest.away.insert(e, down);
                continue;
            }
            let texel = tile.size / surfaces.size(surface_of[e]);
            let near = scene
                .corners(triangle)
                .map(|p| p.distance(projection.eye))
                .into_iter()
                .fold(f64::INFINITY, f64::min);
            if averaged && near > widest * texel.min_element() {
                let corners = [0, 1, 2].map(|k| {
                    let way = projection.eye - scene.corners(triangle)[k];
                    let way = way.normalize_or_zero();
                    let frame = light.frames[m].map(|axis| axis.as_dvec3().dot(way));
                    let slots = vertices.corners[m][k] as usize * directions.count();
                    let looks = directions.bilinear(DVec3::from(frame));
                    looks
                        .map(|(slot, weight)| exits[slots + slot] * weight as f32)
                        .into_iter()
                        .sum()
                });
                rest.far.insert(e, corners);
                continue;
            }
            rest.prism[e] = true;
            order.push(m);
        }
        order.sort_by_key(|&m| scene.triangles[light.elements[m] as usize].material);
        let corners_by_vertex = |m: usize| {
            let mut corners = [0, 1, 2];
            let triangle = &scene.triangles[light.elements[m] as usize];
            corners.sort_by_key(|&k| triangle.vertices[k]);
            corners
        };
        let faces: Vec<_> = order
            .iter()
            .map(|&m| (m as u32, corners_by_vertex(m)))
            .collect();
        let clusters =
            clustered.map(|moments| FaceClusters::new(vertices, &directions, moments, &faces));
        let mut prisms = Vec::with_capacity(order.len());
        let mut mirrored = Vec::with_capacity(order.len());
        for (at, &(m, corners)) in faces.iter().enumerate() {
            let m = m as usize;
            let e = light.elements[m] as usize;
            let triangle = &scene.triangles[e];
            let surface = surface_of[e];
            let tile = &tiles[surface as usize];
            let range = &surfaces.ranges[surface as usize];
            let (first_cluster, cluster_count) = clusters.as_ref().map_or((0, 0), |c| c.ranges[at]);
            let place = |k: usize, height: f64| {
                let vertex = triangle.vertices[corners[k]] as usize;
                let at = scene.vertices[vertex] + normals[vertex] * range.above(height);
                ((at - projection.eye) / projection.unit).as_vec3()
            };
            let uv = corners.map(|k| DVec2::from(triangle.uv[k].map(f64::from)));
            let whole = uv[0].floor();
            let [a, b, c] = corners.map(|k| {
                let vertex = vertices.corners[m][k];
                lit.vertex(vertex, surface, |lit| {
                    let slots = vertex as usize * directions.count();
                    let slots = slots..slots + directions.count();
                    let factors = &factors[surface as usize];
                    let coefficients = |moments: Option<&Vec<[Vec3; 3]>>| {
                        let found = moments.map(|m| factors.coefficients(&m[slots.clone()]));
                        found.into_iter().flatten().collect::<Vec<_>>()
                    };
                    lit.push(&coefficients(inside), &coefficients(arriving));
                    lit.exits.extend_from_slice(&exits[slots.clone()]);
                })
            });
            let [tangent, bitangent, normal] = light.frames[m];
            let texel = tile.size / surfaces.size(surface);
            prisms.push(Prism {
                low_a: place(0, range.lowest),
                low_b: place(1, range.lowest),
                low_c: place(2, range.lowest),
                high_a: place(0, range.highest),
                high_b: place(1, range.highest),
                high_c: place(2, range.highest),
                uv_a: (uv[0] - whole).as_vec2(),
                uv_b: (uv[1] - whole).as_vec2(),
                uv_c: (uv[2] - whole).as_vec2(),
                light_a: a,
                light_b: b,
                light_c: c,
                surface,
                tangent,
                texel: (texel.min_element() / projection.unit) as f32,
                bitangent,
                normal,
                first_cluster,
                cluster_count,
                slots: slot_colour(
                    &directions,
                    &shown[m * directions.count()..][..directions.count()],
                ),
            });
            mirrored.push(matches!(corners, [0, 2, 1] | [1, 0, 2] | [2, 1, 0]));
        }
        let mut ranges: Vec<(u32, u32, u32)> = Vec::new();
        for (at, &m) in (0..).zip(&order) {
            let material = scene.triangles[light.elements[m] as usize].material;
            match ranges.last_mut() {
                Some((last, _, count)) if *last == material => *count += 1,
                _ => ranges.push((material, at, 1)),
            }
        }
        let parts = Parts {
            prisms: &prisms,
            surfaces: &surfaces.list,
            tiles: &surfaces.tiles,
            pyramids: &surfaces.pyramids,
            factors: &surfaces.factors,
            coefficients: &lit.coefficients,
            exits: &lit.exits,
            parallel_lights: &clusters.as_ref().map_or_else(Vec::new, parallel_lights),
        };
        Ok(Self {
            buffers: Buffers::new(device, &parts, &mirrored)?,
            directions,
            ranges,
            rest,
        })
    }
}

/// The clusters as the device has them.
fn parallel_lights(clusters: &FaceClusters) -> Vec<ParallelLight> {
    let light = |c: &Cluster| ParallelLight {
        towards: c.towards,
        fluence_a: c.fluence[0],
        fluence_b: c.fluence[1],
        fluence_c: c.fluence[2],
    };
    clusters.list.iter().map(light).collect()
}

impl LightVertices {
    fn vertex(&mut self, vertex: u32, surface: u32, make: impl FnOnce(&mut Self)) -> u32 {
        let next = self.known.len() as u32;
        let key = (vertex, surface);
        if let Some(&known) = self.known.get(&key) {
            return known;
        }
        self.known.insert(key, next);
        make(self);
        next
    }

    /// Coefficients `[rank]`; none for no light.
    fn push(&mut self, inside: &[Vec3], arriving: &[Vec3]) {
        let of = |values: &[Vec3], r: usize| values.get(r).copied().unwrap_or_default();
        let both = (0..MOST_RANK as usize).map(|r| [of(inside, r), of(arriving, r)]);
        self.coefficients.extend(both);
    }
}

/// Heights of a relief's prisms, in the map's values with the sign of their scale.
struct Range {
    lowest: f64,
    highest: f64,
    mean: f64,
    /// Scene units for a unit of height, positive.
    scale: f64,
}

impl Range {
    /// Scene units above the mesh.
    fn above(&self, height: f64) -> f64 {
        self.scale * (height - self.mean)
    }
}

/// What the surfaces share buffers for, `[surface]`.
#[derive(Default)]
pub struct Surfaces {
    list: Vec<ReliefSurface>,
    tiles: Vec<HeightTile>,
    ranges: Vec<Range>,
    /// Sine of the steepest slope's angle: a ray that rises more steeply meets the relief from below alone.
    steepest: Vec<f64>,
    pyramids: Vec<f32>,
    factors: Vec<Vec4>,
}

impl Surfaces {
    pub fn new(scene: &Scene, tiles: &[Tile], factors: &[Factors]) -> Self {
        let mut all = Self::default();
        let mut pyramids: HashMap<u32, HeightTile> = HashMap::new();
        for (tile, factors) in tiles.iter().zip(factors) {
            let material = &scene.materials[tile.material as usize];
            let Some(map) = upward(material) else {
                continue;
            };
            let values = &mut all.pyramids;
            let height_tile = *pyramids.entry(tile.material).or_insert_with(|| {
                let pyramid = HeightPyramid::new(&map);
                let tile = HeightTile::new(&pyramid, values.len() as u32);
                values.extend(&pyramid.values);
                tile
            });
            let (low, high) = map
                .values
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &v| {
                    (low.min(f64::from(v)), high.max(f64::from(v)))
                });
            let margin = MARGIN * (high - low);
            let range = Range {
                lowest: low - margin,
                highest: high + margin,
                mean: map.mean(),
                scale: f64::from(material.height_scale.abs()),
            };
            all.list.push(ReliefSurface {
                lowest: range.lowest as f32,
                top: range.highest as f32,
                mean: range.mean as f32,
                columns: tile.field.columns,
                rows: tile.field.rows,
                rank: factors.rank as u32,
                first_factor: all.factors.len() as u32,
                slope: (range.scale / tile.size).as_vec2(),
            });
            all.steepest.push(tile.field.steepest());
            all.tiles.push(height_tile);
            all.ranges.push(range);
            all.factors.extend(&factors.corners);
        }
        all
    }

    /// Texels of a surface's height map.
    fn size(&self, surface: u32) -> DVec2 {
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
