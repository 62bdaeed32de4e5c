//! Error against the reference with its confidence interval, and the best measurements.

use glam::{DVec3, Vec3};
use serde::Serialize;

use super::places::Place;
use super::truth::{PARTS, Parts, Truth, average, mean};
use crate::bake::solution::corner_light;
use crate::math::random::below;
use crate::path_tracer::NORMAL_95;
use crate::scene::Scene;

/// Resamples of the bootstrap: the ends of a 95 % interval lie 25 from its ends.
const RESAMPLES: usize = 1000;

/// The worst part of the compared area, of which the share of the squared error is given.
const WORST: f64 = 0.001;

/// Error over places by the area that they stand for, colours together, as shares of the mean
/// irradiance of the reference.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Figures {
    /// Root of the mean square without the reference's noise; 0 where the noise is larger.
    pub rms: f64,
    /// 95 % interval of `rms` by the percentile bootstrap over the places (Efron 1979), as if they
    /// were not stratified.
    pub rms_interval: [f64; 2],
    /// Mean difference, and half of its 95 % interval.
    pub bias: f64,
    pub bias_interval: f64,
    /// Share of the squared error in the worst 0.1 % of the area; null where the noise hides the
    /// error.
    pub worst_share: Option<f64>,
}

/// Error of a solution.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Measure {
    /// At the centroids of the elements, of the elements' light.
    #[serde(flatten)]
    pub centroids: Figures,
    /// At random points of the elements, of the light that is linear between their corners.
    pub points: Figures,
}

impl Measure {
    /// `elements` is irradiance `[triangle]`, `corners` `[triangle][corner]`, W·m⁻².
    pub fn new(elements: &[Vec3], corners: &[[Vec3; 3]], truth: &Truth) -> Self {
        let between = |place: &Place| place.between(&corners[place.triangle]);
        let points: Vec<Vec3> = truth.places.iter().map(between).collect();
        Self {
            centroids: Figures::new(&truth.at_places(elements), &truth.centroids, &truth.places),
            points: Figures::new(&points, &truth.points, &truth.places),
        }
    }

    /// Of a method that gives irradiance of elements only: linear between corners as a bake's is.
    pub fn of_elements(scene: &Scene, elements: &[Vec3], truth: &Truth) -> Self {
        Self::new(elements, &corner_light(scene, elements), truth)
    }
}

/// How far a value is from each part of the reference.
fn apart(ours: Vec3, truth: &Parts) -> [DVec3; PARTS] {
    truth.map(|part| ours.as_dvec3() - part.as_dvec3())
}

/// The mean over the colours of the product of two differences. Where their noise is independent it
/// is the square of the error without noise, on average.
fn product(a: DVec3, b: DVec3) -> f64 {
    a.dot(b) / 3.0
}

/// Mean square of `ours − truth` at each place over the colours, without the truth's noise.
pub fn net_squares(ours: &[Vec3], truth: &[Parts]) -> Vec<f64> {
    let places = ours.iter().zip(truth);
    places
        .map(|(&ours, truth)| {
            let [a, b, c] = apart(ours, truth);
            (product(a, b) + product(b, c) + product(c, a)) / 3.0
        })
        .collect()
}

/// The sum of squares on the worst places, by weight. One part of the reference selects them and
/// the two others give the square: what noise selects has no square, so that it can only hide a
/// part of the share.
fn worst_squares(ours: &[Vec3], truth: &[Parts], places: &[Place]) -> f64 {
    let differences: Vec<[DVec3; PARTS]> = (ours.iter().zip(truth))
        .map(|(&ours, truth)| apart(ours, truth))
        .collect();
    let by_part = (0..PARTS).map(|part| {
        let size = |i: usize| differences[i][part].length_squared();
        let mut order: Vec<usize> = (0..places.len()).collect();
        order.sort_by(|&a, &b| size(b).total_cmp(&size(a)));
        let (mut sum, mut left) = (0.0, WORST);
        for i in order {
            let weight = places[i].weight.min(left);
            let [one, other] = [1, 2].map(|k| differences[i][(part + k) % PARTS]);
            sum += weight * product(one, other);
            left -= weight;
            if left <= 0.0 {
                break;
            }
        }
        sum
    });
    by_part.sum::<f64>() / PARTS as f64
}

impl Figures {
    /// `ours` is `[place]`, W·m⁻².
    pub fn new(ours: &[Vec3], truth: &[Parts], places: &[Place]) -> Self {
        let mean = mean(places, truth);
        let squares = net_squares(ours, truth);
        let sum: f64 = (places.iter().zip(&squares))
            .map(|(p, square)| p.weight * square)
            .sum();
        // Errors of a place's colours are correlated: the interval is that of the places' means.
        let apart: Vec<f64> = (ours.iter().zip(truth))
            .map(|(ours, truth)| (ours.as_dvec3() - average(truth)).element_sum() / 3.0)
            .collect();
        let bias: f64 = (places.iter().zip(&apart))
            .map(|(p, apart)| p.weight * apart)
            .sum();
        let count = places.len() as f64;
        let spread = (places.iter().zip(&apart))
            .map(|(p, apart)| (p.weight * (apart - bias)).powi(2))
            .sum::<f64>()
            * count
            / (count - 1.0).max(1.0);
        let worst = worst_squares(ours, truth, places) / sum;
        Self {
            rms: sum.max(0.0).sqrt() / mean,
            rms_interval: bootstrap(&squares, places).map(|square| square.max(0.0).sqrt() / mean),
            bias: bias / mean,
            bias_interval: NORMAL_95 * spread.sqrt() / mean,
            worst_share: (sum > 0.0).then_some(worst.clamp(0.0, 1.0)),
        }
    }
}

impl Figures {
    /// Cells of a CSV file: rms and its interval, bias and its interval, worst share.
    pub fn cells(&self) -> String {
        let worst = self
            .worst_share
            .map_or(String::new(), |share| share.to_string());
        let [low, high] = self.rms_interval;
        let (rms, bias, interval) = (self.rms, self.bias, self.bias_interval);
        format!("{rms},{low},{high},{bias},{interval},{worst}")
    }

    /// [`Self::worst_share`] for a table.
    pub fn worst_percent(&self) -> String {
        self.worst_share
            .map_or("-".into(), |share| format!("{:.1}", 100.0 * share))
    }
}

/// 95 % interval of the weighted mean of values `[place]`.
fn bootstrap(values: &[f64], places: &[Place]) -> [f64; 2] {
    let mut state = 1_u64;
    let mut drawn: Vec<f64> = (0..RESAMPLES)
        .map(|_| {
            let (mut sum, mut weights) = (0.0, 0.0);
            for _ in 0..places.len() {
                let i = below(&mut state, places.len());
                sum += places[i].weight * values[i];
                weights += places[i].weight;
            }
            sum / weights
        })
        .collect();
    drawn.sort_by(f64::total_cmp);
    let end = RESAMPLES / 40;
    [drawn[end], drawn[RESAMPLES - 1 - end]]
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

    fn even(count: usize) -> Vec<Place> {
        (0..count)
            .map(|triangle| Place {
                triangle,
                point: [1.0, 0.0, 0.0],
                weight: 1.0 / count as f64,
            })
            .collect()
    }

    /// About the standard normal distribution: the sum of twelve uniform numbers less 6.
    fn normal(state: &mut u64) -> f32 {
        let unit = |state: &mut u64| below(state, 1 << 24) as f32 / (1 << 24) as f32;
        (0..12).map(|_| unit(state)).sum::<f32>() - 6.0
    }

    #[test]
    fn front_is_what_nothing_beats() {
        let points = [(1.0, 5.0), (2.0, 6.0), (2.0, 3.0), (4.0, 3.0), (5.0, 1.0)];
        assert_eq!(front(&points), [true, false, true, false, true]);
    }

    /// Places that err by a normal variable of 10 % of a truth whose parts are known to 20 %, with
    /// a bias of 5 %: rms is √(0.05² + 0.1²) of the mean, and the interval holds it.
    #[test]
    fn error_is_that_of_a_known_distribution() {
        const PLACES: usize = 20_000;
        let mut state = 7;
        let (mut truth, mut ours) = (Vec::new(), Vec::new());
        for _ in 0..PLACES {
            ours.push(Vec3::splat(2.0 * (1.05 + 0.1 * normal(&mut state))));
            let part = |_| Vec3::splat(2.0 * (1.0 + 0.2 * normal(&mut state)));
            truth.push([0, 1, 2].map(part));
        }
        let found = Figures::new(&ours, &truth, &even(PLACES));
        let exact = 0.0125_f64.sqrt();
        // The variance of one estimate by its parts: √(Var) of the error's square, of its products
        // with the noise, and of the noise's products, over the places.
        let (error, noise) = (0.01_f64, 0.04_f64);
        let squares = 2.0 * error * error + 4.0 * 0.0025 * error;
        let variance = squares + 4.0 * 0.0125 * noise / 3.0 + noise * noise / 3.0;
        let half = 1.96 * (variance / PLACES as f64).sqrt() / (2.0 * exact);
        assert!((found.rms - exact).abs() < 2.0 * half, "{found:?}");
        assert!(found.rms_interval[0] < exact && exact < found.rms_interval[1]);
        let width = found.rms_interval[1] - found.rms_interval[0];
        assert!((width / (2.0 * half) - 1.0).abs() < 0.15, "{width} {half}");
        // Two standard errors more than the interval.
        assert!((found.bias - 0.05).abs() < 2.0 * found.bias_interval);
        // √(0.01 + 0.04 / 3) about the truth and the sample both.
        let spread = 1.96 * (error + noise / 3.0).sqrt() / (PLACES as f64).sqrt();
        assert!((found.bias_interval / spread - 1.0).abs() < 0.05);
    }

    /// Without noise, 10 of 20,000 places that are 50 % off beside 1 % everywhere have
    /// 0.0005 · 0.25 of 0.0005 · 0.25 + 0.9995 · 0.0001 of the square, and as many others the rest
    /// of the worst 0.1 %. Noise hides some of that, and on an error of 1 % everywhere makes no
    /// share above the 0.1 % that those places have of the area.
    #[test]
    fn worst_share_is_not_made_of_noise() {
        const PLACES: usize = 20_000;
        let share = |planted: f32, noise: f32| {
            let mut state = 3;
            let ours: Vec<Vec3> = (0..PLACES)
                .map(|i| Vec3::splat(1.0 + if i < 10 { planted } else { 0.01 }))
                .collect();
            let part = |state: &mut u64| Vec3::splat(1.0 + noise * normal(state));
            let truth: Vec<Parts> = (0..PLACES)
                .map(|_| std::array::from_fn(|_| part(&mut state)))
                .collect();
            let found = Figures::new(&ours, &truth, &even(PLACES)).worst_share;
            found.expect("an error larger than its noise")
        };
        let (tail, rest) = (0.0005 * 0.25, 0.9995 * 1e-4);
        let exact = (tail + 0.0005 * 1e-4) / (tail + rest);
        assert!((share(0.5, 0.0) / exact - 1.0).abs() < 1e-4);
        let noisy = share(0.5, 0.05);
        assert!(
            noisy > 0.8 * exact && noisy < 1.2 * exact,
            "{noisy} of {exact}"
        );
        // The products' own noise: 0.02² / √20, over the sum of squares of 20,000.
        let even = share(0.01, 0.02);
        assert!(even < 0.005, "{even}");
    }
}
