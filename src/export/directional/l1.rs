//! Irradiance that is linear in the normal: spherical harmonics up to the first degree.

use glam::{DVec3, Vec3};

use super::Frame;
use super::facets::{self, FACETS, facets, turned};
use crate::error::Result;
use crate::picture::tone::luminance;
use crate::solver::{Lit, Place};

/// Irradiance of a facet with normal n is E(n) = L0 + n · L1, W·m⁻², RGB, in the axes of the scene.
/// For the surface's own normal it is exact; over facets tilted by up to 60° it is the nearest in
/// the least squares.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct L1 {
    pub l0: Vec3,
    /// Along x, y and z.
    pub l1: [Vec3; 3],
}

/// |L1| over L0 at most, that a file can hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    pub ratio: f32,
}

/// L0 and L1 at places, `[place]`.
pub(super) fn look(
    lit: &Lit<'_>,
    frames: &[Frame],
    places: &[Place],
    direct: bool,
) -> Result<Vec<Vec<Vec3>>> {
    let facets = facets();
    let start = |i: usize| (turned(frames[i].axes()), [DVec3::ZERO; FACETS]);
    let found = lit.arriving(places, direct, start, |(turned, sums), from| {
        facets::add(sums, turned, from);
    })?;
    let each = found.into_iter().zip(frames).map(|((_, sums), frame)| {
        let ([x, y, z], axes) = (fit(&facets, &sums), frame.axes());
        let along = |k: usize| (x * axes[0][k] + y * axes[1][k] + z * axes[2][k]).as_vec3();
        let found = L1 {
            l0: (sums[0] - z).as_vec3(),
            l1: [0, 1, 2].map(along),
        };
        found.values().to_vec()
    });
    Ok(each.collect())
}

/// L1 in the frame of the surface. The facets lie evenly about its normal, so that the three do not
/// depend on one another.
fn fit(facets: &[(DVec3, f64); FACETS], sums: &[DVec3; FACETS]) -> [DVec3; 3] {
    let (mut above, mut below) = ([DVec3::ZERO; 3], [0.0; 3]);
    for ((n, weight), light) in facets.iter().zip(sums) {
        let terms = [n.x, n.y, n.z - 1.0];
        for k in 0..3 {
            above[k] += weight * terms[k] * (*light - sums[0]);
            below[k] += weight * terms[k] * terms[k];
        }
    }
    [0, 1, 2].map(|k| above[k] / below[k])
}

impl L1 {
    pub fn from_values(values: &[Vec3]) -> Self {
        Self {
            l0: values[0],
            l1: [values[1], values[2], values[3]],
        }
    }

    pub fn values(&self) -> [Vec3; 4] {
        let [x, y, z] = self.l1;
        [self.l0, x, y, z]
    }

    /// Light along the normal of a surface.
    pub fn straight(normal: DVec3, light: Vec3) -> Self {
        Self {
            l0: Vec3::ZERO,
            l1: normal.to_array().map(|n| light * n as f32),
        }
    }

    /// Irradiance of a facet with this normal, W·m⁻², RGB; may be negative.
    pub fn at(&self, normal: DVec3) -> Vec3 {
        let n = normal.as_vec3();
        self.l0 + self.l1[0] * n.x + self.l1[1] * n.y + self.l1[2] * n.z
    }

    /// With L1 shortened, colour by colour, to what a file can hold, and the irradiance for the
    /// surface's own normal kept.
    pub fn limited(&self, normal: DVec3, limits: Limits) -> Self {
        let facing = self.at(normal);
        let n = normal.as_vec3().to_array();
        let mut found = *self;
        for c in 0..3 {
            let l1 = self.l1.map(|along| along[c]);
            let length = l1.iter().map(|l| l * l).sum::<f32>().sqrt();
            let height: f32 = l1.iter().zip(n).map(|(l, n)| l * n).sum();
            let needs = length + limits.ratio * height;
            let share = match needs > limits.ratio * facing[c] {
                true => (limits.ratio * facing[c] / needs).clamp(0.0, 1.0),
                false => 1.0,
            };
            (0..3).for_each(|k| found.l1[k][c] = share * l1[k]);
            found.l0[c] = facing[c] - share * height;
        }
        found
    }

    /// The dominant direction D of the luminance, |D| ≤ 1 the share of the light that has it:
    /// E(n) = E(surface) · (1 + n · D) / (1 + surface · D).
    pub fn dominant(&self, normal: DVec3) -> Vec3 {
        let grey = |light: Vec3| Vec3::splat(luminance(light.to_array()));
        let of_luminance = Self {
            l0: grey(self.l0),
            l1: self.l1.map(grey),
        };
        let held = of_luminance.limited(normal, Limits { ratio: 1.0 });
        let [x, y, z] = held.l1.map(|along| along.x);
        match held.l0.x > 0.0 {
            true => Vec3::new(x, y, z) / held.l0.x,
            false => Vec3::ZERO,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Irradiance that is linear comes back as it was; what is limited keeps the light of the
    /// surface.
    #[test]
    fn linear_irradiance_is_found_and_limits_keep_the_surface() {
        let (l0, l1) = (0.7, DVec3::new(0.1, -0.2, 0.3));
        let facets = facets();
        let light = |n: DVec3| DVec3::splat(l0 + n.dot(l1));
        let sums = facets.map(|(n, _)| light(n));
        let found = fit(&facets, &sums).map(|along| along.x);
        assert!((DVec3::from_array(found) - l1).length() < 1e-12);

        let normal = DVec3::new(0.6, 0.0, 0.8);
        let of = L1 {
            l0: Vec3::splat(0.1),
            l1: [0.4, 0.3, 0.7].map(Vec3::splat),
        };
        let held = of.limited(normal, Limits { ratio: 2.0 });
        let length = held.l1.iter().map(|l| l.x * l.x).sum::<f32>().sqrt();
        assert!((length / held.l0.x - 2.0).abs() < 1e-5, "{held:?}");
        assert!((held.at(normal) - of.at(normal)).length() < 1e-6);
        assert!(of.dominant(normal).length() <= 1.0 + 1e-6);
    }
}
