//! False colour for the light by slots of a triangle.

use glam::{DVec3, Vec3};

use crate::math::directions::Directions;

/// Chroma of a slot that has all of the light. It is above what sRGB can show at every hue, and is
/// clipped.
const MOST_CHROMA: f64 = 0.2;
/// Lightness of slots at the horizon and at the normal.
const LIGHTNESS: [f64; 2] = [0.4, 0.9];

/// The strongest slot of the light `[slot][colour]` by the length of its moment summed over the
/// colours, as linear RGB.
///
/// Hue is its azimuth about the normal (0 along the tangent, red), lightness its height over the
/// horizon, chroma the root of its share of all slots' lengths, each in Oklch, in which equal steps
/// look equal. Black where there is no light.
pub fn slot_colour(directions: &Directions, moments: &[[Vec3; 3]]) -> Vec3 {
    let length = |m: &[Vec3; 3]| (m[0] + m[1] + m[2]).as_dvec3().length();
    let whole: f64 = moments.iter().map(length).sum();
    let strongest = (0..moments.len()).max_by(|&a, &b| {
        // The first of equal ones.
        let by_length = length(&moments[a]).total_cmp(&length(&moments[b]));
        by_length.then(b.cmp(&a))
    });
    let Some(slot) = strongest.filter(|_| whole > 0.0) else {
        return Vec3::ZERO;
    };
    let direction = directions.centre(slot);
    let chroma = MOST_CHROMA * (length(&moments[slot]) / whole).sqrt();
    // Oklab's red lies at 29 degrees.
    let hue = direction.y.atan2(direction.x) + 29.0_f64.to_radians();
    let [low, high] = LIGHTNESS;
    let lightness = low + (high - low) * direction.z;
    oklab(lightness, chroma * hue.cos(), chroma * hue.sin())
        .max(DVec3::ZERO)
        .as_vec3()
}

/// Linear sRGB of a colour in Oklab (Ottosson 2020).
fn oklab(lightness: f64, a: f64, b: f64) -> DVec3 {
    let l = (lightness + 0.396_337_777_4 * a + 0.215_803_757_3 * b).powi(3);
    let m = (lightness - 0.105_561_345_8 * a - 0.063_854_172_8 * b).powi(3);
    let s = (lightness - 0.089_484_177_5 * a - 1.291_485_548_0 * b).powi(3);
    DVec3::new(
        4.076_741_662_1 * l - 3.307_711_591_3 * m + 0.230_969_929_2 * s,
        -1.268_438_004_6 * l + 2.609_757_401_1 * m - 0.341_319_396_5 * s,
        -0.004_196_086_3 * l - 0.703_418_614_7 * m + 1.707_614_701_0 * s,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn oklab_has_the_primaries() {
        // Ottosson's own values of white and of sRGB's red have three digits.
        for (given, expected) in [
            ([1.0, 0.0, 0.0], DVec3::ONE),
            ([0.628, 0.225, 0.126], DVec3::X),
        ] {
            let found = oklab(given[0], given[1], given[2]);
            assert!(found.distance(expected) < 5e-3, "{found} for {expected}");
        }
    }

    #[test]
    fn colours_tell_the_strongest_slot() {
        let directions = Directions::new(64).expect("a number of the paper");
        let one = |towards: DVec3| {
            let mut moments = [[Vec3::ZERO; 3]; 64];
            moments[directions.slot_of(towards)] = [towards.as_vec3(); 3];
            slot_colour(&directions, &moments)
        };
        let along_u = one(DVec3::new(0.9, 0.1, 0.3).normalize());
        let against = one(DVec3::new(-0.9, 0.1, 0.3).normalize());
        assert!(along_u.x > along_u.y.max(along_u.z), "{along_u}");
        assert!(against.x < against.y.max(against.z), "{against}");
        let up = one(DVec3::new(0.1, 0.1, 1.0).normalize());
        assert!(up.element_sum() > 2.0 * along_u.element_sum(), "{up}");
        // Uniform light is nearly grey: one of 64 slots has an eighth of the chroma.
        let even: Vec<_> = (0..64)
            .map(|k| [directions.centre(k).as_vec3(); 3])
            .collect();
        let grey = slot_colour(&directions, &even);
        let spread = grey.max_element() - grey.min_element();
        assert!(spread < 0.5 * grey.max_element(), "{grey}");
        assert_eq!(slot_colour(&directions, &[[Vec3::ZERO; 3]; 64]), Vec3::ZERO);
    }
}
