//! Moments of light, and irradiance that is not linear in the normal: what Frostbite keeps
//! (O'Donnell, *Precomputed Global Illumination in Frostbite*, 2018), by the formula of Geomerics.

use glam::{DVec3, Vec3};

use super::Frame;
use crate::error::Result;
use crate::solver::{Lit, Place};

/// Mean irradiance of facets turned every way; the same times the direction of the light, along x,
/// y and z of the scene; irradiance of the surface: W·m⁻², RGB, `[place][value]`.
pub(super) fn look(
    lit: &Lit<'_>,
    frames: &[Frame],
    places: &[Place],
    direct: bool,
) -> Result<Vec<Vec<Vec3>>> {
    let start = |i: usize| (frames[i].place.normal, [DVec3::ZERO; MOMENTS]);
    let found = lit.arriving(places, direct, start, |(normal, sums), from| {
        let each = [1.0, from.way.x, from.way.y, from.way.z].map(|along| along / 4.0);
        let facing = from.way.dot(*normal).max(0.0);
        let shares = each.into_iter().chain([facing]);
        sums.iter_mut()
            .zip(shares)
            .for_each(|(sum, share)| *sum += share * from.light);
    })?;
    let each = found
        .into_iter()
        .map(|(_, sums)| sums.map(|sum| sum.as_vec3()).to_vec());
    Ok(each.collect())
}

/// Values of a place.
pub(super) const MOMENTS: usize = 5;

/// Light along the normal of a surface.
pub(super) fn straight(normal: DVec3, light: Vec3) -> Vec<Vec3> {
    let n = normal.as_vec3();
    let each = [0.25, 0.25 * n.x, 0.25 * n.y, 0.25 * n.z, 1.0];
    each.map(|share| share * light).to_vec()
}

/// The first moment of each colour over its mean: directions, no longer than 1.
pub(super) fn ratios(values: &[Vec3]) -> [Vec3; 3] {
    [0, 1, 2].map(|c| {
        let along = Vec3::from_array([1, 2, 3].map(|k| values[k][c]));
        let ratio = along / values[0][c];
        match ratio.is_finite() {
            true => ratio.clamp_length_max(1.0),
            false => Vec3::ZERO,
        }
    })
}

/// Irradiance of a facet with this unit normal over the mean of all facets, of light whose first
/// moment is `ratio` of its mean. From one direction it is 4 q³, q = ½ (1 + n · ω); from all alike,
/// 1.
pub fn irradiance_of_moments(ratio: Vec3, normal: Vec3) -> f32 {
    let length = ratio.length().min(1.0);
    let towards = ratio.normalize_or_zero();
    let q = (0.5 * (1.0 + towards.dot(normal))).max(0.0);
    let p = 1.0 + 2.0 * length;
    let even = (1.0 - length) / (1.0 + length);
    even + (1.0 - even) * (p + 1.0) * q.powf(p)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The mean over all normals is 1, and the first moment that of light whose irradiance it is,
    /// to what the formula promises: exactly without direction and from one.
    #[test]
    fn its_mean_is_that_of_the_light() {
        for length in [0.0_f32, 0.3, 0.7, 1.0] {
            let ratio = Vec3::new(0.0, 0.0, length);
            let rings = 2000;
            let of = |i: usize| {
                let z = (i as f32 + 0.5) / rings as f32 * 2.0 - 1.0;
                irradiance_of_moments(ratio, Vec3::new((1.0 - z * z).sqrt(), 0.0, z))
            };
            let mean = (0..rings).map(of).sum::<f32>() / rings as f32;
            assert!((mean - 1.0).abs() < 1e-4, "{length}: {mean}");
        }
        assert!((irradiance_of_moments(Vec3::Z, Vec3::Z) - 4.0).abs() < 1e-6);
        assert_eq!(irradiance_of_moments(Vec3::ZERO, Vec3::X), 1.0);
    }

    #[test]
    fn light_along_the_normal_is_as_light_from_one_direction() {
        let values = straight(DVec3::Y, Vec3::new(8.0, 4.0, 0.0));
        assert_eq!(values[4], Vec3::new(8.0, 4.0, 0.0));
        assert_eq!(ratios(&values), [Vec3::Y, Vec3::Y, Vec3::ZERO]);
        assert_eq!(values[0].x * irradiance_of_moments(Vec3::Y, Vec3::Y), 8.0);
    }
}
