//! Places with nothing between them and the lights: their samples need no shadow rays.
//!
//! A shaft (Haines and Wallace 1991) contains all shadow rays from a part of a triangle, or from
//! the relief over one, to a lamp. Here it is bounded by planes about the convex hull of the rays'
//! starts and ends. A triangle wholly outside one of the planes, or whose own plane has the hull on
//! one side, blocks no ray.

use glam::{DVec3, Vec3};

use super::shaft_lamps::{Lamp, MOST_LAMPS, lamps};
use crate::constants::{PART_HIDDEN, PART_OPEN, PART_UNSURE};
use crate::mesh::shadow_tree::ShadowTree;
use crate::passes::types::{LitTriangle, Prism, ShadowNode, ShadowTriangle};
use crate::picture::Projection;
use crate::scene::Scene;

/// Margin of a shaft's planes, as a share of the greatest coordinate: the traversal of the tree
/// tests nothing further from a ray, see `BOX_MARGIN`.
const MARGIN: f64 = 1.0 / (1 << 20) as f64;
/// The margin of planes that rays begin or end above: a share of the rays' height above them, which
/// is 2⁻¹⁸ of coordinates that are rounded to 2⁻²².
const MARGIN_ABOVE: f64 = 0.25;

/// n·x ≤ `limit` inside, with the margin.
struct Side {
    normal: DVec3,
    limit: f64,
}

/// Where shadow rays start.
pub struct Starts {
    /// They start in the hull of these points,
    points: Vec<DVec3>,
    /// and above a plane with this normal, by so much;
    above: Option<(DVec3, f64)>,
    /// and they pass triangles with relief below this height along a normal.
    passed: Option<(DVec3, f64)>,
}

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

    /// PART_… of where shadow rays start: open where no ray to any light is blocked, or none shines
    /// towards it; hidden where all are blocked, each lamp's by one triangle. It does not depend on
    /// `blockers`.
    pub fn state(&self, starts: &Starts, Blockers(blockers): &mut Blockers) -> u32 {
        if self.is_empty() {
            return PART_UNSURE;
        }
        let mut lamps = self.lamps.iter().zip(&mut *blockers);
        if lamps.all(|(lamp, blocker)| self.is_clear(starts, lamp, blocker)) {
            return PART_OPEN;
        }
        let points = &starts.points;
        let mut lamps = self.lamps.iter().zip(blockers);
        match lamps
            .all(|(l, blocker)| self.is_behind(points, l) || self.is_covered(points, l, blocker))
        {
            true => PART_HIDDEN,
            false => PART_UNSURE,
        }
    }

    /// Whether a lamp shines away from the starts.
    fn is_behind(&self, starts: &[DVec3], lamp: &Lamp) -> bool {
        lamp.plane.as_ref().is_some_and(|plane| {
            let behind = |p: &DVec3| plane.normal.dot(*p) < plane.offset - 2.0 * self.margin;
            starts.iter().all(behind)
        })
    }

    /// Whether one triangle stands on all ways from the starts to a lamp. Places where ways between
    /// two hulls pass a plane lie in the hull of those of ways between the corners.
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

    fn is_clear(&self, starts: &Starts, lamp: &Lamp, blocker: &mut Option<usize>) -> bool {
        if self.is_behind(&starts.points, lamp) {
            return true;
        }
        let hull: Vec<DVec3> = starts.points.iter().chain(&lamp.ends).copied().collect();
        let sides = self.sides(starts, lamp, &hull);
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
        let outside = |s: &Side| corners.iter().all(|v| s.normal.dot(*v) > s.limit);
        if sides.iter().any(outside) {
            return false;
        }
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a).normalize_or_zero();
        let off = |p: &DVec3| normal.dot(*p - a);
        !(hull.iter().all(|p| off(p) > self.margin) || hull.iter().all(|p| off(p) < -self.margin))
    }

    /// Planes that bound the hull: across the axes, the planes of the triangle and of the lamp, and
    /// planes parallel to an axis that touch the hull.
    fn sides(&self, starts: &Starts, lamp: &Lamp, hull: &[DVec3]) -> Vec<Side> {
        let side = |normal: DVec3, margin: f64| Side {
            normal,
            limit: margin + hull.iter().map(|p| normal.dot(*p)).fold(f64::MIN, f64::max),
        };
        let mut sides = Vec::with_capacity(32);
        for axis in DVec3::AXES {
            sides.extend([side(axis, self.margin), side(-axis, self.margin)]);
        }
        if let Some((normal, above)) = starts.above {
            sides.push(side(-normal, MARGIN_ABOVE * above));
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

/// Cosine of the greatest angle between a flat triangle and the relief's axes at its corners.
const STRAIGHT: f64 = 1.0 - 5e-7;

impl Starts {
    /// On the relief of a prism, see `relief.frag`.
    pub fn on_prism(p: &Prism) -> Self {
        let low = [p.low_a, p.low_b, p.low_c].map(|v| v.as_dvec3());
        let high = [p.high_a, p.high_b, p.high_c].map(|v| v.as_dvec3());
        let normal = (high[1] - high[0]).cross(high[2] - high[0]);
        let normal = normal.normalize_or_zero();
        // Mirrored prisms turn the other way round.
        let normal = normal * normal.dot(p.normal.as_dvec3()).signum();
        let upright = |k: usize| (high[k] - low[k]).normalize_or_zero().dot(normal) > STRAIGHT;
        // Where the surface bends, a way may leave the relief lower than the prism's top.
        let flat = (0..3).all(upright);
        let top = high
            .map(|v| normal.dot(v))
            .into_iter()
            .fold(f64::MAX, f64::min);
        Self {
            points: [low, high].concat(),
            above: None,
            passed: flat.then_some((normal, top)),
        }
    }

    /// On the part of a triangle that has these corners, see `shade.frag`.
    pub fn on_part(t: &LitTriangle, corners: [DVec3; 3]) -> Self {
        Self {
            points: starts(t, corners),
            above: Some((t.plane.as_dvec3(), f64::from(t.above))),
            passed: None,
        }
    }
}

/// Points whose hull contains the starts of all rays from the triangle, see `shade.frag`: the
/// starts reach up to the tangent planes of its corners. `corners` are those of the part of the
/// triangle that is asked for.
fn starts(t: &LitTriangle, corners: [DVec3; 3]) -> Vec<DVec3> {
    let above = f64::from(t.above);
    let raised = corners.map(|c| c + t.plane.as_dvec3() * above);
    let mut starts = raised.to_vec();
    for (corner, normal) in [t.a, t.b, t.c]
        .map(|v| v.as_dvec3())
        .iter()
        .zip([t.normal_a, t.normal_b, t.normal_c].map(Vec3::as_dvec3))
    {
        let lift = corners.map(|c| normal.dot(*corner - c));
        let lift = lift.into_iter().fold(0.0, f64::max);
        // Smaller values are rounding, which the margins cover.
        if lift > MARGIN_ABOVE * above {
            starts.extend(raised.map(|c| c + normal * lift));
        }
    }
    starts
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

/// Edges of the convex outline of the points along two axes, counter-clockwise: Andrew's monotone
/// chain.
fn outline(points: &[DVec3], u: usize, v: usize) -> Vec<(DVec3, DVec3)> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a[u].total_cmp(&b[u]).then(a[v].total_cmp(&b[v])));
    let turns_left = |a: DVec3, b: DVec3, c: DVec3| {
        (b[u] - a[u]) * (c[v] - a[v]) - (b[v] - a[v]) * (c[u] - a[u]) > 0.0
    };
    let half = |points: &mut dyn Iterator<Item = &DVec3>| {
        let mut chain: Vec<DVec3> = Vec::new();
        for &p in points {
            while let [.., a, b] = chain[..]
                && !turns_left(a, b, p)
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let lower = half(&mut sorted.iter());
    let upper = half(&mut sorted.iter().rev());
    let edges = |chain: &[DVec3]| -> Vec<_> { chain.windows(2).map(|w| (w[0], w[1])).collect() };
    [edges(&lower), edges(&upper)].concat()
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;

    use super::*;
    use crate::math::sampling::Random;

    /// What is found of places one after another, each with the blockers of the one before, is what
    /// is found of each alone: of some all lamps are open, of some all are hidden.
    #[test]
    fn blockers_change_nothing() {
        let mut random = Random::new(1, 2, 3);
        let mut point = |size: f64| {
            let each = [0; 3].map(|_| 2.0 * random.unit() - 1.0);
            DVec3::from(each) * size
        };
        let caster = |size: f64, point: &mut dyn FnMut(f64) -> DVec3| {
            let middle = point(1.0).with_z(0.0);
            let corners = [0; 3].map(|_| (middle + point(size)).as_vec3());
            ShadowTriangle {
                a: corners[0],
                b: corners[1],
                c: corners[2],
                ..ShadowTriangle::zeroed()
            }
        };
        let sizes = [(0.05, 6), (0.2, 6), (1.5, 3)];
        let casters: Vec<_> = (sizes.iter())
            .flat_map(|&(size, count)| std::iter::repeat_n(size, count))
            .map(|size| caster(size, &mut point))
            .collect();
        let shafts = Shafts {
            tree: ShadowTree::new(casters),
            lamps: [0.5, -0.5]
                .map(|x| Lamp {
                    ends: (0..4)
                        .map(|_| DVec3::new(x, 0.0, 4.0) + point(0.1))
                        .collect(),
                    plane: None,
                })
                .into(),
            margin: MARGIN,
        };
        let mut blockers = Blockers::default();
        let mut found = [0; 3];
        for _ in 0..3000 {
            let middle = point(1.5).with_z(-2.0);
            let starts = Starts {
                points: (0..3).map(|_| middle + point(0.02)).collect(),
                above: None,
                passed: None,
            };
            let state = shafts.state(&starts, &mut blockers);
            assert_eq!(state, shafts.state(&starts, &mut Blockers::default()));
            found[state as usize] += 1;
        }
        assert!(found.iter().all(|&count| count > 100), "{found:?}");
    }
}
