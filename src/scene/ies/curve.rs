//! Cubics between points that rise and fall only where the points do.

/// The piecewise cubic of F. N. Fritsch and J. Butland (1984), SIAM J. Sci. Stat. Comput. 5,
/// through points of ascending places.
pub(super) struct Curve {
    places: Vec<f64>,
    values: Vec<f64>,
    slopes: Vec<f64>,
}

impl Curve {
    /// At least two points.
    pub fn new(places: Vec<f64>, values: Vec<f64>) -> Self {
        let count = places.len();
        let widths: Vec<f64> = places.windows(2).map(|w| w[1] - w[0]).collect();
        let rises: Vec<f64> = (values.windows(2).zip(&widths))
            .map(|(v, width)| (v[1] - v[0]) / width)
            .collect();
        let slope = |i: usize| {
            if count == 2 {
                return rises[0];
            }
            if i == 0 {
                return end_slope([widths[0], widths[1]], [rises[0], rises[1]]);
            }
            if i == count - 1 {
                let (near, next) = (count - 2, count - 3);
                return end_slope([widths[near], widths[next]], [rises[near], rises[next]]);
            }
            let (a, b) = (rises[i - 1], rises[i]);
            if a * b <= 0.0 {
                return 0.0;
            }
            // The harmonic mean, weighed by the widths.
            let (before, after) = (widths[i - 1], widths[i]);
            let (wa, wb) = (2.0 * after + before, after + 2.0 * before);
            (wa + wb) / (wa / a + wb / b)
        };
        let slopes = (0..count).map(slope).collect();
        Self {
            places,
            values,
            slopes,
        }
    }

    /// The value at a place; None outside the points.
    pub fn at(&self, place: f64) -> Option<f64> {
        let (first, last) = (*self.places.first()?, *self.places.last()?);
        // Angles in degrees: what lies beyond by rounding is at the end.
        if place < first - 1e-9 || place > last + 1e-9 {
            return None;
        }
        let after = self.places.partition_point(|&p| p <= place);
        let i = after.clamp(1, self.places.len() - 1) - 1;
        let h = self.places[i + 1] - self.places[i];
        let t = ((place - self.places[i]) / h).clamp(0.0, 1.0);
        let (from, to) = (self.values[i], self.values[i + 1]);
        let (rise, fall) = (h * self.slopes[i], h * self.slopes[i + 1]);
        let smooth = t * t * (3.0 - 2.0 * t);
        let bends = t * (1.0 - t) * ((1.0 - t) * rise - t * fall);
        Some((from + (to - from) * smooth + bends).max(0.0))
    }
}

/// The slope at an end by the three points there, limited so that the curve stays between them.
fn end_slope([near, next]: [f64; 2], [rise, after]: [f64; 2]) -> f64 {
    let slope = ((2.0 * near + next) * rise - near * after) / (near + next);
    if slope * rise <= 0.0 {
        0.0
    } else if rise * after <= 0.0 && slope.abs() > 3.0 * rise.abs() {
        3.0 * rise
    } else {
        slope
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_through_the_points_and_never_beyond_them() {
        let places = vec![0.0, 1.0, 3.0, 4.0, 7.0, 9.0];
        let values = vec![0.0, 2.0, 2.5, 8.0, 8.0, 1.0];
        let curve = Curve::new(places.clone(), values.clone());
        for (place, value) in places.iter().zip(&values) {
            assert!((curve.at(*place).unwrap() - value).abs() < 1e-12);
        }
        for i in 0..5 {
            let (low, high) = (values[i].min(values[i + 1]), values[i].max(values[i + 1]));
            for k in 0..=100 {
                let at = places[i] + (places[i + 1] - places[i]) * f64::from(k) / 100.0;
                let value = curve.at(at).unwrap();
                assert!(
                    (low - 1e-12..=high + 1e-12).contains(&value),
                    "{at}: {value}"
                );
            }
        }
        assert!(curve.at(9.1).is_none() && curve.at(-0.1).is_none());
        // A straight line stays one.
        let line = Curve::new(vec![0.0, 1.0, 5.0], vec![1.0, 3.0, 11.0]);
        assert!((line.at(2.5).unwrap() - 6.0).abs() < 1e-12);
    }
}
