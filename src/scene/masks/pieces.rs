//! A triangle cut along lines, and which of its pieces are opaque.

use std::collections::{HashMap, HashSet};

use glam::DVec2;
use spade::handles::FixedVertexHandle;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::clip::Node;

/// Lines and nodes of a triangle, with their barycentric coordinates.
pub(super) struct Outline {
    pub nodes: Vec<(Node, DVec2)>,
    /// Pairs of `nodes`: the opaque side lies to the left, or to the right where it is turned.
    pub lines: Vec<[usize; 2]>,
    pub is_turned: bool,
}

/// Places in a piece at which it is asked whether it is opaque: weights of its second and third
/// corner.
const PLACES: [[f64; 2]; 4] = [
    [1.0 / 3.0, 1.0 / 3.0],
    [1.0 / 6.0, 1.0 / 6.0],
    [2.0 / 3.0, 1.0 / 6.0],
    [1.0 / 6.0, 2.0 / 3.0],
];

/// Whether most of a piece is opaque.
pub(super) fn is_mostly(corners: [DVec2; 3], opaque: impl Fn(DVec2) -> bool) -> bool {
    let [a, b, c] = corners;
    let at = |[v, w]: [f64; 2]| opaque(a + v * (b - a) + w * (c - a));
    let count = PLACES.into_iter().filter(|&of| at(of)).count();
    // Of two and two, the middle decides.
    count > 2 || count == 2 && at(PLACES[0])
}

impl Outline {
    /// The opaque pieces of the triangle (0, 0), (1, 0), (0, 1), whose corners are the first three
    /// nodes; indices of nodes. `opaque` answers for places. None where no triangulation is found.
    pub fn opaque_pieces(&self, opaque: impl Fn(DVec2) -> bool) -> Option<Vec<[usize; 3]>> {
        let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
        let mut handles: Vec<FixedVertexHandle> = Vec::with_capacity(self.nodes.len());
        // Nodes by vertex of the mesh: of several in one place the first.
        let mut node_of: Vec<usize> = Vec::with_capacity(self.nodes.len());
        for (n, (_, at)) in self.nodes.iter().enumerate() {
            let handle = mesh.insert(Point2::new(at.x, at.y)).ok()?;
            if handle.index() == node_of.len() {
                node_of.push(n);
            }
            handles.push(handle);
        }
        let mut directed = HashSet::new();
        for &[from, to] in &self.lines {
            let [from, to] = [handles[from], handles[to]];
            // Where rounding has moved one line over another, places decide what is opaque.
            if from != to && mesh.can_add_constraint(from, to) {
                mesh.add_constraint(from, to);
                directed.insert([from.index(), to.index()]);
            }
        }
        let mut pieces = Vec::new();
        for face in mesh.inner_faces() {
            let corners = face.vertices().map(|v| v.fix().index());
            let votes: Vec<bool> = (0..3)
                .filter_map(|k| {
                    let [from, to] = [corners[k], corners[(k + 1) % 3]];
                    let along = directed.contains(&[from, to]);
                    let against = directed.contains(&[to, from]);
                    (along != against).then_some(along != self.is_turned)
                })
                .collect();
            let nodes = corners.map(|v| node_of[v]);
            let is_opaque = match votes.first() {
                Some(vote) if votes.iter().all(|other| other == vote) => *vote,
                _ => is_mostly(nodes.map(|n| self.nodes[n].1), &opaque),
            };
            if is_opaque {
                pieces.push(nodes);
            }
        }
        Some(pieces)
    }
}

/// Nodes in the order in which they are met first.
#[derive(Default)]
pub(super) struct Nodes {
    pub list: Vec<(Node, DVec2)>,
    known: HashMap<Node, usize>,
}

impl Nodes {
    pub fn add(&mut self, node: Node, at: impl Fn(Node) -> DVec2) -> usize {
        *self.known.entry(node).or_insert_with(|| {
            self.list.push((node, at(node)));
            self.list.len() - 1
        })
    }
}
