//! Factors of reliefs and coefficients of their light, packed for the relief pass into about half
//! the size of floats: a software device spends most of this light's time on reading them.

use glam::Vec3;

use crate::constants::MOST_RANK;
use crate::meso::{CORNERS, Factors};

/// Ranks of one texel of the factors.
const OF_TEXEL: usize = 2;
/// The shader's loop takes this many ranks at once; the list is padded with ranks of 0.
const AT_ONCE: usize = 4;
/// The largest factor of a rank as a signed number of 16 bits.
const STEPS: f32 = 32767.0;
/// The shader reads a factor as the upper half of a whole number.
const UPPER: f32 = 65536.0;

/// Factors of one surface, in steps of the largest of their rank.
pub struct PackedFactors {
    /// `[cell][corner][rank / 2]`: of a rank RGB and w in 16 bits each, the first in the lower half
    /// of its word.
    pub texels: Vec<[u32; 4]>,
    /// Number of ranks, with the padding.
    pub rank: u32,
    /// What the coefficients of each rank are to be multiplied by: those of the light inside and of
    /// the light that arrives.
    scales: Vec<[f32; 2]>,
}

impl PackedFactors {
    pub fn new(factors: &Factors) -> Self {
        let rank = factors.rank;
        let padded = rank.next_multiple_of(AT_ONCE);
        let mut largest = vec![[0.0_f32; 2]; rank];
        for corner in factors.corners.chunks_exact(rank) {
            for ([inside, outside], of) in largest.iter_mut().zip(corner) {
                *inside = inside.max(of.truncate().abs().max_element());
                *outside = outside.max(of.w.abs());
            }
        }
        let steps = |largest: f32| if largest > 0.0 { STEPS / largest } else { 0.0 };
        let steps: Vec<[f32; 2]> = largest.iter().map(|of| of.map(steps)).collect();
        let cells = factors.corners.len() / (rank * CORNERS);
        let mut texels = Vec::with_capacity(cells * CORNERS * padded / OF_TEXEL);
        for corner in factors.corners.chunks_exact(rank) {
            let words = |r: usize| match (corner.get(r), steps.get(r)) {
                (Some(of), Some(&[inside, outside])) => {
                    let [r, g, b] = (of.truncate() * inside).to_array().map(half);
                    let w = half(of.w * outside);
                    [r | g << 16, b | w << 16]
                }
                _ => [0; 2],
            };
            texels.extend((0..padded).step_by(OF_TEXEL).map(|r| {
                let ([a, b], [c, d]) = (words(r), words(r + 1));
                [a, b, c, d]
            }));
        }
        let scale = |largest: f32| largest / (STEPS * UPPER);
        Self {
            texels,
            rank: padded as u32,
            scales: largest.iter().map(|of| of.map(scale)).collect(),
        }
    }

    /// Coefficients of light on the surface, `[MOST_RANK]`; those of ranks that are missing are 0.
    /// `inside` and `arriving` are `[rank]`, or empty where there is no such light.
    pub fn coefficients<'a>(
        &'a self,
        inside: &'a [Vec3],
        arriving: &'a [Vec3],
    ) -> impl Iterator<Item = [u32; 4]> + 'a {
        (0..MOST_RANK as usize).map(|r| {
            let of = |list: &[Vec3]| list.get(r).copied().unwrap_or_default();
            let [inside_scale, scale] = self.scales.get(r).copied().unwrap_or_default();
            packed(inside_scale * of(inside), scale * of(arriving))
        })
    }
}

/// A whole number in 16 bits.
fn half(steps: f32) -> u32 {
    u32::from(steps.round_ties_even() as i16 as u16)
}

/// Six floats in the upper 21 bits of each: those of `first` and of `second.x` in the upper 21 bits
/// of a word, 11 and 10 bits of `second.y` in what the first two words have left, and `second.z` in
/// that of the others.
fn packed(first: Vec3, second: Vec3) -> [u32; 4] {
    // To the nearest, the upper one of two.
    let upper = |value: f32| (value.to_bits() + (1 << 10)) >> 11;
    let words = [first.x, first.y, first.z, second.x].map(|value| upper(value) << 11);
    let [y, z] = [second.y, second.z].map(upper);
    let rest = [y >> 10, (y & 0x3ff) << 1, z >> 10, (z & 0x3ff) << 1];
    [0, 1, 2, 3].map(|i| words[i] | rest[i])
}

#[cfg(test)]
mod tests {
    use glam::Vec4;

    use super::*;

    /// As the shader reads them.
    fn unpacked(of: [u32; 4]) -> [f32; 6] {
        let rest = |a: u32, b: u32| a << 21 | (b & 0x7fe) << 10;
        let words = of.map(|word| word & 0xffff_f800);
        let [a, b, c, d] = words;
        [a, b, c, d, rest(of[0], of[1]), rest(of[2], of[3])].map(f32::from_bits)
    }

    /// Of all sizes and signs, to 2⁻¹³ of each.
    #[test]
    fn six_floats_are_one_texel() {
        let value = |i: u32| {
            let sign = if i.is_multiple_of(3) { -1.0 } else { 1.0 };
            sign * (1.0 + (i as f32 * 0.618).fract()) * (0.2 * (i as f32 - 300.0)).exp2()
        };
        let mut worst = 0.0_f32;
        for i in 0..600 {
            let values = [0, 1, 2, 3, 4, 5].map(|k| value(i + k));
            let [first, second] = [0, 3].map(|k| Vec3::from_slice(&values[k..]));
            for (found, value) in unpacked(packed(first, second)).into_iter().zip(values) {
                worst = worst.max((found / value - 1.0).abs());
            }
        }
        println!("off by {worst:.1e} at most");
        assert!(worst <= 0.5_f32.powi(13) && worst > 0.5_f32.powi(14));
        assert_eq!(unpacked(packed(Vec3::ZERO, Vec3::ZERO)), [0.0; 6]);
    }

    /// Sums of factors times coefficients, of a rank that is not a multiple of what is read at
    /// once, of sizes that differ by rank and without any light outside.
    #[test]
    fn sums_are_as_of_floats() {
        let rank = 6;
        let value = |i: usize| ((i as f32 * 0.618).fract() - 0.5) * 10.0_f32.powi(3 - i as i32 % 6);
        let corners: Vec<Vec4> = (0..2 * CORNERS * rank)
            .map(|i| {
                let w = if i % rank == 2 {
                    0.0
                } else {
                    value(i + 9 * rank)
                };
                Vec4::new(value(i), value(i + 3 * rank), value(i + 6 * rank), w)
            })
            .collect();
        let factors = Factors {
            rank,
            basis: Vec::new(),
            corners,
            error: 0.0,
        };
        let packed = PackedFactors::new(&factors);
        assert_eq!((packed.rank, packed.texels.len()), (8, 2 * CORNERS * 4));
        let light = |from: usize| -> Vec<Vec3> {
            let one = |r: usize| Vec3::new(1.0, 2.0, -0.5) * 10.0_f32.powi(r as i32 % 6 - 3);
            (0..rank).map(|r| one(r) * (1.0 + from as f32)).collect()
        };
        let (inside, arriving) = (light(0), light(1));
        let coefficients: Vec<[f32; 6]> = packed
            .coefficients(&inside, &arriving)
            .map(unpacked)
            .collect();
        assert_eq!(coefficients.len(), MOST_RANK as usize);
        let upper = |word: u32| (word & 0xffff_0000) as i32 as f32;
        for (at, expected) in factors.corners.chunks_exact(rank).enumerate() {
            let (mut sum, mut size, mut found) = (Vec3::ZERO, 0.0_f32, Vec3::ZERO);
            for (r, of) in expected.iter().enumerate() {
                let one = of.truncate() * inside[r] + of.w * arriving[r];
                sum += one;
                size += one.abs().max_element();
            }
            for (r, c) in coefficients.iter().enumerate().take(8) {
                let [a, b] = [0, 1].map(|k| packed.texels[at * 4 + r / 2][r % 2 * 2 + k]);
                let factor = [upper(a << 16), upper(a), upper(b << 16)];
                let [first, second] = [0, 3].map(|k| Vec3::from_slice(&c[k..]));
                found += Vec3::from(factor) * first + upper(b) * second;
            }
            assert!(
                (found - sum).abs().max_element() < 5e-4 * size,
                "{found} {sum}"
            );
            assert!(found != sum);
        }
    }
}
