//! Twin of the traversal of the shadow tree: every triangle, in f64, without a tree.

use glam::{DVec3, Vec3};

use crate::structs::{ShadowRay, ShadowTriangle};

/// How clearly a segment is blocked: the maximum over all triangles of the margin of the crossing,
/// which is the least of its barycentric coordinates and of its relative distances to the two ends
/// of the segment. Positive where blocked; near 0 the answer is uncertain.
pub fn blocked(triangles: &[ShadowTriangle], ray: &ShadowRay) -> f64 {
    let depth = |t: &ShadowTriangle| depth(t, ray).unwrap_or(f64::NEG_INFINITY);
    triangles
        .iter()
        .map(depth)
        .fold(f64::NEG_INFINITY, f64::max)
}

fn depth(t: &ShadowTriangle, ray: &ShadowRay) -> Option<f64> {
    let from = ray.from.as_dvec3();
    let way = ray.to.as_dvec3() - from;
    let corner = |p: Vec3| p.as_dvec3() - from;
    let [a, b, c] = [t.a, t.b, t.c].map(corner);
    let normal = (b - a).cross(c - a);
    let falls = normal.dot(way);
    if falls == 0.0 {
        return None;
    }
    let share = normal.dot(a) / falls;
    let place = share * way;
    let square = normal.length_squared();
    let over = |p: DVec3, q: DVec3| (p - place).cross(q - place).dot(normal) / square;
    let begin = if t.relief == 1 {
        f64::from(ray.clear).max(0.0)
    } else {
        0.0
    };
    let inside = [
        over(b, c),
        over(c, a),
        over(a, b),
        share - begin,
        1.0 - share,
    ];
    Some(inside.into_iter().fold(f64::INFINITY, f64::min))
}
