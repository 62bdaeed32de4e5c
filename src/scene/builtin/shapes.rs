//! Implicit shapes to sculpt from: negative inside, nearly the distance outside.

use glam::DVec3;

/// A cone with round ends.
pub(super) struct RoundCone {
    from: [f64; 3],
    from_radius: f64,
    to: [f64; 3],
    to_radius: f64,
}

pub(super) const fn cone(
    from: [f64; 3],
    from_radius: f64,
    to: [f64; 3],
    to_radius: f64,
) -> RoundCone {
    RoundCone {
        from,
        from_radius,
        to,
        to_radius,
    }
}

impl RoundCone {
    /// Distance to the spheres swept along the axis, the nearest sphere taken straight across it.
    pub fn distance(&self, p: DVec3) -> f64 {
        let (from, to) = (DVec3::from(self.from), DVec3::from(self.to));
        let axis = to - from;
        let along = ((p - from).dot(axis) / axis.length_squared()).clamp(0.0, 1.0);
        let radius = self.from_radius + (self.to_radius - self.from_radius) * along;
        p.distance(from + axis * along) - radius
    }
}

/// An ellipsoid along the axes; nearly the distance close to it (Quilez).
pub(super) fn ellipsoid(p: DVec3, centre: DVec3, radii: DVec3) -> f64 {
    let scaled = (p - centre) / radii;
    let steep = (scaled / radii).length();
    let k = scaled.length();
    if steep == 0.0 {
        return -radii.min_element();
    }
    k * (k - 1.0) / steep
}

/// Polynomial smooth minimum, Quilez.
pub(super) fn smooth_union(a: f64, b: f64, width: f64) -> f64 {
    let h = (width - (a - b).abs()).max(0.0) / width;
    a.min(b) - h * h * width / 4.0
}
