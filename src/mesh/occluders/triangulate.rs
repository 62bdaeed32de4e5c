//! Triangles of a region from its outline.
//!
//! A constrained Delaunay triangulation keeps the corners where an outline is straight; ear
//! clipping would drop them.

use std::collections::HashSet;

use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation};

use super::outline::Outline;
use super::region::Region;
use crate::mesh::elements::Elements;

/// Largest relative difference of the triangles' area from the elements'.
const AREA: f64 = 1e-6;

/// Triangles over the outline's vertices, wound as the region's elements. None where the outline
/// crosses itself or the area differs from the region's.
pub fn triangulate(
    elements: &Elements,
    region: &Region,
    outline: &Outline,
) -> Option<Vec<[u32; 3]>> {
    let vertices = outline.vertices();
    let place = |v: u32| elements.vertices[v as usize];
    let origin = place(*vertices.first()?);
    let normal = elements.normal[region.item as usize];
    let (x, y) = normal.any_orthonormal_pair();
    let flat = |&v: &u32| {
        let d = place(v) - origin;
        Point2::new(d.dot(x), d.dot(y))
    };
    let local = |v: u32| vertices.binary_search(&v).expect("the outline's own");
    let edges: HashSet<[usize; 2]> = outline
        .edges
        .iter()
        .map(|&(a, b)| [local(a), local(b)])
        .collect();
    let mut constraints: Vec<_> = edges.iter().map(|&[a, b]| [a.min(b), a.max(b)]).collect();
    constraints.sort_unstable();
    constraints.dedup();
    let count = constraints.len();
    let mut crossed = false;
    let mesh = ConstrainedDelaunayTriangulation::<Point2<f64>>::try_bulk_load_cdt(
        vertices.iter().map(flat).collect(),
        constraints,
        |_| crossed = true,
    )
    .ok()?;
    if crossed || mesh.num_vertices() != vertices.len() || mesh.num_constraints() != count {
        return None;
    }
    // Flood fill from the left of the outline's edges, bounded by its edges.
    let mut inside = vec![false; mesh.num_all_faces()];
    let mut faces = Vec::new();
    for edge in mesh.directed_edges() {
        let ends = [edge.from().index(), edge.to().index()];
        if edges.contains(&ends) {
            faces.push(edge.face().as_inner()?);
        }
    }
    let mut triangles = Vec::new();
    let mut area = 0.0;
    while let Some(face) = faces.pop() {
        if std::mem::replace(&mut inside[face.index()], true) {
            continue;
        }
        for edge in face.adjacent_edges() {
            if !edge.is_constraint_edge() {
                faces.push(edge.rev().face().as_inner()?);
            }
        }
        let corners = face.vertices().map(|v| vertices[v.index()]);
        let [a, b, c] = corners.map(place);
        area += 0.5 * (b - a).cross(c - a).dot(normal);
        triangles.push(corners);
    }
    let wanted: f64 = region
        .members
        .iter()
        .map(|&e| elements.area[e as usize])
        .sum();
    ((area - wanted).abs() <= AREA * wanted && triangles.len() < region.members.len())
        .then_some(triangles)
}
