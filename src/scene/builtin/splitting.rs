//! A mesh cut to an exact number of triangles.

use std::collections::{BinaryHeap, HashMap};

use glam::DVec3;

use crate::scene::assemble::{Mesh, MeshTriangle};

/// Splits edges at their middle until there are `count` triangles: next the edge that is longest
/// beside `size` at its middle, but before an edge the longest one of a triangle that it belongs to
/// (Rivara 1997), so that no angle becomes small.
///
/// An edge of two triangles gives two more, one of a border one more. The new triangles have the
/// material of the one that was cut, and no texture coordinates.
///
/// # Panics
/// A mesh that has more triangles already; one without a border that lacks an odd number; two
/// triangles on one side of an edge.
pub(super) fn split(mesh: &mut Mesh, count: usize, size: impl Fn(DVec3) -> f64) {
    assert!(
        mesh.triangles.len() <= count,
        "{} triangles cannot become {count}",
        mesh.triangles.len()
    );
    let mut edges = Edges {
        beside: HashMap::new(),
        heap: BinaryHeap::new(),
        size,
    };
    for (index, triangle) in mesh.triangles.iter().enumerate() {
        for edge in edges_of(triangle.corners) {
            let before = edges.beside.insert(edge, index);
            assert!(
                before.is_none(),
                "{before:?} and {index} on one side of an edge"
            );
        }
    }
    let all: Vec<[u32; 2]> = edges.beside.keys().copied().collect();
    for [a, b] in all {
        if a < b || !edges.beside.contains_key(&[b, a]) {
            edges.push(mesh, [a, b]);
        }
    }
    while mesh.triangles.len() < count {
        let Some((_, a, b)) = edges.heap.pop() else {
            unreachable!("a mesh has edges, and one that lacks an odd number a border");
        };
        let both = [[a, b], [b, a]];
        let sides = |of: [[u32; 2]; 2]| of.iter().filter(|e| edges.beside.contains_key(*e)).count();
        match (sides(both), count - mesh.triangles.len()) {
            // It was split on the way of another.
            (0, _) | (2, 1) => {}
            (_, 1) => edges.halve(mesh, [a, b]),
            _ => {
                let first = edges.longest_of_path(mesh, [a, b]);
                edges.halve(mesh, first[0]);
                if !first.contains(&[a, b]) {
                    edges.push(mesh, [a, b]);
                }
            }
        }
    }
}

/// The edges of a mesh that is being cut.
struct Edges<S> {
    /// The triangle to the left of an edge from one vertex to the other.
    beside: HashMap<[u32; 2], usize>,
    /// Square of length over size, and the vertices, the lower first.
    heap: BinaryHeap<(u64, u32, u32)>,
    size: S,
}

impl<S: Fn(DVec3) -> f64> Edges<S> {
    fn push(&mut self, mesh: &Mesh, [a, b]: [u32; 2]) {
        let [p, q] = [a, b].map(|v| mesh.positions[v as usize]);
        let length = p.distance_squared(q) / (self.size)((p + q) / 2.0).powi(2);
        // What is not negative sorts as its bits do.
        self.heap.push((length.to_bits(), a.min(b), a.max(b)));
    }

    /// Goes from an edge to the longest of a triangle beside it, as long as that is longer, and
    /// returns it in both directions.
    fn longest_of_path(&self, mesh: &Mesh, mut edge: [u32; 2]) -> [[u32; 2]; 2] {
        let length = |[a, b]: [u32; 2]| {
            mesh.positions[a as usize].distance_squared(mesh.positions[b as usize])
        };
        loop {
            let both = [edge, [edge[1], edge[0]]];
            let triangles = both.iter().filter_map(|side| self.beside.get(side));
            let longer = triangles
                .flat_map(|&t| edges_of(mesh.triangles[t].corners))
                .find(|&other| length(other) > length(edge) * (1.0 + 1e-9));
            match longer {
                Some(other) => edge = other,
                None => return both,
            }
        }
    }

    /// Splits an edge and the triangles beside it.
    fn halve(&mut self, mesh: &mut Mesh, [a, b]: [u32; 2]) {
        let Mesh {
            positions,
            triangles,
            ..
        } = &mut *mesh;
        let middle = positions.len() as u32;
        positions.push((positions[a as usize] + positions[b as usize]) / 2.0);
        let mut new = vec![[a, middle], [middle, b]];
        for [from, to] in [[a, b], [b, a]] {
            let Some(index) = self.beside.remove(&[from, to]) else {
                continue;
            };
            let MeshTriangle {
                corners, material, ..
            } = triangles[index];
            let across = corners[(0..3)
                .find(|&k| corners[k] != a && corners[k] != b)
                .unwrap_or(0)];
            let part = |corners| MeshTriangle {
                corners,
                uv: None,
                emission_uv: None,
                light_uv: None,
                material,
            };
            triangles[index] = part([from, middle, across]);
            let added = triangles.len();
            triangles.push(part([middle, to, across]));
            self.beside.insert([from, middle], index);
            self.beside.insert([middle, across], index);
            self.beside.insert([across, from], index);
            self.beside.insert([middle, to], added);
            self.beside.insert([to, across], added);
            self.beside.insert([across, middle], added);
            new.push([middle, across]);
        }
        for edge in new {
            self.push(mesh, edge);
        }
    }
}

fn edges_of([a, b, c]: [u32; 3]) -> [[u32; 2]; 3] {
    [[a, b], [b, c], [c, a]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triangles with an edge in common, 4 × 1.
    fn sheet() -> Mesh {
        let positions = [[0, 0], [4, 0], [4, 1], [0, 1]];
        let positions = positions.map(|[x, y]| DVec3::new(f64::from(x), f64::from(y), 0.0));
        Mesh::bare(positions.to_vec(), vec![[0, 1, 2], [0, 2, 3]])
    }

    fn sides(mesh: &Mesh, t: &MeshTriangle) -> [DVec3; 3] {
        let [a, b, c] = t.corners.map(|v| mesh.positions[v as usize]);
        [b - a, c - b, a - c]
    }

    #[test]
    fn every_count_is_reached_and_the_area_stays() {
        for count in [2, 3, 4, 5, 99, 100, 1_001] {
            let mut mesh = sheet();
            split(&mut mesh, count, |p| 0.1 + p.x);
            assert_eq!(mesh.triangles.len(), count);
            let double: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [u, v, _] = sides(&mesh, t);
                    u.cross(v).z
                })
                .sum();
            assert!((double - 8.0).abs() < 1e-12, "{count}: {double}");
            // An edge within the sheet has a triangle on either side.
            let edges: Vec<[u32; 2]> = mesh
                .triangles
                .iter()
                .flat_map(|t| edges_of(t.corners))
                .collect();
            for &[a, b] in &edges {
                let [p, q] = [a, b].map(|v| mesh.positions[v as usize]);
                let on_rim = [
                    (p.x, q.x, 0.0),
                    (p.x, q.x, 4.0),
                    (p.y, q.y, 0.0),
                    (p.y, q.y, 1.0),
                ]
                .iter()
                .any(|(p, q, rim)| p == rim && q == rim);
                assert!(on_rim || edges.contains(&[b, a]), "{count}: {p} to {q}");
            }
        }
    }

    #[test]
    fn sizes_are_followed_and_no_angle_becomes_small() {
        let mut mesh = sheet();
        split(&mut mesh, 4_000, |p| 0.2 + p.x);
        let (mut sharpest, mut ratios) = (f64::INFINITY, [f64::INFINITY, 0.0_f64]);
        for t in &mesh.triangles {
            let s = sides(&mesh, t);
            for k in 0..3 {
                sharpest = sharpest.min(s[k].angle_between(-s[(k + 1) % 3]).to_degrees());
            }
            let x = t
                .corners
                .map(|v| mesh.positions[v as usize].x)
                .iter()
                .sum::<f64>()
                / 3.0;
            let longest = s.map(DVec3::length).into_iter().fold(0.0, f64::max) / (0.2 + x);
            ratios = [ratios[0].min(longest), ratios[1].max(longest)];
        }
        println!("least angle {sharpest:.1} degrees, edge over size {ratios:.4?}");
        // Half of the least angle that was there, 14.04 degrees (Rosenberg and Stenger 1975).
        assert!(sharpest > 7.0, "{sharpest}");
        assert!(ratios[1] < 3.5 * ratios[0], "{ratios:?}");
    }
}
