//! Round cones and their smooth union, from which figures are sculpted.

use glam::DVec3;

/// A cone with round ends, metres.
pub(super) struct RoundCone {
    from: [f64; 3],
    from_radius: f64,
    to: [f64; 3],
    to_radius: f64,
    /// A sphere about it.
    middle: [f64; 3],
    reach: f64,
}

pub(super) const fn cone(
    from: [f64; 3],
    from_radius: f64,
    to: [f64; 3],
    to_radius: f64,
) -> RoundCone {
    let (mut middle, mut sum, mut longest) = ([0.0; 3], 0.0, 0.0);
    let mut axis = 0;
    while axis < 3 {
        middle[axis] = 0.5 * (from[axis] + to[axis]);
        let length = (to[axis] - from[axis]).abs();
        sum += length;
        longest = f64::max(longest, length);
        axis += 1;
    }
    RoundCone {
        from,
        from_radius,
        to,
        to_radius,
        middle,
        // No length is more than its longest part and half the others.
        reach: 0.25 * (longest + sum) + f64::max(from_radius, to_radius),
    }
}

/// Polynomial smooth minimum, Quilez; `blend` is the width of the fillet.
pub(super) fn smooth_union(a: f64, b: f64, blend: f64) -> f64 {
    let h = (blend - (a - b).abs()).max(0.0) / blend;
    a.min(b) - h * h * blend / 4.0
}

/// A figure of parts on the plane x = 0, and of parts at positive x that are mirrored. Negative
/// inside; approximately the distance, which is enough to polygonise it.
pub(super) fn figure(trunk: &[RoundCone], limbs: &[RoundCone], blend: f64, p: DVec3) -> f64 {
    let aside = DVec3::new(p.x.abs(), p.y, p.z);
    let trunk = trunk.iter().map(|part| (part, p));
    let limbs = limbs.iter().map(|part| (part, aside));
    trunk.chain(limbs).fold(f64::INFINITY, |found, (part, p)| {
        // A part as far off changes nothing.
        match part.is_beyond(p, found + blend) {
            true => found,
            false => smooth_union(found, part.distance(p), blend),
        }
    })
}

impl RoundCone {
    /// Whether it is further off for certain.
    fn is_beyond(&self, p: DVec3, distance: f64) -> bool {
        let reach = (self.reach + distance).max(0.0);
        p.distance_squared(DVec3::from(self.middle)) > reach * reach
    }

    /// Distance to the spheres swept along the axis, the nearest sphere taken perpendicular to it;
    /// negative inside.
    pub fn distance(&self, p: DVec3) -> f64 {
        let (from, to) = (DVec3::from(self.from), DVec3::from(self.to));
        let axis = to - from;
        let along = ((p - from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        let radius = self.from_radius + (self.to_radius - self.from_radius) * along;
        p.distance(from + axis * along) - radius
    }
}
