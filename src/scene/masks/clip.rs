//! The lines of a mask in a triangle.

use glam::DVec2;

use super::AlphaMask;
use super::lines::{Plane, PointAt};
use crate::scene::Triangle;

/// Texels: a line as close to an edge or a corner runs through it. Of a shorter edge a part.
const CLOSE: f64 = 1.0 / 32.0;
const OF_EDGE: f64 = 1.0 / 256.0;

/// Places on edges are multiples of one over this: those between both ends of an edge are exact.
pub(super) const STEPS: f64 = (1 << 30) as f64;

/// The corners of the edges of a [`Shape`].
pub(super) const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [0, 2]];

/// A corner of a piece of a triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Node {
    Corner(usize),
    /// Edge, and the steps from its lower vertex.
    OnEdge(usize, u32),
    Within(PointAt),
}

/// A triangle with its corners in the order of their vertices, so that neighbours and the back of a
/// triangle find the same.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    pub vertices: [u32; 3],
    pub uv: [[f32; 2]; 3],
    pub emission_uv: Option<[[f32; 2]; 3]>,
    pub light_uv: Option<[[f32; 2]; 3]>,
    /// Whether the order turned it over.
    pub is_turned: bool,
}

impl Shape {
    pub fn new(triangle: &Triangle) -> Self {
        let mut order = [0, 1, 2];
        order.sort_by_key(|&k| triangle.vertices[k]);
        let [a, b, _] = order;
        Self {
            vertices: order.map(|k| triangle.vertices[k]),
            uv: order.map(|k| triangle.uv[k]),
            emission_uv: (triangle.emission_uv).map(|uv| order.map(|k| uv[k])),
            light_uv: (triangle.light_uv).map(|uv| order.map(|k| uv[k])),
            is_turned: (b + 3 - a) % 3 != 1,
        }
    }
}

/// A triangle on a mask.
pub(super) struct Clip<'a> {
    plane: &'a Plane,
    /// Texels.
    pub corners: [DVec2; 3],
    /// Twice the area; negative where the corners turn the other way.
    pub turn: f64,
}

/// What lies in a triangle.
#[derive(Debug, Default)]
pub(super) struct Clipped {
    /// From one node to the other.
    pub lines: Vec<[Node; 2]>,
    /// Nodes on edges; also of lines that lie outside.
    pub on_edges: Vec<(usize, u32)>,
}

impl<'a> Clip<'a> {
    pub fn new(mask: &AlphaMask, plane: &'a Plane, shape: &Shape) -> Self {
        let corners @ [a, b, c] = shape.uv.map(|uv| mask.in_texels(uv));
        Self {
            plane,
            corners,
            turn: (b - a).perp_dot(c - a),
        }
    }

    /// Whether it covers an area of the mask, so that lines can lead through it.
    pub fn is_flat(&self) -> bool {
        let [a, b, c] = self.corners;
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        !self.turn.is_finite() || self.turn.abs() <= 1e-9 * longest * longest
    }

    /// As close to an edge, texels.
    pub fn close(&self, edge: usize) -> f64 {
        CLOSE.min(OF_EDGE * self.length(edge))
    }

    pub fn length(&self, edge: usize) -> f64 {
        let [from, to] = EDGES[edge].map(|k| self.corners[k]);
        from.distance(to)
    }

    /// Distance of a place from the line of an edge, within the triangle positive, and the share of
    /// the way along it.
    fn off_edge(&self, edge: usize, p: DVec2) -> (f64, f64) {
        let [i, j] = EDGES[edge];
        let (from, way) = (self.corners[i], self.corners[j] - self.corners[i]);
        let third = self.corners[3 - i - j];
        let inward = way.perp_dot(third - from).signum();
        let length = way.length();
        let off = inward * way.perp_dot(p - from) / length;
        (off, way.dot(p - from) / (length * length))
    }

    /// The node at a share of the way along an edge; a corner close to its ends, none beyond.
    fn on_edge(&self, edge: usize, share: f64) -> Option<Node> {
        let close = self.close(edge) / self.length(edge);
        if !(-close..=1.0 + close).contains(&share) {
            return None;
        }
        let [from, to] = EDGES[edge];
        Some(match share {
            share if share < close => Node::Corner(from),
            share if share > 1.0 - close => Node::Corner(to),
            share => Node::OnEdge(edge, (share * STEPS).round() as u32),
        })
    }

    /// The lines in the triangle; None where it covers too many repeats.
    pub fn lines(&self) -> Option<Clipped> {
        let [a, b, c] = self.corners;
        let margin = DVec2::splat(CLOSE);
        let (low, high) = (a.min(b).min(c) - margin, a.max(b).max(c) + margin);
        let mut clipped = Clipped::default();
        for ends in self.plane.about(low, high)? {
            let places = ends.map(|at| self.plane.place(at));
            let off = [0, 1, 2].map(|edge| places.map(|p| self.off_edge(edge, p)));
            let close = [0, 1, 2].map(|edge| self.close(edge));
            let is_outside = |edge: usize| {
                off[edge]
                    .iter()
                    .all(|(distance, _)| *distance < -close[edge])
            };
            if (0..3).any(is_outside) {
                continue;
            }
            // With the place along the segment.
            let mut nodes: Vec<(f64, Node)> = Vec::new();
            for (end, &at) in ends.iter().enumerate() {
                let is_on = |edge: usize| off[edge][end].0.abs() <= close[edge];
                let on = (0..3).filter(|&edge| is_on(edge));
                let before = nodes.len();
                nodes.extend(
                    on.filter_map(|edge| Some((end as f64, self.on_edge(edge, off[edge][end].1)?))),
                );
                let is_within = (0..3).all(|edge| off[edge][end].0 > close[edge]);
                if nodes.len() == before && is_within {
                    nodes.push((end as f64, Node::Within(at)));
                }
            }
            for edge in 0..3 {
                let [(one, at_one), (other, at_other)] = off[edge];
                let crosses = one.abs().min(other.abs()) > close[edge] && one * other < 0.0;
                if crosses {
                    let along = one / (one - other);
                    let share = at_one + (at_other - at_one) * along;
                    nodes.extend(self.on_edge(edge, share).map(|node| (along, node)));
                }
            }
            nodes.sort_by(|(one, _), (other, _)| one.total_cmp(other));
            clipped
                .on_edges
                .extend(nodes.iter().filter_map(|(_, node)| match node {
                    Node::OnEdge(edge, step) => Some((*edge, *step)),
                    _ => None,
                }));
            if let (Some(&(_, first)), Some(&(_, last))) = (nodes.first(), nodes.last())
                && first != last
            {
                clipped.lines.push([first, last]);
            }
        }
        Some(clipped)
    }

    /// Barycentric coordinates of a node: weights of the second and third corner.
    pub fn weights(&self, node: Node) -> DVec2 {
        match node {
            Node::Within(at) => {
                let [a, b, c] = self.corners;
                let p = self.plane.place(at) - a;
                DVec2::new(p.perp_dot(c - a), (b - a).perp_dot(p)) / self.turn
            }
            node => at_edge(node),
        }
    }
}

/// The same of a corner or a node on an edge.
pub(super) fn at_edge(node: Node) -> DVec2 {
    let corner = |k: usize| [DVec2::ZERO, DVec2::X, DVec2::Y][k];
    match node {
        Node::Corner(k) => corner(k),
        Node::OnEdge(edge, step) => {
            let share = f64::from(step) / STEPS;
            let [from, to] = EDGES[edge].map(corner);
            from * (1.0 - share) + to * share
        }
        Node::Within(_) => DVec2::ZERO,
    }
}
