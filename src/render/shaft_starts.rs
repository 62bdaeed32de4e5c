//! Where shadow rays start, and what of the lamps they are asked for.

use glam::{DVec3, Vec3};

use super::convex::Side;
use crate::passes::types::{LitTriangle, Prism};

/// The margin of planes that rays begin or end above: a share of the rays' height above them, which
/// is 2⁻¹⁸ of coordinates that are rounded to 2⁻²².
pub const MARGIN_ABOVE: f64 = 0.25;

/// Where shadow rays start.
pub struct Starts {
    /// They start in the hull of these points,
    pub points: Vec<DVec3>,
    /// and above a plane with this normal, by so much;
    pub above: Option<(DVec3, f64)>,
    /// and they pass triangles with relief below this height along a normal.
    pub passed: Option<(DVec3, f64)>,
    /// What is lit, where its normals are known.
    pub lit: Option<Facing>,
}

/// A part of a triangle: its corners, and the normals between which its own lie.
pub struct Facing {
    corners: [DVec3; 3],
    normals: [DVec3; 3],
}

impl Facing {
    /// Points whose hull holds what of the hull of `ends` lies above the horizon of any place, or
    /// less than `margin` below it: n·(e − c) > −margin for an end e, a corner c and a normal n.
    pub fn above_horizon(&self, ends: &[DVec3], margin: f64) -> Vec<DVec3> {
        let pairs = || ends.iter().flat_map(|e| self.corners.map(|c| *e - c));
        let below = |n: &DVec3| pairs().all(|way| n.dot(way) < -margin);
        if self.normals.iter().all(below) {
            return Vec::new();
        }
        // A normal is within `spread` of the middle one: (n − middle)·(e − c) ≤ spread·reach.
        let middle = self.normals.iter().sum::<DVec3>().normalize_or_zero();
        let spread = (self.normals.iter()).map(|n| n.distance(middle));
        let reach = pairs().map(DVec3::length).fold(0.0, f64::max);
        let further = margin + spread.fold(0.0, f64::max) * reach;
        Side::of(&self.corners, -middle, further).cut_hull(ends)
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
            lit: None,
        }
    }

    /// On the part of a triangle that has these corners, see `shade.frag`.
    pub fn on_part(t: &LitTriangle, corners: [DVec3; 3]) -> Self {
        Self {
            points: starts(t, corners),
            above: Some((t.plane.as_dvec3(), f64::from(t.above))),
            passed: None,
            lit: Some(Facing {
                corners,
                normals: [t.normal_a, t.normal_b, t.normal_c].map(Vec3::as_dvec3),
            }),
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
