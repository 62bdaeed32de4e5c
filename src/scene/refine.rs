//! Cuts triangles where light needs finer ones: those that are large, and those with other surfaces
//! close in front of them. A cut goes through all triangles that share the edge (Rivara 1984), so
//! that where the input has no T-junction, the result has none.

use std::collections::HashMap;
use std::time::Duration;

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::{Scene, Triangle};

/// How finely a scene is cut.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refinement {
    /// Longest edge of a triangle, scene units; where other surfaces are close, less. None: as if all
    /// were cut to 6,000 triangles of one size.
    pub element_size: Option<f64>,
    /// Most triangles.
    pub max_elements: usize,
}

impl Refinement {
    /// Triangles of the whole scene if all were cut to one size.
    const EVEN: f64 = 6000.0;
}

impl Default for Refinement {
    fn default() -> Self {
        Self {
            element_size: None,
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
    /// `[triangle]`
    pub on_input: Vec<OnInput>,
}

/// Of the size that is asked for: the least that close surfaces lead to, of one shell and of two.
const LEAST_OF_SHELL: f64 = 0.5;
const LEAST: f64 = 0.125;

/// Of the diagonal of a shell: no triangle of it is longer.
const OF_SHELL: f64 = 0.25;

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

    /// Cuts triangles as `refinement` says. The result has [`Scene::refined_from`].
    pub fn refined(&self, refinement: &Refinement) -> Self {
        let area: f64 = self.triangles.iter().map(|t| area(self.corners(t))).sum();
        let even = 2.0 * (area / Refinement::EVEN).sqrt();
        let mut size = refinement.element_size.unwrap_or(even);
        let most = refinement.max_elements.max(self.triangles.len());
        let surroundings = Surroundings::new(self);
        let wanted = size;
        loop {
            if let Some(mut cut) = Cutting::new(self, &surroundings, size, size / wanted).run(most)
            {
                if size > wanted {
                    cut.notes.push(format!(
                        "elements are cut to {size:.3} scene units, not {wanted:.3}: --max-elements {most}"
                    ));
                }
                return cut;
            }
            size *= COARSER;
        }
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
                    material: whole.material,
                }
            })
            .collect();
        cut.refined_from = Some(RefinedFrom {
            hash: self.hash(),
            on_input: on_input.to_vec(),
        });
        cut
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

/// An edge by its vertices, the lower first.
type Edge = [u32; 2];

/// Triangles while they are cut.
struct Cutting<'a> {
    scene: Scene,
    on_input: Vec<OnInput>,
    input: &'a Scene,
    surroundings: &'a Surroundings,
    size: f64,
    /// Of the diagonal of a shell: the longest edge of its triangles.
    of_shell: f64,
    /// Triangles on each edge.
    about: HashMap<Edge, Vec<u32>>,
    middles: HashMap<Edge, u32>,
}

impl<'a> Cutting<'a> {
    fn new(input: &'a Scene, surroundings: &'a Surroundings, size: f64, coarser: f64) -> Self {
        let mut cutting = Self {
            scene: input.clone(),
            on_input: (0..input.triangles.len() as u32)
                .map(OnInput::whole)
                .collect(),
            input,
            surroundings,
            size,
            of_shell: coarser * OF_SHELL,
            about: HashMap::new(),
            middles: HashMap::new(),
        };
        for t in 0..input.triangles.len() {
            cutting.enter(t as u32);
        }
        cutting
    }

    /// None where there would be more than `most` triangles.
    fn run(mut self, most: usize) -> Option<Scene> {
        let mut wanted: Vec<u32> = (0..self.scene.triangles.len() as u32).collect();
        while let Some(t) = wanted.pop() {
            if self.scene.triangles.len() > most {
                return None;
            }
            if self.is_fine(t as usize) {
                continue;
            }
            self.cut(t, &mut wanted);
        }
        let mut scene = self.scene;
        scene.refined_from = Some(RefinedFrom {
            hash: self.input.hash(),
            on_input: self.on_input,
        });
        Some(scene)
    }

    fn is_fine(&self, t: usize) -> bool {
        let corners = self.scene.corners(&self.scene.triangles[t]);
        let longest = length(corners, longest(corners, self.scene.triangles[t].vertices));
        let input = self.on_input[t].triangle as usize;
        let size = self
            .size
            .min(self.of_shell * self.surroundings.diagonal(input));
        if longest > size {
            return false;
        }
        longest <= LEAST * size
            || longest <= self.surroundings.size_at(self.input, input, corners, size)
    }

    /// Cuts a triangle through the middle of its longest edge, with all that share the edge, after
    /// those have been cut of which it is not the longest.
    fn cut(&mut self, first: u32, wanted: &mut Vec<u32>) {
        let mut stack = vec![first];
        while let Some(&t) = stack.last() {
            let edge = self.longest_edge(t);
            let longer = self.about[&edge]
                .iter()
                .find(|&&o| self.longest_edge(o) != edge);
            if let Some(&other) = longer {
                stack.push(other);
                continue;
            }
            stack.pop();
            let all = self.about[&edge].clone();
            let middle = self.middle(edge);
            for t in all {
                let half = self.halve(t, edge, middle);
                wanted.extend([t, half]);
            }
        }
    }

    fn longest_edge(&self, t: u32) -> Edge {
        let triangle = &self.scene.triangles[t as usize];
        let vertices = triangle.vertices;
        let k = longest(self.scene.corners(triangle), vertices);
        edge(vertices[k], vertices[(k + 1) % 3])
    }

    fn middle(&mut self, edge: Edge) -> u32 {
        if let Some(&middle) = self.middles.get(&edge) {
            return middle;
        }
        let [a, b] = edge.map(|v| self.scene.vertices[v as usize]);
        let middle = self.scene.vertices.len() as u32;
        self.scene.vertices.push(0.5 * (a + b));
        self.middles.insert(edge, middle);
        middle
    }

    /// Cuts a triangle at the middle of one of its edges; returns the new half.
    fn halve(&mut self, t: u32, cut: Edge, middle: u32) -> u32 {
        self.leave(t);
        let old = self.scene.triangles[t as usize];
        let on = self.on_input[t as usize];
        let k = (0..3)
            .find(|&k| edge(old.vertices[k], old.vertices[(k + 1) % 3]) == cut)
            .expect("the edge is one of the triangle's");
        let next = (k + 1) % 3;
        let uv = [0, 1].map(|i| 0.5 * (old.uv[k][i] + old.uv[next][i]));
        let at = [0, 1].map(|i| 0.5 * (on.corners[k][i] + on.corners[next][i]));
        let mut halves = [(old, on), (old, on)];
        for ((triangle, on), corner) in halves.iter_mut().zip([next, k]) {
            triangle.vertices[corner] = middle;
            triangle.uv[corner] = uv;
            on.corners[corner] = at;
        }
        let half = self.scene.triangles.len() as u32;
        let [(one, on_one), (other, on_other)] = halves;
        self.scene.triangles[t as usize] = one;
        self.on_input[t as usize] = on_one;
        self.scene.triangles.push(other);
        self.on_input.push(on_other);
        self.enter(t);
        self.enter(half);
        half
    }

    fn edges(&self, t: u32) -> [Edge; 3] {
        let v = self.scene.triangles[t as usize].vertices;
        [edge(v[0], v[1]), edge(v[1], v[2]), edge(v[2], v[0])]
    }

    fn enter(&mut self, t: u32) {
        for edge in self.edges(t) {
            self.about.entry(edge).or_default().push(t);
        }
    }

    fn leave(&mut self, t: u32) {
        for edge in self.edges(t) {
            if let Some(about) = self.about.get_mut(&edge) {
                about.retain(|&o| o != t);
            }
        }
    }
}

fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

fn length(corners: [DVec3; 3], k: usize) -> f64 {
    corners[k].distance(corners[(k + 1) % 3])
}

/// The longest edge, from corner k to the next; of equals the one with the highest vertices, so that
/// both triangles of an edge agree.
fn longest(corners: [DVec3; 3], vertices: [u32; 3]) -> usize {
    let key = |k: usize| (length(corners, k), edge(vertices[k], vertices[(k + 1) % 3]));
    (0..3).fold(0, |best, k| {
        let (a, b) = (key(k), key(best));
        if a.0 > b.0 || a.0 == b.0 && a.1 > b.1 {
            k
        } else {
            best
        }
    })
}

/// Surfaces about a place.
struct Surroundings {
    bvh: Bvh2,
    /// Of each triangle of the input: its shell, which holds all that it is joined to.
    shell: Vec<u32>,
    /// Diagonal of the box of each shell.
    diagonals: Vec<f64>,
    /// Height above a plane below which a place lies in it.
    flat: f64,
}

struct Bounds([DVec3; 3]);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        let mut bounds = Aabb::from_points(&self.0.map(|v| v.as_vec3a()));
        let margin = (bounds.max - bounds.min).max_element() * 1e-6 + f32::MIN_POSITIVE;
        bounds.min -= margin;
        bounds.max += margin;
        bounds
    }
}

impl Surroundings {
    fn new(scene: &Scene) -> Self {
        let bounds: Vec<Bounds> = scene
            .triangles
            .iter()
            .map(|t| Bounds(scene.corners(t)))
            .collect();
        let shell = shells(scene);
        let count = shell.iter().max().map_or(0, |&last| last as usize + 1);
        let mut boxes = vec![(DVec3::INFINITY, DVec3::NEG_INFINITY); count];
        for (t, &s) in scene.triangles.iter().zip(&shell) {
            for v in scene.corners(t) {
                let (low, high) = &mut boxes[s as usize];
                (*low, *high) = (low.min(v), high.max(v));
            }
        }
        let (_, unit) = scene.local_frame();
        Self {
            bvh: build_bvh2(
                &bounds,
                BvhBuildParams::fast_build(),
                &mut Duration::default(),
            ),
            shell,
            diagonals: boxes
                .iter()
                .map(|(low, high)| low.distance(*high))
                .collect(),
            flat: 1e-6 * unit,
        }
    }

    fn diagonal(&self, input: usize) -> f64 {
        self.diagonals[self.shell[input] as usize]
    }

    /// The size of a triangle on triangle `input` that what lies in front of it asks for, `size` at
    /// most: no longer than other surfaces are off.
    fn size_at(&self, scene: &Scene, input: usize, [a, b, c]: [DVec3; 3], size: f64) -> f64 {
        let middle = (a + b + c) / 3.0;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let mut found = size;
        let mut nodes = vec![0];
        while let Some(n) = nodes.pop() {
            let node = &self.bvh.nodes[n];
            let (low, high) = (node.aabb.min.as_dvec3(), node.aabb.max.as_dvec3());
            let highest = ((low - middle) * normal)
                .max((high - middle) * normal)
                .element_sum();
            if middle.distance(middle.clamp(low, high)) >= found || highest <= -self.flat {
                continue;
            }
            let first = node.first_index as usize;
            if !node.is_leaf() {
                nodes.extend([first, first + 1]);
                continue;
            }
            for &o in &self.bvh.primitive_indices[first..first + node.prim_count as usize] {
                let o = o as usize;
                let other = scene.corners(&scene.triangles[o]);
                let least = match self.shell[o] == self.shell[input] {
                    true => LEAST_OF_SHELL,
                    false => LEAST,
                };
                if self.faces(middle, normal, other) {
                    let distance = middle.distance(nearest(middle, other));
                    found = found.min(distance.max(least * size));
                }
            }
        }
        found
    }

    /// Whether light goes between a place and a triangle: it rises above the place's plane, or lies
    /// in it back to back or front to front.
    fn faces(&self, place: DVec3, normal: DVec3, other: [DVec3; 3]) -> bool {
        let heights = other.map(|v| (v - place).dot(normal));
        let [a, b, c] = other;
        let turned = (b - a).cross(c - a).dot(normal) < 0.0;
        let highest = heights[0].max(heights[1]).max(heights[2]);
        highest > self.flat || highest >= -self.flat && turned
    }
}

/// A number for each triangle, the same for those that are joined by vertices.
fn shells(scene: &Scene) -> Vec<u32> {
    let mut parent: Vec<u32> = (0..scene.vertices.len() as u32).collect();
    fn root(parent: &mut [u32], mut v: u32) -> u32 {
        while parent[v as usize] != v {
            parent[v as usize] = parent[parent[v as usize] as usize];
            v = parent[v as usize];
        }
        v
    }
    for t in &scene.triangles {
        let [a, b, c] = t.vertices.map(|v| root(&mut parent, v));
        parent[b as usize] = a;
        let c = root(&mut parent, c);
        parent[c as usize] = a;
    }
    let mut numbers: HashMap<u32, u32> = HashMap::new();
    (scene.triangles.iter())
        .map(|t| {
            let next = numbers.len() as u32;
            *numbers
                .entry(root(&mut parent, t.vertices[0]))
                .or_insert(next)
        })
        .collect()
}

/// The place on a triangle nearest to p (Ericson 2005, 5.1.5).
fn nearest(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let all = va + vb + vc;
    a + ab * (vb / all) + ac * (vc / all)
}
