//! The same surfaces in fewer triangles: what was cut finely for its light, in one plane, is joined
//! again where only its shape counts.
//!
//! Vertices go one by one to a neighbour along an edge, with all triangles about them: within a
//! plane, or along a straight line that planes meet in or end at. No triangle leaves its plane and
//! none turns over, so that what is covered stays the same; vertices are shared as before, so that
//! no gap opens.

use glam::DVec3;

use crate::scene::Scene;

/// How far what counts as one plane or line may be off it, in sizes of all that is merged: far
/// below what single precision leaves of the coordinates.
const OFF: f64 = 1e-9;
/// Vertices with more triangles about them stay until others have gone.
const MOST_ABOUT: usize = 64;
/// Passes over all vertices; fewer are made once no vertex goes.
const MOST_PASSES: usize = 100;

/// A triangle of those that are left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Merged<K> {
    /// Counter-clockwise as before.
    pub vertices: [u32; 3],
    pub kind: K,
}

/// The triangles of `scene` that have a kind; only those of one kind are joined.
pub fn merged<K: Copy + PartialEq>(
    scene: &Scene,
    kind: impl Fn(usize) -> Option<K>,
) -> Vec<Merged<K>> {
    let kinds = (0..scene.triangles.len()).filter_map(|i| Some((i, kind(i)?)));
    let triangles: Vec<Merged<K>> = kinds
        .map(|(i, kind)| Merged {
            vertices: scene.triangles[i].vertices,
            kind,
        })
        .collect();
    let mut sheet = Sheet::new(&scene.vertices, triangles);
    for _ in 0..MOST_PASSES {
        if !sheet.pass() {
            break;
        }
    }
    sheet.left()
}

struct Sheet<'a, K> {
    places: &'a [DVec3],
    triangles: Vec<Merged<K>>,
    /// Whether a triangle has not gone, `[triangle]`.
    is_left: Vec<bool>,
    /// Triangles about each vertex, `[vertex]`.
    about: Vec<Vec<u32>>,
    /// Vertices that nothing has changed about since they could not go, `[vertex]`.
    stays: Vec<bool>,
    /// Length that counts as none.
    off: f64,
}

impl<'a, K: Copy + PartialEq> Sheet<'a, K> {
    fn new(places: &'a [DVec3], triangles: Vec<Merged<K>>) -> Self {
        let mut about = vec![Vec::new(); places.len()];
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for (i, triangle) in triangles.iter().enumerate() {
            for v in triangle.vertices {
                about[v as usize].push(i as u32);
                low = low.min(places[v as usize]);
                high = high.max(places[v as usize]);
            }
        }
        Self {
            places,
            is_left: vec![true; triangles.len()],
            stays: about.iter().map(Vec::is_empty).collect(),
            off: OFF * (high - low).max_element().max(0.0),
            triangles,
            about,
        }
    }

    /// Whether any vertex went. Of neighbours only one does in a pass, so that triangles stay about
    /// as long as they are wide.
    fn pass(&mut self) -> bool {
        let mut waits = vec![false; self.places.len()];
        let mut any = false;
        for v in 0..self.places.len() as u32 {
            if waits[v as usize] || self.stays[v as usize] {
                continue;
            }
            if self.about[v as usize].len() > MOST_ABOUT {
                continue;
            }
            let ring = self.ring(v);
            let Some(to) = self.target(v, &ring) else {
                self.stays[v as usize] = true;
                continue;
            };
            self.collapse(v, to);
            for &w in &ring {
                waits[w as usize] = true;
                self.stays[w as usize] = false;
            }
            self.stays[v as usize] = true;
            any = true;
        }
        any
    }

    fn corners(&self, triangle: u32) -> [DVec3; 3] {
        let vertices = self.triangles[triangle as usize].vertices;
        vertices.map(|v| self.places[v as usize])
    }

    /// Neighbours of a vertex, each once.
    fn ring(&self, v: u32) -> Vec<u32> {
        let about = self.about[v as usize].iter();
        let mut ring: Vec<u32> = about
            .flat_map(|&t| self.triangles[t as usize].vertices)
            .filter(|&w| w != v)
            .collect();
        ring.sort_unstable();
        ring.dedup();
        ring
    }

    /// Whether the triangles about the edge from `v` to `w` are two of one kind, side by side in one
    /// plane.
    fn is_inner(&self, v: u32, w: u32) -> bool {
        let has_w = |&&t: &&u32| self.triangles[t as usize].vertices.contains(&w);
        let mut beside = self.about[v as usize].iter().filter(has_w);
        let (Some(&a), Some(&b), None) = (beside.next(), beside.next(), beside.next()) else {
            return false;
        };
        let forward = |t: u32| {
            let [i, j, k] = self.triangles[t as usize].vertices;
            [(i, j), (j, k), (k, i)].contains(&(v, w))
        };
        let in_plane_of = |t: u32, other: u32| {
            let [p, q, r] = self.corners(t);
            let normal = (q - p).cross(r - p).normalize_or_zero();
            let far = |c: DVec3| normal.dot(c - p).abs();
            normal != DVec3::ZERO && self.corners(other).map(far).iter().all(|&f| f <= self.off)
        };
        let one_kind = self.triangles[a as usize].kind == self.triangles[b as usize].kind;
        one_kind && forward(a) != forward(b) && in_plane_of(a, b) && in_plane_of(b, a)
    }

    /// The neighbour that a vertex goes to; none if it is a corner of what it lies on.
    fn target(&self, v: u32, ring: &[u32]) -> Option<u32> {
        let outer: Vec<u32> = ring
            .iter()
            .copied()
            .filter(|&w| !self.is_inner(v, w))
            .collect();
        let candidates = match outer[..] {
            [] => ring,
            [w, x] if self.is_between(v, w, x) => &outer,
            _ => return None,
        };
        let quality = |&to: &u32| Some((self.quality(v, to)?, to));
        let best = candidates.iter().filter_map(quality);
        best.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, to)| to)
    }

    fn is_between(&self, v: u32, w: u32, x: u32) -> bool {
        let [v, w, x] = [v, w, x].map(|i| self.places[i as usize]);
        let along = (x - w).normalize_or_zero();
        let aside = (v - w) - along * along.dot(v - w);
        (w - v).dot(x - v) < 0.0 && aside.length() <= self.off
    }

    /// The least height over length of the triangles that there would be if `v` went to `to`; None
    /// if one left its plane or turned over.
    fn quality(&self, v: u32, to: u32) -> Option<f64> {
        let place = self.places[to as usize];
        let mut least = f64::INFINITY;
        let (mut before, mut after) = (0.0, 0.0);
        for &t in &self.about[v as usize] {
            let vertices = self.triangles[t as usize].vertices;
            let corners = self.corners(t);
            let [a, b, c] = corners;
            let normal = (b - a).cross(c - a);
            before += normal.length();
            if vertices.contains(&to) {
                continue;
            }
            let [p, q, r] =
                std::array::from_fn(|i| if vertices[i] == v { place } else { corners[i] });
            let turned = (q - p).cross(r - p);
            let unit = normal.normalize_or_zero();
            let longest = [q - p, r - q, p - r].map(DVec3::length_squared);
            let longest = longest.into_iter().fold(0.0, f64::max);
            let height = turned.length() / longest.sqrt();
            let lies = unit.dot(place - a).abs() <= self.off;
            if !lies || unit.dot(turned) <= 0.0 || height <= 1e3 * self.off {
                return None;
            }
            after += turned.length();
            least = least.min(height * height / longest);
        }
        let same = (before - after).abs() <= 1e-9 * before;
        same.then_some(least)
    }

    fn collapse(&mut self, v: u32, to: u32) {
        for t in std::mem::take(&mut self.about[v as usize]) {
            let vertices = self.triangles[t as usize].vertices;
            if vertices.contains(&to) {
                self.is_left[t as usize] = false;
                for w in vertices.into_iter().filter(|&w| w != v) {
                    self.about[w as usize].retain(|&other| other != t);
                }
            } else {
                self.triangles[t as usize].vertices = vertices.map(|w| if w == v { to } else { w });
                self.about[to as usize].push(t);
            }
        }
    }

    fn left(self) -> Vec<Merged<K>> {
        let all = self.triangles.into_iter().zip(self.is_left);
        all.filter_map(|(t, is_left)| is_left.then_some(t))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::sources::triangle_area;
    use crate::scene::shapes::Shapes;

    /// A room of 7 by 7 quadrangles a wall.
    fn room() -> Scene {
        let mut shapes = Shapes {
            scene: Scene::default(),
        };
        shapes.room(DVec3::ZERO, DVec3::new(2.0, 1.0, 3.0), 7, 0);
        shapes.scene
    }

    fn corners(scene: &Scene, t: &Merged<bool>) -> [DVec3; 3] {
        t.vertices.map(|v| scene.vertices[v as usize])
    }

    #[test]
    fn a_room_is_twelve_triangles() {
        let scene = room();
        assert_eq!(scene.triangles.len(), 6 * 7 * 7 * 2);
        let found = merged(&scene, |_| Some(true));
        assert_eq!(found.len(), 12);
        let area: f64 = found
            .iter()
            .map(|t| triangle_area(corners(&scene, t)))
            .sum();
        assert!((area - 22.0).abs() < 1e-12, "{area}");
    }

    /// Whether some triangle holds a place, and lies as the other does.
    fn covers(scene: &Scene, found: &[Merged<bool>], at: DVec3, normal: DVec3) -> usize {
        let holds = |t: &&Merged<bool>| {
            let [a, b, c] = corners(scene, t);
            let own = (b - a).cross(c - a).normalize();
            own.dot(normal) > 1.0 - 1e-12
                && own.dot(at - a).abs() < 1e-12
                && [(a, b), (b, c), (c, a)]
                    .iter()
                    .all(|(p, q)| (*q - *p).cross(at - *p).dot(own) > 0.0)
        };
        found.iter().filter(holds).count()
    }

    /// A checkerboard of kinds is kept as it is, square by square, and every place is covered as
    /// before, once.
    #[test]
    fn kinds_and_places_stay() {
        let scene = room();
        for squares in [1, 7, 100] {
            let kind = |i: usize| (i / 2 / squares) % 2 == 1;
            let found = merged(&scene, |i| Some(kind(i)));
            assert!(found.len() > 12 && found.len() <= 6 * 7 * 7 * 2);
            assert_eq!(
                found.len() == 6 * 7 * 7 * 2,
                squares == 1,
                "{}",
                found.len()
            );
            for (i, triangle) in scene.triangles.iter().enumerate() {
                let [a, b, c] = scene.corners(triangle);
                let at = 0.41 * a + 0.33 * b + 0.26 * c;
                let normal = (b - a).cross(c - a).normalize();
                let of_kind: Vec<_> = found
                    .iter()
                    .copied()
                    .filter(|t| t.kind == kind(i))
                    .collect();
                assert_eq!(covers(&scene, &of_kind, at, normal), 1, "{i}");
                assert_eq!(covers(&scene, &found, at, normal), 1, "{i}");
            }
        }
    }

    /// Edges are traversed in both directions as often as before: no gap and no T-junction.
    #[test]
    fn no_gap_opens() {
        let mut scene = room();
        // A bent wall: its vertices stay, also those on its rim.
        for v in &mut scene.vertices {
            if v.z == 0.0 {
                v.z = 0.1 * (v.x * (2.0 - v.x) * v.y * (1.0 - v.y));
            }
        }
        let found = merged(&scene, |_| Some(true));
        assert!(
            found.len() > 7 * 7 * 2 && found.len() < 250,
            "{}",
            found.len()
        );
        let mut edges = std::collections::HashMap::new();
        for t in &found {
            let [a, b, c] = t.vertices;
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *edges.entry((from, to)).or_insert(0) += 1;
            }
        }
        for (&(from, to), &count) in &edges {
            assert_eq!(count, 1);
            assert_eq!(edges.get(&(to, from)), Some(&1));
        }
    }

    /// A plate with a hole keeps both outlines.
    #[test]
    fn holes_stay() {
        let scene = room();
        // The first wall without its middle.
        let holds = |i: usize| i < 7 * 7 * 2 && i / 2 != 24;
        let found = merged(&scene, |i| holds(i).then_some(true));
        assert_eq!(found.len(), 8);
        let area = |t: [DVec3; 3]| triangle_area(t);
        let whole: f64 = found.iter().map(|t| area(corners(&scene, t))).sum();
        let all = scene
            .triangles
            .iter()
            .enumerate()
            .filter(|(i, _)| holds(*i));
        let before: f64 = all.map(|(_, t)| area(scene.corners(t))).sum();
        assert!((whole - before).abs() < 1e-12);
    }
}
