//! Which triangles with relief are drawn as prisms, and what is drawn in place of the others.

use std::collections::HashMap;

use glam::{DVec3, Vec3};

use super::Show;
use super::relief_light::Exits;
use super::relief_scene::ReliefScene;
use super::seen_scene::SeenScene;
use crate::bake::solution::DirectionalLight;
use crate::constants::WIDEST_SAMPLE;

/// Triangles with relief that need no rays, by their index in the scene.
pub struct FlatRelief {
    /// Whether a triangle is drawn as a prism instead, or would be if the picture showed it,
    /// `[triangle]`.
    pub prism: Vec<bool>,
    /// Corners of those that face away from the eye, lowered to the relief's lowest height, so that
    /// no ray slips between them and a prism beside them.
    pub away: HashMap<usize, [DVec3; 3]>,
    /// Those so far away that a sample is wider than their texels: what they send to the eye, as
    /// radiosity, `[corner]`.
    pub far: HashMap<usize, [Vec3; 3]>,
}

/// How one triangle with relief is drawn.
enum DrawnAs {
    Prism,
    /// A prism outside the picture.
    Unseen,
    Away([DVec3; 3]),
    Far([Vec3; 3]),
}

/// The triangles with relief, by how an eye sees them.
pub struct SortedRelief<'a> {
    pub light: &'a DirectionalLight,
    pub kept: &'a ReliefScene,
    pub exits: Exits<'a>,
    /// Meso elements that are drawn as prisms, in order of their materials.
    pub prisms: Vec<usize>,
    pub flat: FlatRelief,
}

impl<'a> SortedRelief<'a> {
    /// None where no relief is drawn by rays or its response.
    pub fn new(seen: &SeenScene<'a>, kept: Option<&'a ReliefScene>) -> Option<Self> {
        let ((light, _), kept) = seen.lighting.relief().zip(kept)?;
        let exits = Exits::new(seen.lighting, seen.scene, light, kept);
        let sorting = Sorting {
            seen,
            light,
            kept,
            exits: &exits,
        };
        let (flat, prisms) = sorting.sort();
        Some(Self {
            light,
            kept,
            exits,
            prisms,
            flat,
        })
    }
}

/// Decides how each triangle with relief is drawn.
struct Sorting<'a> {
    seen: &'a SeenScene<'a>,
    light: &'a DirectionalLight,
    kept: &'a ReliefScene,
    exits: &'a Exits<'a>,
}

impl Sorting<'_> {
    /// The flat ones, and the meso elements that are drawn as prisms, in order of their materials.
    fn sort(&self) -> (FlatRelief, Vec<usize>) {
        let scene = self.seen.scene;
        let mut flat = FlatRelief {
            prism: vec![false; scene.triangles.len()],
            away: HashMap::new(),
            far: HashMap::new(),
        };
        let mut prisms: Vec<usize> = Vec::new();
        for (m, &e) in self.light.elements.iter().enumerate() {
            let e = e as usize;
            match self.drawn_as(m, e) {
                None => {}
                Some(DrawnAs::Away(corners)) => {
                    flat.away.insert(e, corners);
                }
                Some(DrawnAs::Far(corners)) => {
                    flat.far.insert(e, corners);
                }
                Some(DrawnAs::Unseen) => flat.prism[e] = true,
                Some(DrawnAs::Prism) => {
                    flat.prism[e] = true;
                    prisms.push(m);
                }
            }
        }
        prisms.sort_by_key(|&m| scene.triangles[self.light.elements[m] as usize].material);
        (flat, prisms)
    }

    /// None of an element whose surface has no tile.
    fn drawn_as(&self, m: usize, e: usize) -> Option<DrawnAs> {
        let SeenScene {
            scene,
            lighting,
            projection,
            samples,
            ..
        } = *self.seen;
        let surface = self.kept.surface_of[e];
        let tile = self.kept.tiles.get(surface as usize)?;
        let triangle = &scene.triangles[e];
        let steepest = self.kept.surfaces.steepest[surface as usize];
        let away = |&v: &u32| {
            let way = (scene.vertices[v as usize] - projection.eye).normalize_or_zero();
            way.dot(self.kept.normals[v as usize]) > steepest
        };
        let range = &self.kept.surfaces.ranges[surface as usize];
        let at_height = |height: f64| {
            let above = range.above(height);
            let place = |v| scene.vertices[v as usize] + self.kept.normals[v as usize] * above;
            triangle.vertices.map(place)
        };
        let hull = [range.lowest, range.highest].map(at_height);
        if projection.misses(hull.as_flattened()) {
            return Some(DrawnAs::Unseen);
        }
        if triangle.vertices.iter().all(away) {
            return Some(DrawnAs::Away(at_height(range.lowest)));
        }
        let widest = f64::from(WIDEST_SAMPLE) / f64::from(projection.sample_angle(samples));
        let averaged = lighting.shading.is_displaced() && lighting.show == Show::Shaded;
        let texel = tile.size / self.kept.surfaces.size(surface);
        let near = scene
            .corners(triangle)
            .map(|p| p.distance(projection.eye))
            .into_iter()
            .fold(f64::INFINITY, f64::min);
        match averaged && near > widest * texel.min_element() {
            true => Some(DrawnAs::Far(self.sent_to_eye(m, e))),
            false => Some(DrawnAs::Prism),
        }
    }

    /// Radiosity that a meso element sends to the eye, `[corner]`.
    fn sent_to_eye(&self, m: usize, e: usize) -> [Vec3; 3] {
        let SeenScene {
            scene, projection, ..
        } = self.seen;
        let directions = &self.kept.directions;
        let corners = scene.corners(&scene.triangles[e]);
        [0, 1, 2].map(|k| {
            let way = (projection.eye - corners[k]).normalize_or_zero();
            let local = self.light.frames[m].map(|axis| axis.as_dvec3().dot(way));
            let slots = self.kept.vertices.corners[m][k] as usize * directions.count();
            let looks = directions.bilinear(DVec3::from(local));
            looks
                .map(|(slot, weight)| self.exits.all()[slots + slot] * weight as f32)
                .into_iter()
                .sum()
        })
    }
}
