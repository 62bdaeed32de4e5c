//! Triangles that cast shadows, as a tree of boxes that shaders walk.

use std::time::Duration;

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::{Boundable, BvhBuildParams};

use crate::constants::{LEAF_TRIANGLES, RELIEF_NODE};
use crate::structs::{ShadowNode, ShadowOccluder, ShadowTriangle};

/// Boxes are wider than their triangles by this share of the greatest coordinate, 2⁻²⁰: the walk's
/// places on a ray of at most twice that length are right to 2⁻²¹ of it.
const BOX_MARGIN: f32 = 1.0 / (1 << 20) as f32;

/// A triangle that casts a shadow.
pub trait Casts: Copy {
    fn corners(&self) -> [Vec3; 3];

    /// Whether ways pass over it as far as the relief goes that they begin on.
    fn has_relief(&self) -> bool;
}

impl Casts for ShadowTriangle {
    fn corners(&self) -> [Vec3; 3] {
        [self.a, self.b, self.c]
    }

    fn has_relief(&self) -> bool {
        self.relief == 1
    }
}

impl Casts for ShadowOccluder {
    fn corners(&self) -> [Vec3; 3] {
        [self.a, self.b, self.c]
    }

    fn has_relief(&self) -> bool {
        false
    }
}

impl ShadowNode {
    /// Of a leaf.
    pub fn triangles(&self) -> std::ops::Range<usize> {
        let leaf = self.leaf & !RELIEF_NODE;
        let first = leaf / LEAF_TRIANGLES;
        first as usize..(first + leaf % LEAF_TRIANGLES) as usize
    }
}

/// Triangles in boxes, in the order of `shared/shadow_rays.glsl`.
#[derive(Debug)]
pub struct ShadowTree<T = ShadowTriangle> {
    nodes: Vec<ShadowNode>,
    pub triangles: Vec<T>,
}

impl<T> Default for ShadowTree<T> {
    /// Of no triangle.
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            triangles: Vec::new(),
        }
    }
}

struct Bounds([Vec3; 3], f32);

impl Boundable for Bounds {
    fn aabb(&self) -> Aabb {
        let Self(corners, margin) = self;
        let mut bounds = Aabb::from_points(&corners.map(Into::into));
        bounds.min -= *margin;
        bounds.max += *margin;
        bounds
    }
}

/// The tree of no triangle, for shaders.
const EMPTY: [ShadowNode; 1] = [ShadowNode {
    low: Vec3::ZERO,
    skip: 0,
    high: Vec3::ZERO,
    leaf: 0,
}];

impl<T: Casts> ShadowTree<T> {
    /// Triangles with a corner that is no finite number are left out.
    pub fn new(mut triangles: Vec<T>) -> Self {
        triangles.retain(|t| t.corners().iter().all(|v| v.is_finite()));
        if triangles.is_empty() {
            return Self::default();
        }
        let largest = triangles
            .iter()
            .flat_map(Casts::corners)
            .map(|v| v.abs().max_element())
            .fold(0.0, f32::max);
        let margin = BOX_MARGIN * largest;
        let bounds: Vec<_> = triangles
            .iter()
            .map(|t| Bounds(t.corners(), margin))
            .collect();
        let params = BvhBuildParams::medium_build();
        let bvh = build_bvh2(&bounds, params, &mut Duration::default());
        let mut tree = Self::flat(&bvh, &triangles);
        tree.mark_relief();
        tree
    }

    /// Marks the nodes in which all triangles have a relief.
    fn mark_relief(&mut self) {
        for at in (0..self.nodes.len()).rev() {
            let own = self.nodes[at].triangles();
            let mut all = self.triangles[own].iter().all(Casts::has_relief);
            let mut child = at + 1;
            while child < self.nodes[at].skip as usize {
                all &= self.nodes[child].leaf & RELIEF_NODE != 0;
                child = self.nodes[child].skip as usize;
            }
            if all {
                self.nodes[at].leaf |= RELIEF_NODE;
            }
        }
    }

    /// Of lists as those of another.
    pub fn of_lists(nodes: Vec<ShadowNode>, triangles: Vec<T>) -> Self {
        Self { nodes, triangles }
    }

    /// At least one.
    pub fn nodes(&self) -> &[ShadowNode] {
        match &self.nodes[..] {
            [] => &EMPTY,
            nodes => nodes,
        }
    }

    fn flat(bvh: &Bvh2, triangles: &[T]) -> Self {
        let mut tree = Self::default();
        // Nodes still to come, and nodes whose last descendant has just come.
        enum Step {
            Enter(u32),
            Leave(usize),
        }
        let mut steps = vec![Step::Enter(0)];
        while let Some(step) = steps.pop() {
            match step {
                Step::Leave(node) => tree.nodes[node].skip = tree.nodes.len() as u32,
                Step::Enter(node) => {
                    let node = &bvh.nodes[node as usize];
                    let mut push = |leaf| {
                        let place = tree.nodes.len();
                        tree.nodes.push(ShadowNode {
                            low: node.aabb.min.into(),
                            skip: place as u32 + 1,
                            high: node.aabb.max.into(),
                            leaf,
                        });
                        place
                    };
                    let first = node.first_index;
                    if node.is_leaf() {
                        let own = first as usize..(first + node.prim_count) as usize;
                        if node.prim_count >= LEAF_TRIANGLES {
                            steps.push(Step::Leave(push(0)));
                        }
                        for few in bvh.primitive_indices[own].chunks(LEAF_TRIANGLES as usize - 1) {
                            let first = tree.triangles.len() as u32;
                            push(first * LEAF_TRIANGLES + few.len() as u32);
                            let few = few.iter().map(|&t| triangles[t as usize]);
                            tree.triangles.extend(few);
                        }
                    } else {
                        steps.push(Step::Leave(push(0)));
                        steps.extend([Step::Enter(first + 1), Step::Enter(first)]);
                    }
                }
            }
        }
        tree
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;

    #[test]
    fn nodes_of_reliefs_alone_are_marked() {
        let triangles = (0..300).map(|i| {
            let at = Vec3::new((i % 20) as f32, (i / 20) as f32, 0.0);
            ShadowTriangle {
                a: at,
                b: at + Vec3::X,
                c: at + Vec3::Y,
                relief: (i % 20 < 12 && i != 44).into(),
                ..ShadowTriangle::zeroed()
            }
        });
        let tree = ShadowTree::new(triangles.collect());
        let mut marked = 0;
        for (at, node) in tree.nodes().iter().enumerate() {
            let within = tree.nodes()[at..node.skip as usize].iter();
            let all = within
                .flat_map(|n| &tree.triangles[n.triangles()])
                .all(|t| t.relief == 1);
            assert_eq!(node.leaf & RELIEF_NODE != 0, all, "{at}: {node:?}");
            marked += usize::from(all);
        }
        assert!(marked > 25 && marked < tree.nodes().len() - 25, "{marked}");
    }
}
