//! Codes of kept form factors; `shaders/shared/kept.glsl` is the same.

use glam::{Vec2, Vec3};

const ZERO: u32 = (127 - 43) << 10;
const SHIFT: u32 = 13;

/// A form factor, at least 0, in 16 bits: 6 of exponent from 2⁻⁴³ up, and 10 of mantissa.
pub fn factor_code(f: f32) -> u32 {
    let rounded = (f.max(0.0).to_bits() + (1 << (SHIFT - 1))) >> SHIFT;
    (rounded.max(ZERO) - ZERO).min(0xffff)
}

/// The value of a code.
pub fn kept_factor(code: u32) -> f32 {
    match code {
        0 => 0.0,
        code => f32::from_bits((code + ZERO) << SHIFT),
    }
}

/// A form factor as it is kept.
pub fn as_kept(f: f32) -> f32 {
    kept_factor(factor_code(f))
}

/// A unit vector of the upper hemisphere on the upper half of an octahedron, 16 bits a coordinate.
pub fn direction_code(d: Vec3) -> [u16; 2] {
    let p = d.truncate() / (d.x.abs() + d.y.abs() + d.z.max(0.0));
    let square = 0.5 + 0.5 * Vec2::new(p.x + p.y, p.x - p.y);
    square.to_array().map(|q| (q * 65535.0).round() as u16)
}

pub fn kept_direction(code: [u16; 2]) -> Vec3 {
    let q = Vec2::from(code.map(|c| f32::from(c) / 65535.0)) * 2.0 - 1.0;
    let p = 0.5 * Vec2::new(q.x + q.y, q.x - q.y);
    p.extend((1.0 - p.x.abs() - p.y.abs()).max(0.0)).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half a step of 10 bits.
    const HALF_STEP: f32 = 1.0 / 2048.0;

    #[test]
    fn factors_come_back_within_half_a_step() {
        let mut f = 2.0_f32.powi(-42);
        while f < 2.0_f32.powi(20) {
            let kept = kept_factor(factor_code(f));
            assert!(
                (kept / f - 1.0).abs() <= HALF_STEP,
                "{f:e} comes back as {kept:e}"
            );
            assert_eq!(factor_code(kept), factor_code(f), "{f:e} is kept as itself");
            f *= 1.000_37;
        }
        assert_eq!(kept_factor(factor_code(0.0)), 0.0);
        assert_eq!(kept_factor(factor_code(-1.0)), 0.0);
        assert_eq!(kept_factor(factor_code(1e-20)), 0.0);
        assert!(kept_factor(factor_code(f32::MAX)) >= 2.0_f32.powi(20));
    }

    #[test]
    fn directions_come_back_within_a_step() {
        // Half a step of the square in each coordinate, at most three times as long on the sphere.
        let most = 3.0 * 2.0_f32.sqrt() / 65535.0;
        for i in 0..10_000 {
            let z = (i as f32 + 0.5) / 10_000.0;
            let angle = 2.399_963 * i as f32;
            let flat = (1.0 - z * z).sqrt();
            let d = Vec3::new(flat * angle.cos(), flat * angle.sin(), z);
            let kept = kept_direction(direction_code(d));
            assert!(kept.distance(d) < most, "{d} comes back as {kept}");
            assert_eq!(direction_code(kept), direction_code(d));
        }
    }
}
