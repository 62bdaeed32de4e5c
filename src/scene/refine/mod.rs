//! Cuts triangles where light needs finer ones: those that are large, and those with other surfaces
//! close in front of them. A cut goes through all triangles that share the edge (Rivara 1984), so
//! that where the input has no T-junction, the result has none.

mod cutting;
mod glow;
mod outlines;
mod shadows;
mod splitting;
mod surroundings;

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

#[cfg(feature = "export")]
use super::meshes;
use super::{Scene, Triangle};
use cutting::{Cutting, length, longest};
use glow::Glow;
use shadows::Shadows;
use surroundings::Surroundings;

/// How finely a scene is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Longest edge of a triangle, scene units; where other surfaces are close, less. None: as if
    /// all were cut to 6,000 triangles of one size, over `fineness`.
    pub element_size: Option<f64>,
    /// By which the sizes beside other surfaces, and the error that is left where shadows end, are
    /// divided; 1 or more.
    pub fineness: f64,
    /// Most triangles.
    pub max_elements: usize,
}

impl Refinement {
    /// Triangles of the whole scene if all were cut to one size.
    const EVEN: f64 = 6000.0;

    /// Whether a scene of this name is cut: built-in ones, unless they are coarse, are not, but
    /// where a size or more fineness is asked for.
    pub fn is_for(&self, name: &str) -> bool {
        use crate::scene::builtin::{COARSE, NAMES};
        let is_fine = NAMES.contains(&name) && !COARSE.contains(&name);
        !is_fine || self.element_size.is_some() || self.fineness > 1.0
    }
}

impl Default for Refinement {
    fn default() -> Self {
        Self {
            element_size: None,
            fineness: 1.0,
            max_elements: 200_000,
        }
    }
}

/// Where a triangle lies in a triangle of the input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnInput {
    pub triangle: u32,
    /// Barycentric coordinates of each corner: weights of the input's second and third corner.
    pub corners: [[f64; 2]; 3],
}

impl OnInput {
    /// Barycentric coordinates in the triangle of the input.
    pub fn weights(&self, weights: [f64; 3]) -> [f64; 3] {
        let along = |i: usize| (0..3).map(|k| weights[k] * self.corners[k][i]).sum::<f64>();
        let [second, third] = [0, 1].map(along);
        [1.0 - second - third, second, third]
    }

    /// The whole of a triangle.
    pub fn whole(triangle: u32) -> Self {
        Self {
            triangle,
            corners: [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]],
        }
    }
}

/// What a scene was refined from.
#[derive(Debug, Clone, PartialEq)]
pub struct RefinedFrom {
    /// [`Scene::hash`] of the input.
    pub hash: String,
    /// How many vertices the input has; they are the first of the refined scene.
    pub vertices: usize,
    /// `[triangle]`
    pub on_input: Vec<OnInput>,
}

/// Of the size that is asked for: the least that close surfaces of the same shell lead to, times
/// the fineness.
const LEAST: f64 = 0.5;

/// Of the size that is asked for: the least that close surfaces of other shells lead to, which
/// light falls off towards from all sides.
const LEAST_APART: f64 = 0.25;

/// Of the diagonal of a shell: no triangle of it is longer.
const OF_SHELL: f64 = 0.25;

/// Over an even mesh: triangles that the ends of shadows may lead to, at most.
const MOST_FOR_SHADOWS: f64 = 5.0;

/// Of the size that is asked for: the least that the ends of shadows lead to.
const LEAST_AT_SHADOWS: f64 = 1.0 / 64.0;

/// Squared error of a triangle for the end of a shadow, over that of the scene: where 10,000 of
/// them have as much, the scene is half a percent off.
const SHADOW: f64 = 0.005 * 0.005 / 10_000.0;

/// Power that a triangle emits on the wrong side of its middle, over that of the scene.
const GLOW: f64 = 1.0 / 4096.0;

/// Triangles that textures of emission may add, at least.
const MOST_FOR_GLOW: usize = 16_384;

/// Triangles are cut together whose errors are no smaller than the largest over this.
const AT_ONCE: f64 = 8.0;

/// Over the size by which it grows where there would be too many triangles.
const COARSER: f64 = 1.25;

impl Scene {
    /// [`Self::hash`] of the scene as it was read.
    pub fn input_hash(&self) -> String {
        match &self.refined_from {
            Some(from) => from.hash.clone(),
            None => self.hash(),
        }
    }

    /// Where each triangle lies in the input.
    pub fn on_input(&self) -> Vec<OnInput> {
        match &self.refined_from {
            Some(from) => from.on_input.clone(),
            None => (0..self.triangles.len() as u32)
                .map(OnInput::whole)
                .collect(),
        }
    }

    /// The same scene with its triangles in the order of those of the input, and their meshes by
    /// these, and where each lies in the input.
    #[cfg(feature = "export")]
    pub(crate) fn in_order_of_input(&self) -> (Self, Vec<OnInput>) {
        let of_input = self.on_input();
        let mut order: Vec<usize> = (0..self.triangles.len()).collect();
        order.sort_by_key(|&t| of_input[t].triangle);
        let from: Vec<u32> = order.iter().map(|&t| of_input[t].triangle).collect();
        let scene = Self {
            triangles: order.iter().map(|&t| self.triangles[t]).collect(),
            meshes: meshes::of_cut(&self.meshes, &from),
            refined_from: None,
            ..self.clone()
        };
        (scene, order.into_iter().map(|t| of_input[t]).collect())
    }

    /// Cuts triangles as `refinement` says. The result has [`Scene::refined_from`].
    pub fn refined(&self, refinement: &Refinement) -> Self {
        let (count, limit) = (self.triangles.len(), refinement.max_elements);
        let most = limit.max(count);
        let area: f64 = self.triangles.iter().map(|t| area(self.corners(t))).sum();
        let Refinement { fineness, .. } = *refinement;
        let even = 2.0 * (area / Refinement::EVEN).sqrt() / fineness;
        let mut size = refinement.element_size.unwrap_or(even);
        let least = Least::new(fineness);
        let shadow = SHADOW / (fineness * fineness);
        let surroundings = Surroundings::new(self);
        let wanted = size;
        loop {
            let wish = Wish {
                input: self,
                surroundings: &surroundings,
                size,
                least,
                of_shell: OF_SHELL * size / wanted,
            };
            let mut cutting = Cutting::new(self);
            let fits = cutting.until(|cut, t| wish.is_met(cut, t), most) && {
                let lines = outlines::outlines(self, &surroundings, size);
                splitting::split_along(&mut cutting, &lines, most)
            };
            if !fits && count == most {
                // What ever coarser sizes would give.
                let mut whole = Cutting::new(self).into_scene(self);
                whole.notes.push(format!(
                    "the {count} triangles are not cut into elements: --max-elements {limit}"
                ));
                return whole;
            }
            if !fits {
                size *= COARSER;
                continue;
            }
            let even = 4.0 * area / (size * size);
            let most_for_shadows = most.min((MOST_FOR_SHADOWS * even) as usize);
            // A mesh that is as fine already is not looked at.
            let has_room = cutting.scene.triangles.len() < most_for_shadows;
            if let Some(shadows) = has_room
                .then(|| Shadows::new(self, &surroundings))
                .flatten()
            {
                let most = most_for_shadows;
                cut_errors(
                    &mut cutting,
                    |cut, t| shadows.error(cut, t),
                    shadow,
                    size,
                    most,
                );
            }
            if let Some(glow) = Glow::new(self) {
                let room = MOST_FOR_GLOW.max(cutting.scene.triangles.len() / 2);
                let most = most.min(cutting.scene.triangles.len() + room);
                cut_errors(&mut cutting, |cut, t| glow.error(cut, t), GLOW, size, most);
            }
            let mut cut = cutting.into_scene(self);
            if size > wanted {
                cut.notes.push(format!(
                    "elements are cut to {size:.3} scene units, not {wanted:.3}: \
                     --max-elements {most}"
                ));
            }
            return cut;
        }
    }

    /// The scene that this one was refined from.
    pub fn uncut(&self) -> Self {
        let mut whole = self.clone();
        let Some(from) = whole.refined_from.take() else {
            return whole;
        };
        let count = from.on_input.iter().map(|on| on.triangle + 1).max();
        whole.triangles = vec![Triangle::default(); count.unwrap_or(0) as usize];
        whole.vertices.truncate(from.vertices);
        // Each corner of the input is one of some triangle that was cut from it.
        let corners = OnInput::whole(0).corners;
        for (part, on) in self.triangles.iter().zip(&from.on_input) {
            let input = &mut whole.triangles[on.triangle as usize];
            input.material = part.material;
            for (k, at) in on.corners.iter().enumerate() {
                if let Some(corner) = corners.iter().position(|corner| corner == at) {
                    input.vertices[corner] = part.vertices[k];
                    input.uv[corner] = part.uv[k];
                    if let Some(uv) = part.emission_uv {
                        input.emission_uv.get_or_insert(uv)[corner] = uv[k];
                    }
                    if let Some(uv) = part.light_uv {
                        input.light_uv.get_or_insert(uv)[corner] = uv[k];
                    }
                }
            }
        }
        whole
    }

    /// The triangles of this scene cut as they were in a scene that was refined from it.
    pub fn cut_as(&self, on_input: &[OnInput]) -> Self {
        let mut cut = self.clone();
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        for (v, place) in (0..).zip(&self.vertices) {
            known.entry(place.to_array().map(f64::to_bits)).or_insert(v);
        }
        cut.triangles = (on_input.iter())
            .map(|on| {
                let whole = &self.triangles[on.triangle as usize];
                let corners = self.corners(whole);
                let vertices = on.corners.map(|at| {
                    let place = at_place(corners, at);
                    let key = place.to_array().map(f64::to_bits);
                    *known.entry(key).or_insert_with(|| {
                        cut.vertices.push(place);
                        (cut.vertices.len() - 1) as u32
                    })
                });
                Triangle {
                    vertices,
                    uv: on.corners.map(|at| at_uv(whole.uv, at)),
                    emission_uv: (whole.emission_uv).map(|uv| on.corners.map(|at| at_uv(uv, at))),
                    light_uv: (whole.light_uv).map(|uv| on.corners.map(|at| at_uv(uv, at))),
                    material: whole.material,
                }
            })
            .collect();
        cut.refined_from = Some(RefinedFrom {
            hash: self.hash(),
            vertices: self.vertices.len(),
            on_input: on_input.to_vec(),
        });
        cut
    }
}

/// Cuts where errors exceed `allowed`, the largest first, to so many triangles at most.
fn cut_errors(
    cutting: &mut Cutting,
    error: impl Fn(&Cutting, usize) -> f64 + Sync,
    allowed: f64,
    size: f64,
    most: usize,
) {
    let of = |cutting: &Cutting, triangles: &[u32]| -> Vec<f64> {
        (triangles.par_iter())
            .map(|&t| error(cutting, t as usize))
            .collect()
    };
    let all: Vec<u32> = (0..cutting.scene.triangles.len() as u32).collect();
    let mut errors = of(cutting, &all);
    let least = LEAST_AT_SHADOWS * size;
    loop {
        let largest = errors.iter().copied().fold(0.0, f64::max);
        let wanted: Vec<usize> = (0..errors.len())
            .filter(|&t| errors[t] > allowed && errors[t] * AT_ONCE >= largest)
            .collect();
        let mut changed = Vec::new();
        for t in wanted {
            if cutting.scene.triangles.len() >= most {
                return;
            }
            let triangle = &cutting.scene.triangles[t];
            let corners = cutting.scene.corners(triangle);
            let is_small = length(corners, longest(corners, triangle.vertices)) <= least;
            let before = changed.len();
            // One that was cut with another waits for its new error.
            if errors[t] > 0.0 && !is_small {
                cutting.cut(t as u32, &mut changed);
            }
            errors[t] = 0.0;
            errors.resize(cutting.scene.triangles.len(), 0.0);
            changed[before..]
                .iter()
                .for_each(|&t| errors[t as usize] = 0.0);
        }
        if largest <= allowed {
            return;
        }
        changed.sort_unstable();
        changed.dedup();
        for (&t, error) in changed.iter().zip(of(cutting, &changed)) {
            errors[t as usize] = error;
        }
    }
}

/// The place with these barycentric coordinates. A corner and the middle of an edge are found from
/// that edge alone, to the bit, in either triangle that shares it.
fn at_place([a, b, c]: [DVec3; 3], [v, w]: [f64; 2]) -> DVec3 {
    let u = 1.0 - v - w;
    let mut sum = DVec3::ZERO;
    let mut terms = [(u, a), (v, b), (w, c)];
    // In an order that both triangles agree on.
    terms.sort_by(|(_, a), (_, b)| {
        a.to_array()
            .partial_cmp(&b.to_array())
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    for (weight, place) in terms {
        sum += weight * place;
    }
    sum
}

fn at_uv(uv: [[f32; 2]; 3], [v, w]: [f64; 2]) -> [f32; 2] {
    let u = 1.0 - v - w;
    [0, 1].map(|i| {
        let [a, b, c] = uv.map(|corner| f64::from(corner[i]));
        (u * a + v * b + w * c) as f32
    })
}

fn area([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// How long the edges of triangles may be.
struct Wish<'a> {
    input: &'a Scene,
    surroundings: &'a Surroundings,
    size: f64,
    least: Least,
    /// Of the diagonal of a shell.
    of_shell: f64,
}

/// Of the size that is asked for: the least that close surfaces lead to.
#[derive(Debug, Clone, Copy)]
struct Least {
    /// Those of the same shell, and of others.
    same: f64,
    apart: f64,
}

impl Least {
    fn new(fineness: f64) -> Self {
        let same = LEAST / fineness;
        let apart = LEAST_APART.min(same);
        Self { same, apart }
    }
}

impl Wish<'_> {
    fn is_met(&self, cut: &Cutting, t: usize) -> bool {
        let triangle = &cut.scene.triangles[t];
        let corners = cut.scene.corners(triangle);
        let longest = length(corners, longest(corners, triangle.vertices));
        let input = cut.on_input[t].triangle as usize;
        let of_shell = self.of_shell * self.surroundings.diagonal(input);
        let size = self.size.min(of_shell);
        if longest > size {
            return false;
        }
        let close = || {
            let Self {
                input: scene,
                least,
                ..
            } = *self;
            self.surroundings
                .size_at(scene, input, corners, size, least)
        };
        longest <= self.least.apart * size || longest <= close()
    }
}
