//! Where relief ends: ways to lights leave it there.

use std::collections::HashMap;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use crate::scene::Scene;

/// Borders so far from a triangle count for it, in heights of the relief: ways that rise by 4° and
/// more leave the relief before.
const REACH: f64 = 16.0;

/// Borders of a triangle, at most; the nearest.
const MOST: usize = 8;

/// The relief of a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    /// Others go on where they share an edge, but their borders do not count.
    pub surface: u32,
    /// From its lowest to its highest place, scene units.
    pub rise: f64,
}

/// The straight borders of the relief near each triangle.
pub struct Borders {
    /// Of each triangle's, and their number: `[triangle + 1]`.
    starts: Vec<usize>,
    list: Vec<Border>,
}

/// Shares of a triangle's corners 1 and 2 at both ends of a border, between which and beyond the
/// triangle they are linear. The relief lies to the left, the shares taken for x and y.
pub type Border = [DVec2; 2];

impl Borders {
    /// Of edges that no other triangle with relief has. Edges are compared by place, so that
    /// vertices need not be shared; one that others have in parts ends the relief, too.
    pub fn new(scene: &Scene, relief: impl Fn(usize) -> Option<Relief> + Sync) -> Self {
        let lines = lines(scene, &relief);
        let grid = Grid::new(scene, &relief, &lines);
        let near: Vec<Vec<Border>> = (0..scene.triangles.len())
            .into_par_iter()
            .map(|i| match (lines.is_empty(), relief(i)) {
                (false, Some(own)) => near(scene, i, own, &lines, &grid),
                _ => Vec::new(),
            })
            .collect();
        let mut starts = vec![0];
        let mut list = Vec::new();
        for borders in near {
            list.extend(borders);
            starts.push(list.len());
        }
        Self { starts, list }
    }

    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    pub fn of(&self, triangle: usize) -> &[Border] {
        &self.list[self.starts[triangle]..self.starts[triangle + 1]]
    }
}

/// A straight border.
struct Line {
    from: DVec3,
    to: DVec3,
    /// A place of the relief beside it.
    inside: DVec3,
    normal: DVec3,
    surface: u32,
    /// The edges that it consists of.
    edges: Vec<[DVec3; 2]>,
}

fn lines(scene: &Scene, relief: &impl Fn(usize) -> Option<Relief>) -> Vec<Line> {
    // The first vertex at a place stands for all.
    let mut places: HashMap<[u64; 3], u32> = HashMap::new();
    let mut known = vec![u32::MAX; scene.vertices.len()];
    let mut place = |v: u32| {
        let known = &mut known[v as usize];
        if *known == u32::MAX {
            // The sum makes -0 and 0 equal.
            let at = (scene.vertices[v as usize] + DVec3::ZERO).to_array();
            *known = *places.entry(at.map(f64::to_bits)).or_insert(v);
        }
        *known
    };
    let mut edges = Vec::new();
    for (i, triangle) in scene.triangles.iter().enumerate() {
        if relief(i).is_some() {
            let at = triangle.vertices.map(&mut place);
            for k in 0..3 {
                let (a, b) = (at[k], at[(k + 1) % 3]);
                edges.push(((a.min(b), a.max(b)), i, k, [a, b]));
            }
        }
    }
    edges.par_sort_unstable();
    let lone: Vec<_> = edges
        .chunk_by(|a, b| a.0 == b.0)
        .filter_map(|same| match same {
            &[(_, i, k, at)] => Some((i, k, at)),
            _ => None,
        })
        .collect();
    // What goes on straight from one to the next is one line.
    let corners = |e: usize| {
        let (i, k, _) = lone[e];
        let at = scene.corners(&scene.triangles[i]);
        [at[k], at[(k + 1) % 3], at[(k + 2) % 3]]
    };
    let surface = |e: usize| relief(lone[e].0).map_or(u32::MAX, |own| own.surface);
    let mut begins: HashMap<u32, Vec<usize>> = HashMap::new();
    for (e, (_, _, [a, _])) in lone.iter().enumerate() {
        begins.entry(*a).or_default().push(e);
    }
    let next = |e: usize| match begins.get(&lone[e].2[1]).map(Vec::as_slice) {
        Some(&[next]) if surface(next) == surface(e) => {
            let [[a, b, _], [_, c, _]] = [corners(e), corners(next)];
            let (own, other) = (b - a, c - b);
            let straight = own.cross(other).length() <= 1e-6 * own.length() * other.length();
            (straight && own.dot(other) > 0.0).then_some(next)
        }
        _ => None,
    };
    let mut first = vec![true; lone.len()];
    for e in 0..lone.len() {
        if let Some(next) = next(e) {
            first[next] = false;
        }
    }
    let line = |e: usize| {
        let [from, mut to, inside] = corners(e);
        let mut edges = vec![[from, to]];
        let mut last = e;
        while let Some(e) = next(last) {
            let [a, b, _] = corners(e);
            edges.push([a, b]);
            (last, to) = (e, b);
        }
        Line {
            from,
            to,
            inside,
            normal: (to - from).cross(inside - from).normalize_or_zero(),
            surface: surface(e),
            edges,
        }
    };
    (0..lone.len()).filter(|&e| first[e]).map(line).collect()
}

/// Cells of space with the borders in reach of each.
struct Grid {
    size: f64,
    cells: HashMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    fn new(scene: &Scene, relief: &impl Fn(usize) -> Option<Relief>, lines: &[Line]) -> Self {
        let longest = |corners: &[DVec3]| {
            let side = |i: usize| corners[i].distance(corners[(i + 1) % corners.len()]);
            (0..corners.len()).map(side).fold(0.0, f64::max)
        };
        let (mut reach, mut size) = (0.0_f64, f64::MIN_POSITIVE);
        if !lines.is_empty() {
            for (i, triangle) in scene.triangles.iter().enumerate() {
                if let Some(own) = relief(i) {
                    reach = reach.max(REACH * own.rise);
                    size = size.max(longest(&scene.corners(triangle)));
                }
            }
        }
        let mut grid = Self {
            size: size.max(reach),
            cells: HashMap::new(),
        };
        for (number, line) in (0..).zip(lines) {
            for &[a, b] in &line.edges {
                for cell in grid.cells_of(a.min(b) - reach, a.max(b) + reach) {
                    let of_cell = grid.cells.entry(cell).or_default();
                    if of_cell.last() != Some(&number) {
                        of_cell.push(number);
                    }
                }
            }
        }
        grid
    }

    fn cells_of(&self, low: DVec3, high: DVec3) -> impl Iterator<Item = [i64; 3]> + use<> {
        let cell = |at: DVec3| (at / self.size).to_array().map(|x| x.floor() as i64);
        let ([x, y, z], [u, v, w]) = (cell(low), cell(high));
        (x..=u).flat_map(move |x| (y..=v).flat_map(move |y| (z..=w).map(move |z| [x, y, z])))
    }
}

fn near(scene: &Scene, i: usize, own: Relief, lines: &[Line], grid: &Grid) -> Vec<Border> {
    let [a, b, c] = scene.corners(&scene.triangles[i]);
    let (ab, ac) = (b - a, c - a);
    let whole = ab.cross(ac);
    let square = whole.length_squared();
    if square == 0.0 {
        return Vec::new();
    }
    let normal = whole / square.sqrt();
    let middle = (a + b + c) / 3.0;
    let radius = [a, b, c].map(|at| at.distance(middle));
    let radius = radius.into_iter().fold(0.0, f64::max);
    let shares = |at: DVec3| {
        let from = at - a;
        DVec2::new(from.cross(ac).dot(whole), ab.cross(from).dot(whole)) / square
    };
    let mut candidates: Vec<u32> = grid
        .cells_of(a.min(b).min(c), a.max(b).max(c))
        .filter_map(|cell| grid.cells.get(&cell))
        .flatten()
        .copied()
        .collect();
    candidates.sort_unstable();
    candidates.dedup();
    let mut found: Vec<(f64, Border)> = candidates
        .iter()
        .map(|&number| &lines[number as usize])
        .filter(|line| line.surface == own.surface && line.normal.dot(normal) > 0.5)
        .filter_map(|line| {
            let along = line.to - line.from;
            let share = (middle - line.from).dot(along) / along.length_squared();
            let nearest = line.from + along * share.clamp(0.0, 1.0);
            let way = nearest - middle;
            let far = (way.length() - radius).max(0.0);
            // Borders of other sheets lie above or below.
            let off = way.dot(normal).abs();
            if far > REACH * own.rise || off > own.rise.max(0.5 * way.length()) {
                return None;
            }
            let [from, to, inside] = [line.from, line.to, line.inside].map(shares);
            let left = (to - from).perp_dot(inside - from);
            match left {
                0.0 => None,
                _ if left > 0.0 => Some((far, [from, to])),
                _ => Some((far, [to, from])),
            }
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().take(MOST).map(|(_, end)| end).collect()
}

#[cfg(test)]
mod tests {
    use glam::{DVec2, DVec3};

    use super::{Borders, Relief};
    use crate::scene::shapes::Shapes;

    /// Two squares of 2 × 2 cells side by side, of which the second may have no relief, or one of
    /// its own. Welded or not, each triangle finds the straight sides within reach, with the relief
    /// to their left.
    #[test]
    fn an_edge_is_an_end_where_no_relief_goes_on() {
        let mut shapes = Shapes::default();
        let material = shapes.material(0.5, 0.0);
        let (x, y) = (DVec3::X, DVec3::Y);
        for corner in [DVec3::ZERO, x] {
            shapes.quad(corner, x, y, (2, 2), material);
        }
        for welded in [false, true] {
            if welded {
                shapes.weld();
            }
            let scene = &shapes.scene;
            for (second, rise) in [
                (None, 1.0),
                (Some(0), 1.0),
                (Some(1), 1.0),
                (Some(0), 0.001),
            ] {
                let surface = |i: usize| if i < 8 { Some(0) } else { second };
                let borders = Borders::new(scene, |i| {
                    surface(i).map(|surface| Relief { surface, rise })
                });
                for i in 0..16 {
                    let [a, b, c] = scene.corners(&scene.triangles[i]);
                    let at = |s: DVec2| a + (b - a) * s.x + (c - a) * s.y;
                    let inside = DVec2::splat(1.0 / 3.0);
                    let mut found: Vec<[DVec3; 2]> = Vec::new();
                    for &[from, to] in borders.of(i) {
                        assert!((to - from).perp_dot(inside - from) > 0.0);
                        found.push([at(from), at(to)]);
                    }
                    let own = [a, b, c];
                    let wanted = sides(surface(i), second).into_iter().filter(|[from, to]| {
                        let off = (*to - *from).normalize();
                        let far = |p: &DVec3| (*p - *from).cross(off).length();
                        rise == 1.0 || own.iter().any(|p| far(p) < 1e-9)
                    });
                    let wanted: Vec<[DVec3; 2]> = wanted.collect();
                    assert_eq!(found.len(), wanted.len(), "{i}, {second:?}, {found:?}");
                    for side in wanted {
                        let same = |s: &[DVec3; 2]| (0..2).all(|k| s[k].distance(side[k]) < 1e-9);
                        assert!(found.iter().any(same), "{i}: {side:?} of {found:?}");
                    }
                }
            }
        }
    }

    /// Counter-clockwise.
    fn sides(own: Option<u32>, second: Option<u32>) -> Vec<[DVec3; 2]> {
        let at = |x: f64, y: f64| DVec3::new(x, y, 0.0);
        let (width, first) = match (own, second) {
            (None, _) => return Vec::new(),
            (_, None) => (1.0, 0.0),
            (Some(0), Some(0)) => (2.0, 0.0),
            (Some(0), _) => (1.0, 0.0),
            _ => (2.0, 1.0),
        };
        let corners = [
            at(first, 0.0),
            at(width, 0.0),
            at(width, 1.0),
            at(first, 1.0),
        ];
        let all = (0..4).map(|k| [corners[k], corners[(k + 1) % 4]]);
        // Between two reliefs there is no end.
        let shared = |s: &[DVec3; 2]| second == Some(1) && s[0].x == 1.0 && s[1].x == 1.0;
        all.filter(|s| !shared(s)).collect()
    }
}
