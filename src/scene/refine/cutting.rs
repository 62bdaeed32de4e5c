//! Triangles while they are cut through the middles of their longest edges.

use std::collections::HashMap;

use glam::{DVec2, DVec3};

use super::{OnInput, RefinedFrom, Scene, Triangle, at_place, at_uv};

/// An edge by its vertices, the lower first.
pub(super) type Edge = [u32; 2];

/// A corner of a piece of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Corner {
    /// The corner of that number.
    Old(usize),
    /// A new one on an edge by its number there, and its barycentric coordinates.
    OnEdge(Edge, u32, DVec2),
    /// A new one by its barycentric coordinates.
    Within(DVec2),
}

/// Triangles while they are cut.
pub(super) struct Cutting {
    pub scene: Scene,
    pub on_input: Vec<OnInput>,
    /// Of each triangle of the input.
    input_corners: Vec<[DVec3; 3]>,
    /// Triangles on each edge.
    about: HashMap<Edge, Vec<u32>>,
    middles: HashMap<Edge, u32>,
}

impl Cutting {
    pub fn new(input: &Scene) -> Self {
        let count = input.triangles.len() as u32;
        Self {
            scene: input.clone(),
            on_input: (0..count).map(OnInput::whole).collect(),
            input_corners: (input.triangles.iter()).map(|t| input.corners(t)).collect(),
            about: HashMap::new(),
            middles: HashMap::new(),
        }
    }

    /// Cuts until every triangle is fine enough; false where there would be more than `most`.
    pub fn until(&mut self, is_fine: impl Fn(&Self, usize) -> bool, most: usize) -> bool {
        let all = 0..self.scene.triangles.len() as u32;
        let mut wanted: Vec<u32> = all.filter(|&t| !is_fine(self, t as usize)).collect();
        while let Some(t) = wanted.pop() {
            if self.scene.triangles.len() > most {
                return false;
            }
            if !is_fine(self, t as usize) {
                self.cut(t, &mut wanted);
            }
        }
        true
    }

    pub fn into_scene(self, input: &Scene) -> Scene {
        let mut scene = self.scene;
        scene.refined_from = Some(RefinedFrom {
            hash: input.hash(),
            vertices: input.vertices.len(),
            on_input: self.on_input,
        });
        scene
    }

    /// Cuts a triangle through the middle of its longest edge, with all that share the edge, after
    /// those have been cut of which it is not the longest.
    /// Those that changed are added to `changed`.
    pub fn cut(&mut self, first: u32, changed: &mut Vec<u32>) {
        self.know_edges();
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
                changed.extend([t, half]);
            }
        }
    }

    /// Enters the edges of all triangles, if that has not been done.
    pub fn know_edges(&mut self) {
        if self.about.is_empty() {
            (0..self.scene.triangles.len() as u32).for_each(|t| self.enter(t));
        }
    }

    /// Triangles on an edge.
    pub fn about(&self, edge: Edge) -> &[u32] {
        self.about.get(&edge).map_or(&[], Vec::as_slice)
    }

    /// Puts pieces in the place of a triangle. `known`: vertices of corners on edges.
    pub fn split(&mut self, t: u32, pieces: &[[Corner; 3]], known: &mut HashMap<(Edge, u32), u32>) {
        self.leave(t);
        let whole = self.scene.triangles[t as usize];
        let on = self.on_input[t as usize];
        let of_input = self.input_corners[on.triangle as usize];
        let mut within: HashMap<[u64; 2], u32> = HashMap::new();
        for (i, piece) in pieces.iter().enumerate() {
            let (mut triangle, mut part) = (whole, on);
            for (k, corner) in piece.iter().enumerate() {
                let (Corner::OnEdge(.., at) | Corner::Within(at)) = *corner else {
                    let Corner::Old(old) = *corner else { continue };
                    triangle.vertices[k] = whole.vertices[old];
                    lay(&mut triangle, k, &whole, |uv| uv[old]);
                    part.corners[k] = on.corners[old];
                    continue;
                };
                part.corners[k] = in_whole(on.corners, at);
                lay(&mut triangle, k, &whole, |uv| at_uv(uv, at.to_array()));
                let vertices = &mut self.scene.vertices;
                let new = || {
                    vertices.push(at_place(of_input, part.corners[k]));
                    (vertices.len() - 1) as u32
                };
                triangle.vertices[k] = match *corner {
                    Corner::OnEdge(edge, number, _) => {
                        *known.entry((edge, number)).or_insert_with(new)
                    }
                    _ => *(within.entry(at.to_array().map(f64::to_bits))).or_insert_with(new),
                };
            }
            let place = match i {
                0 => t,
                _ => self.scene.triangles.len() as u32,
            };
            if i == 0 {
                self.scene.triangles[t as usize] = triangle;
                self.on_input[t as usize] = part;
            } else {
                self.scene.triangles.push(triangle);
                self.on_input.push(part);
            }
            self.enter(place);
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
        let middle_of = |uv: [[f32; 2]; 3]| [0, 1].map(|i| 0.5 * (uv[k][i] + uv[next][i]));
        let at = [0, 1].map(|i| 0.5 * (on.corners[k][i] + on.corners[next][i]));
        let mut halves = [(old, on), (old, on)];
        for ((triangle, on), corner) in halves.iter_mut().zip([next, k]) {
            triangle.vertices[corner] = middle;
            lay(triangle, corner, &old, middle_of);
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

pub(super) fn edge(a: u32, b: u32) -> Edge {
    [a.min(b), a.max(b)]
}

/// Gives a corner of a piece its texture coordinates, found from those of the whole.
fn lay(
    piece: &mut Triangle,
    corner: usize,
    whole: &Triangle,
    find: impl Fn([[f32; 2]; 3]) -> [f32; 2],
) {
    piece.uv[corner] = find(whole.uv);
    for (own, of_whole) in [
        (&mut piece.emission_uv, whole.emission_uv),
        (&mut piece.light_uv, whole.light_uv),
    ] {
        if let (Some(own), Some(of_whole)) = (own, of_whole) {
            own[corner] = find(of_whole);
        }
    }
}

/// Barycentric coordinates in the input of those in a part of it.
fn in_whole(part: [[f64; 2]; 3], at: DVec2) -> [f64; 2] {
    let [a, b, c] = part.map(DVec2::from_array);
    (a + at.x * (b - a) + at.y * (c - a)).to_array()
}

pub(super) fn length(corners: [DVec3; 3], k: usize) -> f64 {
    corners[k].distance(corners[(k + 1) % 3])
}

/// The longest edge, from corner k to the next; of equals the one with the highest vertices, so
/// that both triangles of an edge agree.
pub(super) fn longest(corners: [DVec3; 3], vertices: [u32; 3]) -> usize {
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
