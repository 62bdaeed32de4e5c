//! Which triangles belong to which mesh, by name.

use std::collections::{HashMap, HashSet};

use serde::{Deserialize, Serialize};

/// A run of triangles of one mesh. Runs of one name are one mesh.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshRange {
    /// The object of an OBJ file, its group where it has no objects, the node of a glTF file; of
    /// faces outside of those, the file.
    pub name: String,
    /// Index of the first triangle in the scene as it was read, before it was refined.
    pub first: u32,
    pub count: u32,
}

/// A run of triangles in a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Part {
    pub name: String,
    /// Its first triangle; it ends where the next part begins.
    pub first: usize,
}

/// Counts one more triangle, at the end of all, to the mesh of a name.
pub(super) fn add(ranges: &mut Vec<MeshRange>, name: &str) {
    let first = ranges.last().map_or(0, |last| last.first + last.count);
    match ranges.last_mut().filter(|last| last.name == name) {
        Some(last) => last.count += 1,
        None => ranges.push(MeshRange {
            name: name.to_owned(),
            first,
            count: 1,
        }),
    }
}

/// The name of the mesh that a triangle belongs to.
pub(super) fn name(ranges: &[MeshRange], triangle: u32) -> Option<&str> {
    of(ranges, triangle).map(|index| ranges[index].name.as_str())
}

/// The ranges after triangles were cut: each is of the mesh of that which it was cut from.
pub(super) fn of_cut(ranges: &[MeshRange], from: &[u32]) -> Vec<MeshRange> {
    let mut cut = Vec::new();
    for name in from.iter().filter_map(|&t| name(ranges, t)) {
        add(&mut cut, name);
    }
    cut
}

/// The range that a triangle lies in.
fn of(ranges: &[MeshRange], triangle: u32) -> Option<usize> {
    let after = ranges.partition_point(|range| range.first <= triangle);
    let index = after.checked_sub(1)?;
    (triangle - ranges[index].first < ranges[index].count).then_some(index)
}

/// Names, no two of which are alike.
#[derive(Debug, Default)]
pub(super) struct Names {
    taken: HashSet<String>,
    /// The last number given to each name.
    numbers: HashMap<String, usize>,
}

impl Names {
    /// The name, with a number if it is taken.
    pub fn free(&mut self, name: &str) -> String {
        if self.taken.insert(name.to_owned()) {
            return name.to_owned();
        }
        let number = self.numbers.entry(name.to_owned()).or_insert(1);
        loop {
            *number += 1;
            let numbered = format!("{name}.{number}");
            if self.taken.insert(numbered.clone()) {
                return numbered;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_numbered_and_runs_joined() {
        let mut names = Names::default();
        let free = ["a", "a.2", "a", "b", "a"].map(|name| names.free(name));
        assert_eq!(free, ["a", "a.2", "a.3", "b", "a.4"]);
        let mut ranges = Vec::new();
        for name in ["a", "a", "b", "a"] {
            add(&mut ranges, name);
        }
        let runs: Vec<_> = ranges.iter().map(|r| (r.first, r.count)).collect();
        assert_eq!(runs, [(0, 2), (2, 1), (3, 1)]);
        let found = [0, 1, 2, 3, 4].map(|t| of(&ranges, t));
        assert_eq!(found, [Some(0), Some(0), Some(1), Some(2), None]);
    }
}
