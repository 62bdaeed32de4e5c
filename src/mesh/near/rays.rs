//! What occluders stand on the way between two places: a walk through their tree on the CPU.

use glam::{DVec3, Vec3};

use crate::mesh::shadow_tree::ShadowTree;
use crate::structs::ShadowOccluder;

/// Height above a plane up to which a place counts as lying in it, internal units: corners are
/// rounded to 2⁻²⁴, and outlines join what lies in one plane to 2·10⁻⁷.
const IN_PLANE: f64 = 5e-7;

/// Components of a way below this count as this, so that their reciprocals are finite.
const LEAST_WAY: f32 = 1e-18;

/// Whether an occluder crosses the way between two places. One whose plane holds either end does
/// not.
pub fn blocked(tree: &ShadowTree<ShadowOccluder>, from: DVec3, to: DVec3) -> bool {
    let way = to - from;
    let mut is_blocked = false;
    walk(tree, from, way, |leaf| {
        is_blocked = leaf.iter().any(|o| crosses(o, from, to, way));
        if is_blocked { 0.0 } else { 1.0 }
    });
    is_blocked
}

/// The connected part of an occluder that crosses the way between two places as [`blocked`] asks
/// for: of some one of them.
pub fn blocked_by(tree: &ShadowTree<ShadowOccluder>, from: DVec3, to: DVec3) -> Option<u32> {
    let way = to - from;
    let mut part = None;
    walk(tree, from, way, |leaf| {
        let found = leaf.iter().find(|o| crosses(o, from, to, way));
        part = found.map(|o| o.component);
        if part.is_some() { 0.0 } else { 1.0 }
    });
    part
}

/// Whether an occluder of a connected part crosses the way between two places.
pub fn blocked_by_part(
    tree: &ShadowTree<ShadowOccluder>,
    part: u32,
    from: DVec3,
    to: DVec3,
) -> bool {
    let way = to - from;
    let mut is_blocked = false;
    walk(tree, from, way, |leaf| {
        let mut of_part = leaf.iter().filter(|o| o.component == part);
        is_blocked = of_part.any(|o| crosses(o, from, to, way));
        if is_blocked { 0.0 } else { 1.0 }
    });
    is_blocked
}

/// The first occluder on a way: where it is met, as a share of the way, and whether its back is
/// seen. Where both sides lie in one place, the front.
pub fn first_met(
    tree: &ShadowTree<ShadowOccluder>,
    from: DVec3,
    way: DVec3,
) -> Option<(f64, bool)> {
    let to = from + way;
    let (mut front, mut back) = (f64::INFINITY, f64::INFINITY);
    walk(tree, from, way, |leaf| {
        for o in leaf.iter().filter(|o| crosses(o, from, to, way)) {
            let normal = o.normal.as_dvec3();
            let at = (f64::from(o.height) - normal.dot(from)) / normal.dot(way);
            let side = if normal.dot(way) < 0.0 {
                &mut front
            } else {
                &mut back
            };
            *side = side.min(at);
        }
        // Boxes are wider than their triangles.
        front.min(back).min(1.0) as f32
    });
    let sides_apart = IN_PLANE / way.length();
    let is_back = back < front - sides_apart;
    let at = front.min(back);
    at.is_finite().then_some((at, is_back))
}

/// Whether no occluder can cross a way from the hull of some places to that of others: each has all
/// of them on one side of its plane, or lies beside the box about both.
pub fn is_clear(tree: &ShadowTree<ShadowOccluder>, from: &[DVec3], to: &[DVec3]) -> bool {
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for p in from.iter().chain(to) {
        (low, high) = (low.min(*p), high.max(*p));
    }
    let margin = DVec3::splat(IN_PLANE);
    let (low, high) = ((low - margin).as_vec3(), (high + margin).as_vec3());
    let beside = |a: Vec3, b: Vec3| a.cmpgt(high).any() || b.cmplt(low).any();
    let may_cross = |o: &ShadowOccluder| {
        if beside(o.a.min(o.b).min(o.c), o.a.max(o.b).max(o.c)) {
            return false;
        }
        let normal = o.normal.as_dvec3();
        let mut heights = (from.iter().chain(to)).map(|p| normal.dot(*p) - f64::from(o.height));
        let (mut above, mut below) = (false, false);
        heights.any(|height| {
            above |= height >= IN_PLANE;
            below |= height <= -IN_PLANE;
            above && below
        })
    };
    let nodes = tree.nodes();
    let mut at = 0;
    while at < nodes[0].skip as usize {
        let node = &nodes[at];
        if beside(node.low, node.high) {
            at = node.skip as usize;
            continue;
        }
        if tree.triangles[node.triangles()].iter().any(may_cross) {
            return false;
        }
        at += 1;
    }
    true
}

/// Calls `leaf` with the occluders of each box on the way, of which it returns the share that is
/// still to be walked.
fn walk(
    tree: &ShadowTree<ShadowOccluder>,
    from: DVec3,
    way: DVec3,
    mut leaf: impl FnMut(&[ShadowOccluder]) -> f32,
) {
    let start = from.as_vec3();
    let short = way.as_vec3();
    let sign = Vec3::select(short.cmplt(Vec3::ZERO), Vec3::NEG_ONE, Vec3::ONE);
    let each = sign / short.abs().max(Vec3::splat(LEAST_WAY));
    let nodes = tree.nodes();
    let count = nodes[0].skip as usize;
    let mut most = 1.0;
    let mut at = 0;
    while at < count && most > 0.0 {
        let node = &nodes[at];
        let one = (node.low - start) * each;
        let other = (node.high - start) * each;
        let enter = one.min(other).max_element().max(0.0);
        let leave = one.max(other).min_element().min(most);
        if enter > leave {
            at = node.skip as usize;
            continue;
        }
        most = leaf(&tree.triangles[node.triangles()]);
        at += 1;
    }
}

/// Two triangles find the same volume over the edge that they share with opposite signs, to the
/// bit: no way leads between them.
fn crosses(o: &ShadowOccluder, from: DVec3, to: DVec3, way: DVec3) -> bool {
    let normal = o.normal.as_dvec3();
    let height = |p: DVec3| normal.dot(p) - f64::from(o.height);
    let (start, end) = (height(from), height(to));
    if start.min(end) > -IN_PLANE || start.max(end) < IN_PLANE {
        return false;
    }
    let [a, b, c] = [o.a, o.b, o.c].map(|v| v.as_dvec3() - from);
    let volumes = [b.cross(c), c.cross(a), a.cross(b)].map(|over| way.dot(over));
    let least = volumes[0].min(volumes[1]).min(volumes[2]);
    let most = volumes[0].max(volumes[1]).max(volumes[2]);
    (least >= 0.0 || most <= 0.0) && least != most
}
