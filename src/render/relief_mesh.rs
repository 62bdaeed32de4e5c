//! What is drawn of relief: prisms over the triangles with relief, their height maps, factors
//! and light.

use std::sync::Arc;

use bytemuck::Zeroable;
use glam::{DVec2, Vec3, Vec4};
use rayon::prelude::*;

use super::blocks::Blocks;
use super::flat_relief::SortedRelief;
use super::relief_light::{Incident, LightVertices, difference};
use super::relief_scene::ReliefScene;
use super::seen_scene::SeenScene;
use super::shaft_starts::Starts;
use super::shafts::{Blockers, Shafts};
use super::slots::slot_colour;
use super::{Cuts, Show};
use crate::bake::solution::DirectionalLight;
use crate::constants::WIDEST_SAMPLE;
use crate::error::Result;
use crate::math::directions::Directions;
use crate::mesh::clusters::{Cluster, Face, FaceClusters};
use crate::passes::relief::{Buffers, Lights};
use crate::passes::relief_hits::{Shape, ShapeBuffers};
use crate::passes::types::{ParallelLight, Prism};
use crate::picture::Tile;
use crate::scene::Triangle;
use crate::vk::Device;

/// The relief of a scene on the device.
pub struct ReliefMesh {
    pub shape: ShapeBuffers,
    pub lights: Buffers,
    pub directions: Directions,
    pub ranges: Vec<PrismRange>,
    /// Of prisms.
    pub blocks: Blocks,
    pub prism_count: u32,
    /// Number of prisms in each state, `[PART_…]`.
    pub states: [usize; 3],
}

/// Prisms of one material.
pub struct PrismRange {
    pub material: u32,
    pub first: u32,
    pub count: u32,
}

impl ReliefMesh {
    /// Prisms over what was sorted as such; those that `shafts` show to be open or hidden follow no
    /// shadow rays past other surfaces.
    ///
    /// # Errors
    /// A device without the memory.
    pub fn new(
        device: &Arc<Device>,
        seen: &SeenScene<'_>,
        sorted: &SortedRelief<'_>,
        shafts: Option<&Shafts>,
    ) -> Result<Self> {
        let (scene, lighting) = (seen.scene, seen.lighting);
        let (light, kept, drawn) = (sorted.light, sorted.kept, &sorted.prisms);
        let directions = &kept.directions;
        let triangle = |m: usize| &scene.triangles[light.elements[m] as usize];
        let faces: Vec<Face> = drawn
            .iter()
            .map(|&m| Face {
                meso: m as u32,
                corners: corners_by_vertex(triangle(m)),
            })
            .collect();
        let incident = Incident::new(lighting, kept);
        let clusters = incident
            .clustered
            .as_ref()
            .map(|moments| FaceClusters::new(&kept.vertices, directions, moments, &faces));
        let mut prisms = PrismBuilder {
            seen,
            light,
            kept,
            shown: (lighting.show == Show::Slots).then(|| {
                let (all, direct) = (&light.incident_moment, &light.incident_moment_direct);
                lighting.part.of(all, direct, difference)
            }),
            lit: LightVertices::default(),
            borders: Vec::new(),
        };
        let mut list: Vec<Prism> = (0..faces.len())
            .map(|i| {
                let range = clusters.as_ref().map_or((0, 0), |c| c.ranges[i]);
                prisms.prism(&faces[i], range)
            })
            .collect();
        if let Some(shafts) = shafts {
            let judge = |blockers: &mut Blockers, p: &mut Prism| {
                p.state = shafts.state(&Starts::on_prism(p), blockers);
            };
            list.par_iter_mut().for_each_init(Blockers::default, judge);
        }
        let mut states = [0; 3];
        list.iter().for_each(|p| states[p.state as usize] += 1);
        let mirrored: Vec<bool> = faces.iter().map(is_mirrored).collect();
        let shape = Shape {
            prisms: &list,
            mirrored: &mirrored,
            surfaces: &kept.surfaces.list,
            tiles: &kept.surfaces.tiles,
            pyramids: &kept.surfaces.pyramids,
        };
        let corners: Vec<Vec3> = list
            .iter()
            .flat_map(|p| [p.low_a, p.low_b, p.low_c, p.high_a, p.high_b, p.high_c])
            .collect();
        let averaged = lighting.show == Show::Shaded
            && lighting.shading.is_displaced()
            && list.iter().any(|prism| may_be_wide(prism, seen));
        let sent = match averaged {
            true => prisms.lit.exits(&sorted.exits, directions.count()),
            false => Vec::new(),
        };
        let lights = Lights {
            factors: &kept.surfaces.factors,
            coefficients: &prisms.lit.coefficients(kept, &incident),
            exits: &sent,
            parallel_lights: &clusters.as_ref().map_or_else(Vec::new, parallel_lights),
            horizons: &kept.surfaces.horizons,
            borders: &prisms.borders,
        };
        Ok(Self {
            shape: ShapeBuffers::new(device, &shape)?,
            lights: Buffers::new(device, &lights)?,
            directions: *directions,
            ranges: ranges(drawn.iter().map(|&m| triangle(m).material)),
            blocks: Blocks::new(seen.projection, &corners, 6),
            prism_count: list.len() as u32,
            states,
        })
    }

    /// Prisms that a tile draws, and all.
    pub fn drawn(&self, tile: Tile, cuts: Cuts) -> [usize; 2] {
        let all = 0..self.prism_count;
        self.blocks.drawn(std::iter::once(&all), tile, cuts)
    }
}

/// Corners of a triangle in the order of its vertices, so that neighbours interpolate alike.
fn corners_by_vertex(triangle: &Triangle) -> [usize; 3] {
    let mut corners = [0, 1, 2];
    corners.sort_by_key(|&k| triangle.vertices[k]);
    corners
}

fn is_mirrored(face: &Face) -> bool {
    matches!(face.corners, [0, 2, 1] | [1, 0, 2] | [2, 1, 0])
}

/// Whether a sample may be wider than WIDEST_SAMPLE texels somewhere on a prism, see
/// `shared/relief_hit.glsl`.
fn may_be_wide(p: &Prism, seen: &SeenScene<'_>) -> bool {
    // More than what the device's distances are rounded by.
    const MARGIN: f32 = 1.001;
    let corners = [p.low_a, p.low_b, p.low_c, p.high_a, p.high_b, p.high_c];
    let furthest = corners.iter().map(|v| v.length()).fold(0.0, f32::max);
    let angle = seen.projection.sample_angle(seen.samples);
    furthest * angle * MARGIN > WIDEST_SAMPLE as f32 * p.texel
}

/// Runs of equal materials, `[prism]`.
fn ranges(materials: impl Iterator<Item = u32>) -> Vec<PrismRange> {
    let mut ranges: Vec<PrismRange> = Vec::new();
    for (first, material) in (0..).zip(materials) {
        match ranges.last_mut() {
            Some(last) if last.material == material => last.count += 1,
            _ => ranges.push(PrismRange {
                material,
                first,
                count: 1,
            }),
        }
    }
    ranges
}

/// Makes prisms, and lists the vertices that they share.
struct PrismBuilder<'a> {
    seen: &'a SeenScene<'a>,
    light: &'a DirectionalLight,
    kept: &'a ReliefScene,
    /// Moments of the part of the light that is shown, `[meso element][slot][colour]`, where slots
    /// are.
    shown: Option<Vec<[Vec3; 3]>>,
    lit: LightVertices,
    /// Of the relief, near each prism: shares of its corners b and c at both ends.
    borders: Vec<Vec4>,
}

impl PrismBuilder<'_> {
    /// `clusters` are the first cluster of the face and their number.
    fn prism(&mut self, face: &Face, clusters: (u32, u32)) -> Prism {
        let (scene, projection) = (self.seen.scene, self.seen.projection);
        let m = face.meso as usize;
        let e = self.light.elements[m] as usize;
        let triangle = &scene.triangles[e];
        let surface = self.kept.surface_of[e];
        let surfaces = &self.kept.surfaces;
        let range = &surfaces.ranges[surface as usize];
        let texel = self.kept.tiles[surface as usize].size / surfaces.size(surface);
        let place = |k: usize, height: f64| {
            let vertex = triangle.vertices[face.corners[k]] as usize;
            let at = scene.vertices[vertex] + self.kept.normals[vertex] * range.above(height);
            ((at - projection.eye) / projection.unit).as_vec3()
        };
        let low = [0, 1, 2].map(|k| place(k, range.lowest));
        let high = [0, 1, 2].map(|k| place(k, range.highest));
        let uv = face
            .corners
            .map(|k| DVec2::from(triangle.uv[k].map(f64::from)));
        let whole = uv[0].floor();
        let [light_a, light_b, light_c] = face
            .corners
            .map(|k| self.lit.index(self.kept.vertices.corners[m][k], surface));
        let [tangent, bitangent, normal] = self.light.frames[m];
        let first_border = self.borders.len() as u32;
        self.add_borders(e, face);
        Prism {
            low_a: low[0],
            low_b: low[1],
            low_c: low[2],
            high_a: high[0],
            high_b: high[1],
            high_c: high[2],
            uv_a: (uv[0] - whole).as_vec2(),
            uv_b: (uv[1] - whole).as_vec2(),
            uv_c: (uv[2] - whole).as_vec2(),
            light_a,
            light_b,
            light_c,
            surface,
            tangent,
            first_border,
            border_count: self.borders.len() as u32 - first_border,
            texel: (texel.min_element() / projection.unit) as f32,
            bitangent,
            normal,
            first_cluster: clusters.0,
            cluster_count: clusters.1,
            slots: self.slots(m),
            ..Prism::zeroed()
        }
    }

    /// The colour of the strongest slot of a meso element, where slots are shown.
    fn slots(&self, m: usize) -> Vec3 {
        let k = self.kept.directions.count();
        let of_shown = |shown: &Vec<[Vec3; 3]>| {
            let moments = &shown[m * k..][..k];
            slot_colour(&self.kept.directions, moments)
        };
        self.shown.as_ref().map_or(Vec3::ZERO, of_shown)
    }

    fn add_borders(&mut self, triangle: usize, face: &Face) {
        for &border in self.kept.borders.of(triangle) {
            let [from, to] = border.map(|at| {
                let shares = [1.0 - at.x - at.y, at.x, at.y];
                DVec2::new(shares[face.corners[1]], shares[face.corners[2]])
            });
            let ends = if is_mirrored(face) {
                [to, from]
            } else {
                [from, to]
            };
            let [from, to] = ends.map(|at| at.as_vec2());
            self.borders.push(Vec4::new(from.x, from.y, to.x, to.y));
        }
    }
}

/// The clusters in the form that the device reads.
fn parallel_lights(clusters: &FaceClusters) -> Vec<ParallelLight> {
    let light = |c: &Cluster| ParallelLight {
        towards: c.towards,
        fluence_a: c.fluence[0],
        fluence_b: c.fluence[1],
        fluence_c: c.fluence[2],
    };
    clusters.list.iter().map(light).collect()
}
