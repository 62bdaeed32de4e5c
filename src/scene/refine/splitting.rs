//! Cuts along lines: each triangle that lines lead through becomes several, and no corner lies on
//! an edge.

use std::collections::{BTreeMap, HashMap};

use glam::DVec2;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::cutting::{Corner, Cutting, Edge, edge};
use super::outlines::{Line, clipped};

/// Barycentric coordinates of new corners are multiples of one over this: sums and halves of them
/// are exact, so that both triangles of an edge find the same place.
const STEPS: f64 = (1 << 20) as f64;

/// An end of a line as close to a corner or an edge, in barycentric coordinates, lies in it; two
/// on one edge are one.
const CLOSE: f64 = 1.0 / 64.0;

/// An end of a line in a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum End {
    Corner(usize),
    /// Edge from corner k to the next; share of the way from its lower vertex, in steps.
    OnEdge(usize, u32),
    Within(DVec2),
}

/// Corners on the edges of triangles, in steps from the lower vertex.
type OnEdges = HashMap<Edge, Vec<u32>>;

/// Cuts along `lines`, `[triangle of the input]`; false, and nothing is cut, where there would be
/// more than `most` triangles.
pub(super) fn split_along(cutting: &mut Cutting, lines: &[Vec<Line>], most: usize) -> bool {
    let mut on_edges = OnEdges::new();
    // In the order of the triangles.
    let mut within: BTreeMap<u32, Vec<[End; 2]>> = BTreeMap::new();
    for t in 0..cutting.scene.triangles.len() {
        let of = &lines[cutting.on_input[t].triangle as usize];
        let ends: Vec<[End; 2]> = of
            .iter()
            .filter_map(|line| clipped(line.map(|p| in_part(cutting, t, p))))
            .map(|line| line.map(|p| end(cutting, t, p, &mut on_edges)))
            .filter(|[one, other]| one != other)
            .collect();
        if !ends.is_empty() {
            within.insert(t as u32, ends);
        }
    }
    cutting.know_edges();
    for edge in on_edges.keys() {
        for &t in cutting.about(*edge) {
            within.entry(t).or_default();
        }
    }
    let pieces: Vec<(u32, Vec<[Corner; 3]>)> = within
        .iter()
        .map(|(&t, ends)| (t, pieces(cutting, t, ends, &on_edges)))
        .collect();
    let more: usize = pieces.iter().map(|(_, of)| of.len() - 1).sum();
    if cutting.scene.triangles.len() + more > most {
        return false;
    }
    let mut known = HashMap::new();
    for (t, of) in pieces {
        cutting.split(t, &of, &mut known);
    }
    true
}

/// Barycentric coordinates in triangle t of those in its triangle of the input.
fn in_part(cutting: &Cutting, t: usize, p: DVec2) -> DVec2 {
    let [a, b, c] = cutting.on_input[t].corners.map(DVec2::from_array);
    let (b, c, p) = (b - a, c - a, p - a);
    DVec2::new(p.perp_dot(c), b.perp_dot(p)) / b.perp_dot(c)
}

fn end(cutting: &Cutting, t: usize, p: DVec2, on_edges: &mut OnEdges) -> End {
    let weights = [1.0 - p.x - p.y, p.x, p.y];
    if let Some(k) = (0..3).find(|&k| weights[k] > 1.0 - CLOSE) {
        return End::Corner(k);
    }
    let vertices = cutting.scene.triangles[t].vertices;
    // The edge from corner k to the next lies across the one after.
    let Some(k) = (0..3).find(|&k| weights[(k + 2) % 3] < CLOSE) else {
        return End::Within((p * STEPS).round() / STEPS);
    };
    let next = (k + 1) % 3;
    let along = weights[next] / (weights[k] + weights[next]);
    let along = match vertices[k] < vertices[next] {
        true => along,
        false => 1.0 - along,
    };
    if !(CLOSE..=1.0 - CLOSE).contains(&along) {
        return End::Corner(if (along > 0.5) == (vertices[k] < vertices[next]) {
            next
        } else {
            k
        });
    }
    let step = (along * STEPS).round() as u32;
    let known = on_edges
        .entry(edge(vertices[k], vertices[next]))
        .or_default();
    let apart = |&of: &u32| of.abs_diff(step);
    let nearest = known.iter().copied().min_by_key(apart);
    let step = match nearest.filter(|of| f64::from(apart(of)) < CLOSE * STEPS) {
        Some(known) => known,
        None => {
            known.push(step);
            step
        }
    };
    End::OnEdge(k, step)
}

/// The triangles that a triangle becomes.
fn pieces(cutting: &Cutting, t: u32, ends: &[[End; 2]], on_edges: &OnEdges) -> Vec<[Corner; 3]> {
    let vertices = cutting.scene.triangles[t as usize].vertices;
    let at_corner = [DVec2::ZERO, DVec2::X, DVec2::Y];
    let mut corners: Vec<(DVec2, Corner)> =
        (0..3).map(|k| (at_corner[k], Corner::Old(k))).collect();
    let place = |k: usize, step: u32| {
        let next = (k + 1) % 3;
        let share = f64::from(step) / STEPS;
        let (low, high) = match vertices[k] < vertices[next] {
            true => (k, next),
            false => (next, k),
        };
        at_corner[low] * (1.0 - share) + at_corner[high] * share
    };
    for k in 0..3 {
        let of = edge(vertices[k], vertices[(k + 1) % 3]);
        for &step in on_edges.get(&of).into_iter().flatten() {
            let at = place(k, step);
            corners.push((at, Corner::OnEdge(of, step, at)));
        }
    }
    let at = |end: &End| match *end {
        End::Corner(k) => at_corner[k],
        End::OnEdge(k, step) => place(k, step),
        End::Within(at) => at,
    };
    let lines: Vec<Line> = ends
        .iter()
        .map(|ends| [at(&ends[0]), at(&ends[1])])
        .collect();
    triangulated(&corners, &lines)
        .or_else(|| triangulated(&corners, &[]))
        .unwrap_or_else(|| vec![[0, 1, 2].map(Corner::Old)])
}

/// The triangle of the first three corners, cut so that all of `corners` are corners and all of
/// `lines` edges; None where rounding would turn a piece over.
fn triangulated(corners: &[(DVec2, Corner)], lines: &[Line]) -> Option<Vec<[Corner; 3]>> {
    let mut mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::new();
    let mut known: HashMap<[u64; 2], Corner> = HashMap::new();
    let point = |p: DVec2| Point2::new(p.x, p.y);
    for &(at, corner) in corners {
        mesh.insert(point(at)).ok()?;
        known.insert(at.to_array().map(f64::to_bits), corner);
    }
    for &[from, to] in lines {
        let [from, to] = [mesh.insert(point(from)).ok()?, mesh.insert(point(to)).ok()?];
        mesh.add_constraint_and_split(from, to, |middle| middle);
    }
    let mut pieces = Vec::new();
    for face in mesh.inner_faces() {
        let places = face.positions().map(|p| DVec2::new(p.x, p.y));
        let corners = places.map(|at| {
            let at = (at * STEPS).round() / STEPS;
            let key = at.to_array().map(f64::to_bits);
            (at, known.get(&key).copied().unwrap_or(Corner::Within(at)))
        });
        let [a, b, c] = corners.map(|(at, _)| at);
        if (b - a).perp_dot(c - a) <= 0.0 {
            return None;
        }
        pieces.push(corners.map(|(_, corner)| corner));
    }
    (!pieces.is_empty()).then_some(pieces)
}
