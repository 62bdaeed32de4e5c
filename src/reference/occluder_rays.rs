//! Twin of the traversal of the tree of occluders from a source's eye: every occluder, in f64,
//! without a tree.

use glam::DVec3;

use super::item_buffer::intersect;
use crate::constants::KIND_SURFACE;
use crate::mesh::sources::Source;
use crate::structs::ShadowOccluder;

/// Rounding of a plane's height at a point, as in the shader.
const HEIGHT_EPSILON: f64 = 1e-6;

/// Least distance behind a plane at which a place is hidden, as in the shader.
const HIDDEN: f64 = 4e-6;

/// How clearly a place is hidden: the maximum over all occluders of the margin, which is the least
/// of the barycentric coordinates of the ray's hit and of the place's depth behind it, in thousands
/// of the least hiding depth. Positive where hidden; near 0 the answer is uncertain.
pub fn hidden(occluders: &[ShadowOccluder], source: &Source, p: DVec3) -> f64 {
    let depth = |o: &ShadowOccluder| depth(o, source, p).unwrap_or(f64::NEG_INFINITY);
    occluders
        .iter()
        .map(depth)
        .fold(f64::NEG_INFINITY, f64::max)
}

fn depth(occluder: &ShadowOccluder, source: &Source, p: DVec3) -> Option<f64> {
    let normal = occluder.normal.as_dvec3();
    let above = |p: DVec3| normal.dot(p) - f64::from(occluder.height);
    let eye_height = above(source.eye);
    let on_it = source.kind == KIND_SURFACE && occluder.component == source.component;
    let own_back = on_it && occluder.closed == 1 && eye_height < 0.0;
    if eye_height.abs() <= HEIGHT_EPSILON || own_back {
        return None;
    }
    let corners = [occluder.a, occluder.b, occluder.c].map(|v| v.as_dvec3());
    let hit = intersect(source.eye, p - source.eye, corners)?;
    let behind = -above(p) * eye_height.signum() / HIDDEN - 1.0;
    Some(hit.inside.min(behind / 1e3))
}
