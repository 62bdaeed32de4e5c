//! Error against the reference with its confidence interval, and the best measurements.

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::truth::{Truth, mean};
use crate::path_tracer::NORMAL_95;

/// Resamples of the bootstrap: the ends of a 95 % interval lie 25 from its ends.
const RESAMPLES: usize = 1000;

/// Error over places chosen by area, colours together, as shares of the mean irradiance of the
/// reference.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Measure {
    /// Root of the mean square, less the reference's noise; 0 where the noise is larger.
    pub rms: f64,
    /// 95 % interval of `rms` by the percentile bootstrap over the places (Efron 1979).
    pub rms_interval: [f64; 2],
    /// Mean difference, and half of its 95 % interval.
    pub bias: f64,
    pub bias_interval: f64,
}

/// Mean square of `ours − truth` at each place over the colours, less the square of the truth's own
/// standard error.
pub fn net_squares(ours: &[Vec3], truth: &[Vec3], error: &[Vec3]) -> Vec<f64> {
    let square = |v: Vec3| v.as_dvec3().length_squared() / 3.0;
    let places = ours.iter().zip(truth).zip(error);
    places
        .map(|((ours, truth), error)| square(*ours - *truth) - square(*error))
        .collect()
}

impl Measure {
    /// `ours` is `[place]`, W·m⁻².
    pub fn new(ours: &[Vec3], truth: &Truth) -> Self {
        let mean = mean(&truth.global);
        let squares = net_squares(ours, &truth.global, &truth.global_error);
        let rms = |sum: f64| (sum / squares.len() as f64).max(0.0).sqrt() / mean;
        let mut state = 1_u64;
        let mut drawn: Vec<f64> = (0..RESAMPLES)
            .map(|_| {
                let sum = (0..squares.len()).map(|_| squares[below(&mut state, squares.len())]);
                rms(sum.sum())
            })
            .collect();
        drawn.sort_by(f64::total_cmp);
        let end = RESAMPLES / 40;
        // Errors of a place's colours are correlated: the interval is that of the places' means.
        let apart: Vec<f64> = ours
            .iter()
            .zip(&truth.global)
            .map(|(ours, truth)| DVec3::element_sum((*ours - *truth).as_dvec3()) / 3.0)
            .collect();
        let count = apart.len() as f64;
        let bias = apart.iter().sum::<f64>() / count;
        let spread = apart.iter().map(|a| (a - bias).powi(2)).sum::<f64>() / (count - 1.0).max(1.0);
        Self {
            rms: rms(squares.iter().sum()),
            rms_interval: [drawn[end], drawn[RESAMPLES - 1 - end]],
            bias: bias / mean,
            bias_interval: NORMAL_95 * (spread / count).sqrt() / mean,
        }
    }
}

/// A whole number below `count` (Steele et al. 2014): the same resamples in every run.
fn below(state: &mut u64, count: usize) -> usize {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((u128::from(z ^ (z >> 31)) * count as u128) >> 64) as usize
}

/// Whether each of the points (seconds, error) is beaten by no other in both.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: (f64, f64), b: (f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    points
        .iter()
        .map(|&p| !points.iter().any(|&other| beats(other, p)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn front_is_what_nothing_beats() {
        let points = [(1.0, 5.0), (2.0, 6.0), (2.0, 3.0), (4.0, 3.0), (5.0, 1.0)];
        assert_eq!(front(&points), [true, false, true, false, true]);
    }

    /// Places that err by a normal variable of 10 % of a truth that is itself known to 20 %, with a
    /// bias of 5 %: rms is √(0.05² + 0.1²) of the mean, and the interval holds it.
    #[test]
    fn error_is_that_of_a_known_distribution() {
        const PLACES: usize = 20_000;
        let mut state = 7;
        let mut normal = || {
            // The sum of twelve uniform numbers less 6 has mean 0 and variance 1.
            let unit = |state: &mut u64| below(state, 1 << 24) as f32 / (1 << 24) as f32;
            (0..12).map(|_| unit(&mut state)).sum::<f32>() - 6.0
        };
        let (mut truth, mut ours) = (Truth::default(), Vec::new());
        for _ in 0..PLACES {
            ours.push(Vec3::splat(2.0 * (1.05 + 0.1 * normal())));
            truth.global.push(Vec3::splat(2.0 * (1.0 + 0.2 * normal())));
            truth.global_error.push(Vec3::splat(2.0 * 0.2));
        }
        let found = Measure::new(&ours, &truth);
        let exact = 0.0125_f64.sqrt();
        // Squares of a normal variable of variance v spread by √2 v: half an interval of rms is
        // 1.96 √(2/n) v / 2 rms.
        let half = 1.96 * (2.0 / PLACES as f64).sqrt() * 0.0525 / (2.0 * exact);
        assert!((found.rms - exact).abs() < 2.0 * half, "{found:?}");
        assert!(found.rms_interval[0] < exact && exact < found.rms_interval[1]);
        let width = found.rms_interval[1] - found.rms_interval[0];
        assert!((width / (2.0 * half) - 1.0).abs() < 0.15, "{width} {half}");
        // Two standard errors more than the interval.
        assert!((found.bias - 0.05).abs() < 2.0 * found.bias_interval);
        // √0.05 about the truth and the sample both.
        let spread = 1.96 * 0.05_f64.sqrt() / (PLACES as f64).sqrt();
        assert!((found.bias_interval / spread - 1.0).abs() < 0.05);
    }
}
