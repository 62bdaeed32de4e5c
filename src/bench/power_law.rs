//! The exponent p of y = c·xᵖ, with its confidence interval.

use serde::Serialize;

/// A fit of measured points by y = c·xᵖ: a straight line through their logarithms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PowerLaw {
    pub exponent: f64,
    /// Half of the exponent's 95 % interval; none of two points, which any line fits.
    pub interval: Option<f64>,
}

/// 97.5 % points of Student's t for 1, 2, 3 … degrees of freedom; beyond, the last one is 3 % too
/// wide at most.
const STUDENT_95: [f64; 10] = [
    12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228,
];

impl PowerLaw {
    /// Least squares over the points (x, y) above 0; none of fewer than two different x.
    pub fn fit(points: &[(f64, f64)]) -> Option<Self> {
        let logs: Vec<(f64, f64)> = points
            .iter()
            .filter(|p| p.0 > 0.0 && p.1 > 0.0)
            .map(|p| (p.0.ln(), p.1.ln()))
            .collect();
        let count = logs.len() as f64;
        let mean = |value: fn(&(f64, f64)) -> f64| logs.iter().map(value).sum::<f64>() / count;
        let (x, y) = (mean(|p| p.0), mean(|p| p.1));
        let squares: f64 = logs.iter().map(|p| (p.0 - x).powi(2)).sum();
        if logs.len() < 2 || squares <= 0.0 {
            return None;
        }
        let exponent = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / squares;
        let residuals: f64 = logs
            .iter()
            .map(|p| (p.1 - y - exponent * (p.0 - x)).powi(2))
            .sum();
        let freedom = logs.len() - 2;
        let interval = freedom.checked_sub(1).map(|i| {
            let student = STUDENT_95[i.min(STUDENT_95.len() - 1)];
            student * (residuals / freedom as f64 / squares).sqrt()
        });
        Some(Self { exponent, interval })
    }
}

impl std::fmt::Display for PowerLaw {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.interval {
            Some(interval) => write!(f, "{:.2} ± {interval:.2}", self.exponent),
            None => write!(f, "{:.2}", self.exponent),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::PowerLaw;

    /// Logarithms of numbers below 10⁶ and their sums round by some 1e-15 of each.
    const ROUNDING: f64 = 1e-12;

    #[test]
    fn exact_powers_and_known_spread() {
        let exact: Vec<_> = [1e4, 2e4, 4e4, 8e4]
            .map(|x: f64| (x, 3.0 * x.powf(1.25)))
            .into();
        let fit = PowerLaw::fit(&exact).expect("four points");
        assert!((fit.exponent - 1.25).abs() < ROUNDING, "{fit:?}");
        assert!(fit.interval.expect("of four points") < 1e-6, "{fit:?}");
        // ln y = 0, 1, 0 over ln x = −1, 0, 1: slope 0, residual 2/3 over one degree of freedom,
        // squares 2.
        let e = std::f64::consts::E;
        let fit = PowerLaw::fit(&[(1.0 / e, 1.0), (1.0, e), (e, 1.0)]).expect("three points");
        let interval = fit.interval.expect("of three points");
        assert!(fit.exponent.abs() < ROUNDING, "{fit:?}");
        assert!(
            (interval - 12.706 * (1.0f64 / 3.0).sqrt()).abs() < ROUNDING,
            "{fit:?}"
        );
    }

    #[test]
    fn too_few_points() {
        assert_eq!(PowerLaw::fit(&[(1.0, 2.0)]), None);
        assert_eq!(PowerLaw::fit(&[(1.0, 2.0), (1.0, 3.0)]), None);
        let two = PowerLaw::fit(&[(1.0, 2.0), (2.0, 4.0)]).expect("two points");
        assert_eq!(two.interval, None);
        assert_eq!(PowerLaw::fit(&[(1.0, 0.0), (2.0, 4.0)]), None);
    }
}
