//! What is joined to what: disjoint sets (Tarjan 1975), and edges that triangles share.

use std::collections::HashMap;

use rayon::prelude::*;

/// Things by number, each in one group; at first each in its own.
pub struct Groups {
    parent: Vec<u32>,
}

impl Groups {
    pub fn new(count: usize) -> Self {
        Self {
            parent: (0..count as u32).collect(),
        }
    }

    /// Makes one group of those of two things.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    fn root(&mut self, mut v: u32) -> u32 {
        while self.parent[v as usize] != v {
            self.parent[v as usize] = self.parent[self.parent[v as usize] as usize];
            v = self.parent[v as usize];
        }
        v
    }

    /// A number from 0 on for the group of each of these things, in the order in which they come.
    pub fn numbers(&mut self, of: impl Iterator<Item = u32>) -> Vec<u32> {
        let mut known: HashMap<u32, u32> = HashMap::new();
        of.map(|v| {
            let next = known.len() as u32;
            *known.entry(self.root(v)).or_insert(next)
        })
        .collect()
    }
}

/// An edge of a triangle. Ordered by its ends, then by triangle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Edge {
    /// Vertices, the lower first.
    pub ends: [u32; 2],
    pub triangle: u32,
    /// From corner `side` of the triangle to the next.
    pub side: u8,
    /// Whether it runs from the lower end to the other.
    pub ascends: bool,
}

/// The edges of triangles, those with the same ends one after another.
pub fn edges(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<Edge> {
    let mut edges: Vec<Edge> = (0..)
        .zip(triangles)
        .flat_map(|(triangle, [a, b, c])| {
            (0..)
                .zip([[a, b], [b, c], [c, a]])
                .map(move |(side, [p, q])| Edge {
                    ends: [p.min(q), p.max(q)],
                    triangle,
                    side,
                    ascends: p < q,
                })
        })
        .collect();
    edges.par_sort_unstable();
    edges
}

/// Runs of edges with the same ends.
pub fn shared(edges: &[Edge]) -> impl Iterator<Item = &[Edge]> {
    edges.chunk_by(|a, b| a.ends == b.ends)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_are_numbered_as_they_come() {
        let mut groups = Groups::new(6);
        groups.join(4, 1);
        groups.join(5, 4);
        groups.join(3, 2);
        let numbers = groups.numbers([3, 0, 5, 2, 1, 4].into_iter());
        assert_eq!(numbers, [0, 1, 2, 0, 2, 2]);
    }

    /// Two triangles of a square share an edge, along which they run to and fro.
    #[test]
    fn shared_edges_come_together() {
        let edges = edges([[0, 1, 2], [0, 2, 3]].into_iter());
        let runs: Vec<_> = shared(&edges).filter(|run| run.len() > 1).collect();
        let [&[one, other]] = runs[..] else {
            panic!("{runs:?}");
        };
        assert_eq!((one.ends, one.triangle, one.side), ([0, 2], 0, 2));
        assert_eq!((other.triangle, other.side), (1, 0));
        assert!(!one.ascends && other.ascends);
    }
}
