//! The fixed point of an affine map that may well push away from it: Anderson's acceleration (1965)
//! of x ← g(x).
//!
//! Two surfaces close before each other, of reflectance ρ, give light to each other both by the
//! rows of their sources, which are solved together, and part by part, which follows by turns. A
//! turn multiplies the error of the light that they share by −ρ/(1 − ρ): from ρ = 0.5 on turns
//! alone diverge.

use glam::DVec3;
use nalgebra::{DMatrix, DVector};

/// Steps that are remembered.
const STEPS: usize = 8;

/// Singular values below this share of the largest count as none.
const LEAST_SINGULAR: f64 = 1e-9;

/// The last steps: what was put in, and what came out.
#[derive(Debug, Default)]
pub(super) struct Turns {
    steps: Vec<[Vec<DVec3>; 2]>,
}

impl Turns {
    /// The map is another from now on.
    pub fn forget(&mut self) {
        self.steps.clear();
    }

    /// What to put in next after `x` gave `g`: of the sums of steps (weights of sum 1) the one that
    /// would have changed least, by `weights`, `[component]`; each colour by itself.
    pub fn next(&mut self, x: Vec<DVec3>, g: Vec<DVec3>, weights: &[f64]) -> Vec<DVec3> {
        if self.steps.len() == STEPS {
            self.steps.remove(0);
        }
        let mut next = g.clone();
        if self.steps.is_empty() {
            self.steps.push([x, g]);
            return next;
        }
        let earlier = &self.steps;
        let count = earlier.len();
        for colour in 0..3 {
            let now = |i: usize| g[i][colour] - x[i][colour];
            // How what is left changes from each earlier step to this one.
            let change = |k: usize, i: usize| {
                let [x, g] = &earlier[k];
                now(i) - (g[i][colour] - x[i][colour])
            };
            let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| -> f64 {
                let terms = weights.iter().enumerate();
                terms.map(|(i, weight)| weight * a(i) * b(i)).sum()
            };
            let normal = DMatrix::from_fn(count, count, |k, l| {
                product(&|i| change(k, i), &|i| change(l, i))
            });
            let right = DVector::from_fn(count, |k, _| product(&|i| change(k, i), &now));
            let svd = normal.svd(true, true);
            let least = LEAST_SINGULAR * svd.singular_values.max();
            let Ok(shares) = svd.solve(&right, least) else {
                continue;
            };
            for (k, [_, before]) in earlier.iter().enumerate() {
                for (i, next) in next.iter_mut().enumerate() {
                    next[colour] -= shares[k] * (g[i][colour] - before[i][colour]);
                }
            }
        }
        self.steps.push([x, g]);
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Three modes that turns multiply by −2.3, −0.8 and 0.9: exact after four.
    #[test]
    fn finds_a_fixed_point_that_turns_run_away_from() {
        let gains = [DVec3::splat(-2.3), DVec3::splat(-0.8), DVec3::splat(0.9)];
        let fixed = DVec3::new(1.0, 2.0, 3.0);
        let map = |x: &[DVec3]| -> Vec<DVec3> {
            let modes = x.iter().zip(gains);
            modes.map(|(x, gain)| fixed + gain * (*x - fixed)).collect()
        };
        let mut turns = Turns::default();
        let mut x = vec![DVec3::ZERO; 3];
        for _ in 0..4 {
            let g = map(&x);
            x = turns.next(x, g, &[1.0, 2.0, 0.5]);
        }
        let off = x.iter().map(|x| x.distance(fixed)).fold(0.0, f64::max);
        assert!(off < 1e-6, "{off:e}");
    }
}
