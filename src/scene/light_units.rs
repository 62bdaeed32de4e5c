//! Photometric units and colours of light.

use super::maps::LUMINANCE;

/// Lumens of a watt of green light (CIE). Lumens, candelas and lux over this are the watts of each
/// channel of white light.
pub const LUMENS_OF_A_WATT: f64 = 683.0;

/// Temperatures, kelvins, at which [`planckian`] holds.
pub const KELVINS: std::ops::RangeInclusive<f64> = 1000.0..=15000.0;

/// Linear sRGB of luminance 1 with the chromaticity of a black body; colours outside the gamut,
/// below some 1,900 K, lose their negative blue.
pub fn planckian(kelvin: f64) -> [f64; 3] {
    let (x, y) = planckian_xy(kelvin);
    let (x, y, z) = (x / y, 1.0, (1.0 - x - y) / y);
    // IEC 61966-2-1.
    let rgb = [
        3.240_454_2 * x - 1.537_138_5 * y - 0.498_531_4 * z,
        -0.969_266_0 * x + 1.876_010_8 * y + 0.041_556_0 * z,
        0.055_643_4 * x - 0.204_025_9 * y + 1.057_225_2 * z,
    ];
    of_luminance_1(rgb.map(|c: f64| c.max(0.0)))
}

/// CIE 1931 chromaticity of a black body: M. Krystek, "An algorithm to calculate correlated colour
/// temperature", Color Research & Application 10 (1985). Its u and v are exact to 9·10⁻⁵.
pub fn planckian_xy(kelvin: f64) -> (f64, f64) {
    let t = kelvin;
    let u = (0.860_117_757 + t * (1.541_182_54e-4 + t * 1.286_412_12e-7))
        / (1.0 + t * (8.424_202_35e-4 + t * 7.081_451_63e-7));
    let v = (0.317_398_726 + t * (4.228_062_45e-5 + t * 4.204_816_91e-8))
        / (1.0 + t * (-2.897_418_16e-5 + t * 1.614_560_53e-7));
    let d = 2.0 * u - 8.0 * v + 4.0;
    (3.0 * u / d, 2.0 * v / d)
}

/// A colour scaled to luminance 1; it must not be black.
pub(super) fn of_luminance_1(rgb: [f64; 3]) -> [f64; 3] {
    let luminance = luminance(rgb);
    rgb.map(|c| c / luminance)
}

/// Rec. 709.
pub(super) fn luminance(rgb: [f64; 3]) -> f64 {
    (rgb.iter().zip(LUMINANCE))
        .map(|(c, weight)| c * f64::from(weight))
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chromaticities_of_black_bodies() {
        // CIE standard illuminant A is one at 2855.5 K on today's scale of temperatures; the others
        // are rows of the usual tables of the Planckian locus, rounded to 1e-4.
        // 3.3e-4: `cargo test --lib light_units -- --nocapture`.
        const MOST: f64 = 7e-4;
        let mut worst: f64 = 0.0;
        for (kelvin, x, y) in [
            (2855.5, 0.44757, 0.40745),
            (4000.0, 0.3805, 0.3768),
            (5000.0, 0.3451, 0.3516),
            (6504.0, 0.3134, 0.3235),
            (10000.0, 0.2807, 0.2884),
        ] {
            let found = planckian_xy(kelvin);
            worst = worst.max((found.0 - x).abs()).max((found.1 - y).abs());
        }
        println!("Planckian locus: {worst:.1e}");
        assert!(worst < MOST, "{worst}");
    }

    #[test]
    fn colours_are_of_luminance_1() {
        for kelvin in [1000.0, 1900.0, 2700.0, 6500.0, 15000.0] {
            let rgb = planckian(kelvin);
            assert!((luminance(rgb) - 1.0).abs() < 1e-12 && rgb.iter().all(|&c| c >= 0.0));
        }
        // Near 6,504 K white is white: the daylight D65 is a little greener.
        let [r, g, b] = planckian(6504.0);
        assert!((r - 1.0).abs() < 0.05 && (g - 1.0).abs() < 0.02 && (b - 1.0).abs() < 0.05);
    }
}
