//! What lies close in front of a triangle.

use std::time::Duration;

use glam::DVec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use super::{Least, Scene};
use crate::math::groups::Groups;

/// Surfaces about a place.
pub(super) struct Surroundings {
    pub bvh: Bvh2,
    /// Corners and unit normal of each triangle of the input.
    pub facets: Vec<Facet>,
    /// Of each triangle of the input: its shell, which holds all that it is joined to.
    shell: Vec<u32>,
    /// Diagonal of the box of each shell.
    diagonals: Vec<f64>,
    /// Height above a plane below which a place lies in it.
    pub flat: f64,
}

/// A triangle and its unit normal.
pub(super) struct Facet {
    pub corners: [DVec3; 3],
    pub normal: DVec3,
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
    pub fn new(scene: &Scene) -> Self {
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
        let facet = |&Bounds(corners): &Bounds| {
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a).normalize_or_zero();
            Facet { corners, normal }
        };
        Self {
            facets: bounds.iter().map(facet).collect(),
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

    pub fn diagonal(&self, input: usize) -> f64 {
        self.diagonals[self.shell[input] as usize]
    }

    /// Gives each triangle of the input whose box comes within `reach` of that of these corners.
    pub fn about(&self, corners: [DVec3; 3], reach: f64, mut each: impl FnMut(usize)) {
        let mut near = Bounds(corners).aabb();
        near.min -= reach as f32;
        near.max += reach as f32;
        let mut nodes = vec![0];
        while let Some(n) = nodes.pop() {
            let node = &self.bvh.nodes[n];
            let apart = node.aabb.min.cmpgt(near.max) | node.aabb.max.cmplt(near.min);
            let first = node.first_index as usize;
            if apart.any() {
                continue;
            }
            if !node.is_leaf() {
                nodes.extend([first, first + 1]);
                continue;
            }
            let own = &self.bvh.primitive_indices[first..first + node.prim_count as usize];
            own.iter().for_each(|&t| each(t as usize));
        }
    }

    /// The size of a piece of triangle `input` that what lies in front of it asks for, `size` at
    /// most: no longer than other surfaces are off.
    pub fn size_at(
        &self,
        scene: &Scene,
        input: usize,
        [a, b, c]: [DVec3; 3],
        size: f64,
        least: Least,
    ) -> f64 {
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
                if self.faces(middle, normal, other) {
                    let distance = middle.distance(nearest(middle, other));
                    let least = match self.shell[o] == self.shell[input] {
                        true => least.same,
                        false => least.apart,
                    };
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
    let mut groups = Groups::new(scene.vertices.len());
    for t in &scene.triangles {
        let [a, b, c] = t.vertices;
        groups.join(a, b);
        groups.join(a, c);
    }
    groups.numbers(scene.triangles.iter().map(|t| t.vertices[0]))
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
