//! How the radiance of a picture becomes the codes of a PNG.

use glam::{DMat3, DVec3};

use super::tone;

/// Exposure, white and tones of a picture, and the kind of PNG.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Development {
    /// The radiance is multiplied by 2 to this power. None: so that the 90th percentile of the
    /// luminance of surfaces that do not emit becomes 0.6.
    pub exposure: Option<f32>,
    /// The colour of light, linear RGB, in which a white surface is shown white; None: that of
    /// sRGB, D65.
    pub white: Option<[f32; 3]>,
    pub tone: Tone,
    pub codes: Codes,
}

/// What becomes of light that is brighter than a picture can be.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Tone {
    /// Compressed, its hue kept: [`tone::neutral`].
    #[default]
    Neutral,
    /// Cut off at 1, and all else as it is.
    Cut,
}

/// The codes of a PNG.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Codes {
    /// 8 bits, sRGB, with an ordered dither of half a code.
    #[default]
    Srgb8,
    /// 16 bits, sRGB.
    Srgb16,
    /// 16 bits, linear; the file says so.
    Linear16,
}

impl From<Option<f32>> for Development {
    fn from(exposure: Option<f32>) -> Self {
        Self {
            exposure,
            ..Self::default()
        }
    }
}

impl Development {
    /// What it makes of a radiance, linear RGB in 0..=1 and a little beyond; `automatic` is the
    /// exposure where none is given.
    pub fn shown(self, automatic: f32) -> impl Fn([f32; 3]) -> [f32; 3] + Sync {
        let scale = self.exposure.unwrap_or(automatic).exp2();
        let balance = self.white.map(balance);
        let tone = self.tone;
        move |radiance| {
            let radiance = match balance {
                None => radiance,
                Some(by) => {
                    let adapted = by * DVec3::from(radiance.map(f64::from));
                    adapted.max(DVec3::ZERO).as_vec3().to_array()
                }
            };
            let exposed = radiance.map(|c| c * scale);
            match tone {
                Tone::Neutral => tone::neutral(exposed),
                Tone::Cut => exposed.map(|c| c.clamp(0.0, 1.0)),
            }
        }
    }
}

/// Linear sRGB to XYZ, IEC 61966-2-1, row by row.
const TO_XYZ: [[f64; 3]; 3] = [
    [0.412_456_4, 0.357_576_1, 0.180_437_5],
    [0.212_672_9, 0.715_152_2, 0.072_175_0],
    [0.019_333_9, 0.119_192_0, 0.950_304_1],
];

/// XYZ to the responses of cones, Bradford (Lam 1985), row by row.
const TO_CONES: [[f64; 3]; 3] = [
    [0.8951, 0.2664, -0.1614],
    [-0.7502, 1.7135, 0.0367],
    [0.0389, -0.0685, 1.0296],
];

/// The matrix for linear sRGB by which light of this colour becomes white of the same luminance:
/// each response of the cones is scaled (von Kries 1902).
fn balance(white: [f32; 3]) -> DMat3 {
    let rows = |of: [[f64; 3]; 3]| DMat3::from_cols_array_2d(&of).transpose();
    let cones = rows(TO_CONES) * rows(TO_XYZ);
    let white = DVec3::from(white.map(f64::from));
    let luminance = DVec3::from(TO_XYZ[1]).dot(white);
    let gains = (cones * DVec3::splat(luminance)) / (cones * white);
    cones.inverse() * DMat3::from_diagonal(gains) * cones
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The light of the Cornell box, of a candle, and of a blue sky become grey of their luminance;
    /// white stays as it is, and so does a surface under white light.
    #[test]
    fn the_white_is_shown_white() {
        let luminance = |c: [f32; 3]| (0..3).map(|k| c[k] * TO_XYZ[1][k] as f32).sum::<f32>();
        for white in [[17.0, 12.0, 4.0], [1.0, 0.3, 0.02], [0.4, 0.6, 1.0]] {
            let development = Development {
                exposure: Some(0.0),
                white: Some(white),
                tone: Tone::Cut,
                ..Development::default()
            };
            let shown = development.shown(3.0)(white.map(|c| 0.25 * c / luminance(white)));
            assert!(shown.iter().all(|c| (c - 0.25).abs() < 1e-4), "{shown:?}");
        }
        let same = balance([2.0; 3]) * DVec3::new(0.2, 0.5, 0.9);
        assert!(same.distance(DVec3::new(0.2, 0.5, 0.9)) < 1e-6);
    }

    #[test]
    fn the_exposure_is_that_which_is_given() {
        let plain = |exposure, tone| {
            let of = Development {
                exposure,
                tone,
                ..Development::default()
            };
            of.shown(1.0)([0.25, 0.25, 4.0])
        };
        assert_eq!(plain(None, Tone::Cut), [0.5, 0.5, 1.0]);
        assert_eq!(plain(Some(-1.0), Tone::Cut), [0.125, 0.125, 1.0]);
        let neutral = plain(None, Tone::Neutral);
        assert!(neutral[2] < 1.0 && neutral[2] > 0.9, "{neutral:?}");
    }
}
