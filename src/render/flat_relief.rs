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

/// Decides how each triangle with relief is drawn.
pub struct Sorting<'a> {
    pub seen: &'a SeenScene<'a>,
    pub light: &'a DirectionalLight,
    pub kept: &'a ReliefScene,
    /// Of the relief's base, `[vertex of the scene]`.
    pub normals: &'a [DVec3],
    pub exits: &'a Exits<'a>,
}

impl Sorting<'_> {
    /// The flat ones, and the meso elements that are drawn as prisms, in order of their materials.
    pub fn sort(&self) -> (FlatRelief, Vec<usize>) {
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
            way.dot(self.normals[v as usize]) > steepest
        };
        let range = &self.kept.surfaces.ranges[surface as usize];
        let hull = [range.lowest, range.highest].map(|height| {
            let raised =
                |v| scene.vertices[v as usize] + self.normals[v as usize] * range.above(height);
            triangle.vertices.map(raised)
        });
        if projection.misses(hull.as_flattened()) {
            return Some(DrawnAs::Unseen);
        }
        if triangle.vertices.iter().all(away) {
            let lowest = range.above(range.lowest);
            let lowered = |v| scene.vertices[v as usize] + self.normals[v as usize] * lowest;
            return Some(DrawnAs::Away(triangle.vertices.map(lowered)));
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
