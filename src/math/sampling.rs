//! Random numbers by sample, directions and places.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

/// SplitMix64 (Steele et al. 2014), a stream for each sample: a path depends only on its number,
/// not on the threads.
pub struct Random(u64);

impl Random {
    /// The stream of a sample of a pixel.
    pub fn new(seed: u64, pixel: u64, sample: u64) -> Self {
        Self(mixed(mixed(mixed(seed) ^ pixel) ^ sample))
    }

    /// Uniform in 0..1, 1 excluded.
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(GOLDEN);
        (mixed(self.0) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn square(&mut self) -> DVec2 {
        DVec2::new(self.unit(), self.unit())
    }
}

const GOLDEN: u64 = 0x9e37_79b9_7f4a_7c15;

fn mixed(state: u64) -> u64 {
    let mut z = state.wrapping_add(GOLDEN);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A direction about the unit vector `normal`, of density cos θ / π (Malley's method).
pub fn cosine_direction(normal: DVec3, at: DVec2) -> DVec3 {
    let (t, b) = normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * at.y).sin_cos();
    let flat = at.x.sqrt();
    (t * (flat * cos) + b * (flat * sin) + normal * (1.0 - at.x).sqrt()).normalize()
}

/// A direction of uniform density over the sphere.
pub fn sphere_direction(at: DVec2) -> DVec3 {
    let height = 1.0 - 2.0 * at.x;
    let (sin, cos) = (TAU * at.y).sin_cos();
    let flat = (1.0 - height * height).max(0.0).sqrt();
    DVec3::new(flat * cos, flat * sin, height)
}

/// The digits of `index` in a base, mirrored at the point (van der Corput): in 0..1, evenly spread
/// over any first indices.
pub fn radical_inverse(base: u32, index: u64) -> f64 {
    let base = u64::from(base);
    let (mut left, mut scale, mut sum) = (index, 1.0, 0.0);
    while left > 0 {
        scale /= base as f64;
        sum += (left % base) as f64 * scale;
        left /= base;
    }
    sum
}

/// A place on a triangle, of uniform density.
pub fn on_triangle([a, b, c]: [DVec3; 3], at: DVec2) -> DVec3 {
    let root = at.x.sqrt();
    a * (1.0 - root) + b * (root * (1.0 - at.y)) + c * (root * at.y)
}

/// Chooses an index with probability proportional to its weight.
#[derive(Debug, Clone, Default)]
pub struct Choice {
    /// Sums of the weights so far, the last one the total.
    sums: Vec<f64>,
}

impl Choice {
    pub fn new(weights: impl Iterator<Item = f64>) -> Self {
        let mut total = 0.0;
        let sums = weights
            .map(|weight| {
                total += weight;
                total
            })
            .collect();
        Self { sums }
    }

    /// The probability of an index.
    pub fn probability(&self, index: usize) -> f64 {
        let before = if index == 0 {
            0.0
        } else {
            self.sums[index - 1]
        };
        (self.sums[index] - before) / self.total()
    }

    /// An index and its probability; None where all weights are 0.
    pub fn choose(&self, at: f64) -> Option<(usize, f64)> {
        let target = at * self.total();
        let index = self.sums.partition_point(|&sum| sum <= target);
        (index < self.sums.len()).then(|| (index, self.probability(index)))
    }

    /// Sum of all weights.
    pub fn total(&self) -> f64 {
        self.sums.last().copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chooses_by_weight_and_never_what_has_none() {
        let choice = Choice::new([0.0, 1.0, 0.0, 3.0, 0.0].into_iter());
        let mut counts = [0; 5];
        for i in 0..1000 {
            let (index, probability) = choice.choose(f64::from(i) / 1000.0).expect("one");
            assert_eq!(probability, [0.0, 0.25, 0.0, 0.75, 0.0][index]);
            counts[index] += 1;
        }
        assert_eq!(counts, [0, 250, 0, 750, 0]);
        assert_eq!(Choice::new([0.0].into_iter()).choose(0.0), None);
    }

    /// Mean cosine 2/3 within five standard errors, and no direction below.
    #[test]
    fn directions_follow_the_cosine() {
        let normal = DVec3::new(0.36, -0.48, 0.8);
        let mut random = Random::new(1, 2, 3);
        const COUNT: usize = 100_000;
        let sum: f64 = (0..COUNT)
            .map(|_| {
                let cosine = cosine_direction(normal, random.square()).dot(normal);
                assert!(cosine >= 0.0);
                cosine
            })
            .sum();
        let deviation = (0.5_f64 - 4.0 / 9.0).sqrt() / (COUNT as f64).sqrt();
        assert!((sum / COUNT as f64 - 2.0 / 3.0).abs() < 5.0 * deviation);
    }
}
