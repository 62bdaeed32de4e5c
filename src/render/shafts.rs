//! Places with nothing between them and the lights: their samples need no shadow rays.
//!
//! A shaft (Haines and Wallace 1991) contains all shadow rays from a part of a triangle, or from
//! the relief over one, to a lamp. Here it is bounded by planes about the convex hull of the rays'
//! starts and ends. A triangle of which nothing is left between the planes, or whose own plane has
//! the hull on one side, blocks no ray. Of a lamp that is below the horizon no ray is asked.

use glam::{DVec3, Vec3};

use super::convex::{Side, lowest_plane, outline};
use super::shaft_lamps::{Lamp, MOST_LAMPS, lamps};
use super::shaft_starts::{MARGIN_ABOVE, Starts};
use crate::constants::{PART_HIDDEN, PART_OPEN, PART_UNSURE};
use crate::mesh::shadow_tree::ShadowTree;
use crate::passes::types::{ShadowNode, ShadowTriangle};
use crate::picture::Projection;
use crate::scene::Scene;

/// Margin of a shaft's planes, as a share of the greatest coordinate: the traversal of the tree
/// tests nothing further from a ray, see `BOX_MARGIN`.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;

/// Shadow casters and lamps.
pub struct Shafts {
    tree: ShadowTree,
    lamps: Vec<Lamp>,
    margin: f64,
}

/// The triangle that last stood in the way to each lamp: often it does so again, near where it
/// did, and then no other is looked for.
#[derive(Default)]
pub struct Blockers([Option<usize>; MOST_LAMPS]);

impl Shafts {
    /// Shafts for `tree`, whose triangles are `scene`'s relative to the eye of `projection`.
    pub fn new(tree: ShadowTree, scene: &Scene, projection: &Projection) -> Self {
        let seen = |p: DVec3| (p - projection.eye) / projection.unit;
        let lamps = lamps(scene, seen);
        let corners = tree.triangles.iter().flat_map(|t| [t.a, t.b, t.c]);
        let largest = corners
            .map(|v| v.abs().max_element())
            .fold(0.0_f32, f32::max);
        Self {
            margin: MARGIN * f64::from(largest),
            tree,
            lamps,
        }
    }

    /// Shafts by which no triangle is open.
    pub fn closed() -> Self {
        Self {
            tree: ShadowTree::default(),
            lamps: Vec::new(),
            margin: 0.0,
        }
    }

    /// Whether there are no shafts: then every part is PART_UNSURE.
    pub fn is_empty(&self) -> bool {
        self.lamps.is_empty()
    }

    /// PART_… of where shadow rays start: hidden where no light shines towards it, or all rays are
    /// blocked, each lamp's by one triangle; open where none is. It does not depend on `blockers`.
    pub fn state(&self, starts: &Starts, Blockers(blockers): &mut Blockers) -> u32 {
        if self.is_empty() {
            return PART_UNSURE;
        }
        let mut shining: Vec<_> = (self.lamps.iter().zip(blockers))
            .map(|(lamp, blocker)| (lamp, self.ends(starts, lamp), blocker))
            .filter(|(_, ends, _)| !ends.is_empty())
            .collect();
        if shining.is_empty() {
            return PART_HIDDEN;
        }
        let mut all = shining.iter_mut();
        if all.all(|(lamp, ends, blocker)| self.is_clear(starts, lamp, ends, blocker)) {
            return PART_OPEN;
        }
        let mut all = shining.iter_mut();
        match all.all(|(lamp, _, blocker)| self.is_covered(&starts.points, lamp, blocker)) {
            true => PART_HIDDEN,
            false => PART_UNSURE,
        }
    }

    /// Points whose hull holds the ends of rays to a lamp: none where it shines away from the
    /// starts, or is below their horizon.
    fn ends(&self, starts: &Starts, lamp: &Lamp) -> Vec<DVec3> {
        let shines_away = lamp.plane.as_ref().is_some_and(|plane| {
            let behind = |p: &DVec3| plane.normal.dot(*p) < plane.offset - 2.0 * self.margin;
            starts.points.iter().all(behind)
        });
        match &starts.lit {
            _ if shines_away => Vec::new(),
            Some(lit) => lit.above_horizon(&lamp.ends, 2.0 * self.margin),
            None => lamp.ends.clone(),
        }
    }

    /// Whether one triangle stands on all ways from the starts to a lamp, those to parts of it
    /// below the horizon too: a place that sees a rim of a lamp and none of its points counts as
    /// lit. Places where ways between two hulls pass a plane lie in the hull of those of ways
    /// between the corners.
    fn is_covered(&self, starts: &[DVec3], lamp: &Lamp, blocker: &mut Option<usize>) -> bool {
        let middle = |points: &[DVec3]| points.iter().sum::<DVec3>() / points.len() as f64;
        let (from, to) = (middle(starts), middle(&lamp.ends));
        let covers = |t: &ShadowTriangle| {
            let plane = CasterPlane::new(t);
            let mut ways = starts
                .iter()
                .flat_map(|&s| lamp.ends.iter().map(move |&e| (s, e)));
            t.relief == 0
                && plane.is_between(from, to, self.margin)
                && ways.all(|(s, e)| plane.is_between(s, e, self.margin))
        };
        self.finds(|node| enters(node, from, to), covers, blocker)
    }

    /// Whether a triangle is what is looked for, of those in the nodes that `enter` lets pass; the
    /// one that was last found is tried first.
    fn finds(
        &self,
        enter: impl Fn(&ShadowNode) -> bool,
        is_found: impl Fn(&ShadowTriangle) -> bool,
        last: &mut Option<usize>,
    ) -> bool {
        let triangles = &self.tree.triangles;
        if last.is_some_and(|i| is_found(&triangles[i])) {
            return true;
        }
        let nodes = self.tree.nodes();
        let mut at = 0;
        while let Some(node) = nodes.get(at) {
            if !enter(node) {
                at = node.skip as usize;
                continue;
            }
            if let Some(i) = node.triangles().find(|&i| is_found(&triangles[i])) {
                *last = Some(i);
                return true;
            }
            at += 1;
        }
        false
    }

    /// Whether nothing stands on a way from the starts to the ends, which are the lamp's.
    fn is_clear(
        &self,
        starts: &Starts,
        lamp: &Lamp,
        ends: &[DVec3],
        blocker: &mut Option<usize>,
    ) -> bool {
        let hull: Vec<DVec3> = starts.points.iter().chain(ends).copied().collect();
        let sides = self.sides(starts, lamp, ends, &hull);
        let passed = |t: &ShadowTriangle| {
            let limit = |(normal, height): (DVec3, f64)| {
                let below = |v: Vec3| normal.dot(v.as_dvec3()) < height - self.margin;
                [t.a, t.b, t.c].into_iter().all(below)
            };
            t.relief == 1 && starts.passed.is_some_and(limit)
        };
        let enter = |node: &ShadowNode| {
            let (low, high) = (node.low.as_dvec3(), node.high.as_dvec3());
            let misses = |side: &Side| {
                let nearest = DVec3::select(side.normal.cmpgt(DVec3::ZERO), low, high);
                side.normal.dot(nearest) > side.limit
            };
            !sides.iter().any(misses)
        };
        let blocks = |t: &ShadowTriangle| !passed(t) && self.stands_in(t, &sides, &hull);
        !self.finds(enter, blocks, blocker)
    }

    fn stands_in(&self, t: &ShadowTriangle, sides: &[Side], hull: &[DVec3]) -> bool {
        let corners = [t.a, t.b, t.c].map(|v| v.as_dvec3());
        if sides.iter().any(|side| side.misses(&corners)) {
            return false;
        }
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let off = |p: &DVec3| normal.dot(*p - a);
        if hull.iter().all(|p| off(p) > self.margin) || hull.iter().all(|p| off(p) < -self.margin) {
            return false;
        }
        let mut within = corners.to_vec();
        for side in sides {
            within = side.cut(&within);
        }
        !within.is_empty()
    }

    /// Planes that bound the hull: across the axes, the planes of the triangle and of the lamp, and
    /// planes parallel to an axis that touch the hull.
    fn sides(&self, starts: &Starts, lamp: &Lamp, ends: &[DVec3], hull: &[DVec3]) -> Vec<Side> {
        let side = |normal, margin| Side::of(hull, normal, margin);
        let mut sides = Vec::with_capacity(32);
        for axis in DVec3::AXES {
            sides.extend([side(axis, self.margin), side(-axis, self.margin)]);
        }
        if let Some((normal, above)) = starts.above {
            sides.push(side(-normal, MARGIN_ABOVE * above));
            let lowest = lowest_plane(normal, &starts.points, ends);
            sides.extend(lowest.map(|normal| side(-normal, self.margin)));
        }
        if let Some(plane) = &lamp.plane {
            sides.push(side(-plane.normal, MARGIN_ABOVE * plane.above));
        }
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            for (from, to) in outline(hull, u, v) {
                let mut normal = DVec3::ZERO;
                normal[u] = to[v] - from[v];
                normal[v] = from[u] - to[u];
                if let Some(normal) = normal.try_normalize() {
                    sides.push(side(normal, self.margin));
                }
            }
        }
        sides
    }
}

/// Whether a way passes a node's box.
fn enters(node: &ShadowNode, from: DVec3, to: DVec3) -> bool {
    let way = to - from;
    let each = way.map(|c| 1.0 / if c == 0.0 { f64::MIN_POSITIVE } else { c });
    let one = (node.low.as_dvec3() - from) * each;
    let other = (node.high.as_dvec3() - from) * each;
    let enter = one.min(other).max_element().max(0.0);
    let leave = one.max(other).min_element().min(1.0);
    enter <= leave
}

/// A caster as ways pass it.
struct CasterPlane {
    corners: [DVec3; 3],
    normal: DVec3,
    /// In its plane, unit, into the triangle from each edge.
    inward: [DVec3; 3],
}

impl CasterPlane {
    fn new(t: &ShadowTriangle) -> Self {
        let corners = [t.a, t.b, t.c].map(|v| v.as_dvec3());
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let inward = |from: DVec3, to: DVec3| normal.cross(to - from).normalize_or_zero();
        Self {
            corners,
            normal,
            inward: [inward(a, b), inward(b, c), inward(c, a)],
        }
    }

    /// Whether it stands on a way for certain: further than `margin` from its ends and its edges.
    fn is_between(&self, from: DVec3, to: DVec3, margin: f64) -> bool {
        let off = |p: DVec3| self.normal.dot(p - self.corners[0]);
        let (first, last) = (off(from), off(to));
        if first * last >= 0.0 || first.abs() < margin || last.abs() < margin {
            return false;
        }
        let place = from + (to - from) * (first / (first - last));
        (0..3).all(|k| self.inward[k].dot(place - self.corners[k]) > margin)
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;
    use crate::math::sampling::Random;
    use crate::passes::types::LitTriangle;

    /// Points about the middle.
    fn point(random: &mut Random, size: f64) -> DVec3 {
        DVec3::from([0; 3].map(|_| 2.0 * random.unit() - 1.0)) * size
    }

    /// Two lamps, without planes, over casters of three sizes.
    fn lamps_over_casters(random: &mut Random) -> Shafts {
        let sizes = [(0.05, 6), (0.2, 6), (1.5, 3)];
        let sizes = sizes.map(|(size, count)| std::iter::repeat_n(size, count));
        let casters = sizes.into_iter().flatten().map(|size| {
            let middle = point(random, 1.0).with_z(0.0);
            let corners = [0; 3].map(|_| (middle + point(random, size)).as_vec3());
            ShadowTriangle {
                a: corners[0],
                b: corners[1],
                c: corners[2],
                ..ShadowTriangle::zeroed()
            }
        });
        Shafts {
            tree: ShadowTree::new(casters.collect()),
            lamps: [0.5, -0.5]
                .map(|x| Lamp {
                    ends: (0..4)
                        .map(|_| DVec3::new(x, 0.0, 4.0) + point(random, 0.1))
                        .collect(),
                    plane: None,
                })
                .into(),
            margin: MARGIN,
        }
    }

    /// What is found of places one after another, each with the blockers of the one before, is what
    /// is found of each alone: of some all lamps are open, of some all are hidden.
    #[test]
    fn blockers_change_nothing() {
        let mut random = Random::new(1, 2, 3);
        let shafts = lamps_over_casters(&mut random);
        let mut blockers = Blockers::default();
        let mut found = [0; 3];
        for _ in 0..3000 {
            let middle = point(&mut random, 1.5).with_z(-2.0);
            let starts = Starts {
                points: (0..3).map(|_| middle + point(&mut random, 0.02)).collect(),
                above: None,
                passed: None,
                lit: None,
            };
            let state = shafts.state(&starts, &mut blockers);
            assert_eq!(state, shafts.state(&starts, &mut Blockers::default()));
            found[state as usize] += 1;
        }
        assert!(found.iter().all(|&count| count > 100), "{found:?}");
    }

    /// Of parts of bent triangles at all angles to the lamps, no way that is asked for is blocked
    /// where they are open, and each is where they are hidden.
    #[test]
    fn states_are_those_of_ways() {
        let mut random = Random::new(4, 5, 6);
        let mut found = [0; 3];
        for _ in 0..30 {
            let shafts = lamps_over_casters(&mut random);
            let planes: Vec<_> = (shafts.tree.triangles.iter().map(CasterPlane::new)).collect();
            for _ in 0..60 {
                let middle = point(&mut random, 1.5).with_z(-0.5 - 1.5 * random.unit());
                let corners = [0; 3].map(|_| middle + point(&mut random, 0.1));
                let [a, b, c] = corners;
                let plane = (b - a).cross(c - a).normalize();
                let normals = [0; 3].map(|_| (plane + point(&mut random, 0.1)).normalize());
                let lit = LitTriangle {
                    a: a.as_vec3(),
                    b: b.as_vec3(),
                    c: c.as_vec3(),
                    normal_a: normals[0].as_vec3(),
                    normal_b: normals[1].as_vec3(),
                    normal_c: normals[2].as_vec3(),
                    plane: plane.as_vec3(),
                    above: 1e-5,
                    ..LitTriangle::zeroed()
                };
                let starts = Starts::on_part(&lit, corners);
                let state = shafts.state(&starts, &mut Blockers::default());
                found[state as usize] += 1;
                for lamp in &shafts.lamps {
                    for _ in 0..20 {
                        let share = mixture(&mut random, 3);
                        let mix = |points: &[DVec3], shares: &[f64]| -> DVec3 {
                            points.iter().zip(shares).map(|(p, s)| *p * *s).sum()
                        };
                        let (at, normal) = (mix(&corners, &share), mix(&normals, &share));
                        let from = mix(&starts.points, &mixture(&mut random, starts.points.len()));
                        let to = mix(&lamp.ends, &mixture(&mut random, lamp.ends.len()));
                        let asked = normal.dot(to - at) > 0.0;
                        let between = |p: &CasterPlane| p.is_between(from, to, 0.0);
                        let blocked = planes.iter().any(between);
                        assert!(state != PART_OPEN || !asked || !blocked, "{from} to {to}");
                        assert!(state != PART_HIDDEN || !asked || blocked, "{from} to {to}");
                    }
                }
            }
        }
        assert!(found.iter().all(|&count| count > 100), "{found:?}");
    }

    /// Shares that sum to 1.
    fn mixture(random: &mut Random, count: usize) -> Vec<f64> {
        let shares: Vec<f64> = (0..count).map(|_| random.unit().powi(3)).collect();
        let sum: f64 = shares.iter().sum();
        shares.iter().map(|s| s / sum).collect()
    }
}
