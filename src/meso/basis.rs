//! Functions u_r of the direction of incoming light in which the response of a relief is a short
//! sum: R_j(ω) = Σ_r R_jr u_r(ω) for each direction j that it sends to. Light then keeps its own
//! direction, however many directions there are, and an element holds [`RELIEF_RANK`] coefficients
//! Σ E u_r(ω) for irradiances E.
//!
//! They are the constant function 1, so that power is exact, and the directions in which responses
//! differ most from it (a singular value decomposition). All are orthonormal under the irradiance
//! of an even sky: Σ_i w_i u_r(ω_i) u_s(ω_i) = δ_rs with w_i = z_i / Σ z over the fine cells.

use glam::DVec3;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::transfer::CELLS;
use crate::constants::RELIEF_RANK;
use crate::math::directions::{Directions, FINE, FineCell};

/// Coefficients of an element.
pub const RANK: usize = RELIEF_RANK as usize;

/// Functions of less than this share of the largest singular value, squared, are rounding.
const LEAST: f64 = 1e-12;

/// u_r at the fine cells, bilinear between their centres.
#[derive(Debug, Clone, PartialEq)]
pub struct Basis {
    /// `[fine cell][rank]`
    pub values: Vec<f32>,
}

/// w_i, `[fine cell]`.
pub fn weights() -> Vec<f64> {
    let heights: Vec<f64> = FineCell::all().map(|cell| cell.direction.z).collect();
    let sum: f64 = heights.iter().sum();
    heights.iter().map(|z| z / sum).collect()
}

impl Basis {
    /// For responses to which the direction is the same: all but the constant function are 0.
    pub fn even() -> Self {
        let mut values = vec![0.0; CELLS * RANK];
        values.iter_mut().step_by(RANK).for_each(|u| *u = 1.0);
        Self { values }
    }

    /// The functions that represent these responses best, `[some direction out][fine cell]`, sent
    /// light for an irradiance of 1 from each fine cell.
    pub fn of(mut responses: DMatrix<f64>) -> Self {
        let roots: Vec<f64> = weights().iter().map(|w| w.sqrt()).collect();
        for (mut column, root) in responses.column_iter_mut().zip(&roots) {
            column *= *root;
        }
        let roots = DVector::from_vec(roots);
        let even = &responses * &roots;
        responses -= even * roots.transpose();
        let eigen = SymmetricEigen::new(&responses * responses.transpose());
        let mut order: Vec<usize> = (0..responses.nrows()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let least = LEAST * eigen.eigenvalues.iter().fold(0.0_f64, |m, &v| m.max(v));
        let mut basis = Self::even();
        for (r, &i) in (1..RANK).zip(&order) {
            let power = eigen.eigenvalues[i];
            if power <= least {
                break;
            }
            let function = responses.tr_mul(&eigen.eigenvectors.column(i)) / power.sqrt();
            for (cell, (f, root)) in function.iter().zip(&roots).enumerate() {
                basis.values[cell * RANK + r] = (f / root) as f32;
            }
        }
        basis
    }

    /// u_r of a direction (unit, z up).
    pub fn at(&self, direction: DVec3) -> [f64; RANK] {
        let mut values = [0.0; RANK];
        for (cell, weight) in fine().bilinear(direction) {
            let of_cell = &self.values[cell * RANK..][..RANK];
            for (value, &u) in values.iter_mut().zip(of_cell) {
                *value += weight * f64::from(u);
            }
        }
        values
    }

    /// Σ_i w_i u_r(ω_i) v_s(ω_i) with the functions v of another basis, `[r][s]`.
    pub(super) fn product(&self, other: &Self) -> DMatrix<f32> {
        let mut weighted = self.matrix();
        for (mut row, w) in weighted.column_iter_mut().zip(weights()) {
            row *= w as f32;
        }
        weighted * other.matrix().transpose()
    }

    /// `[rank][fine cell]`
    pub(super) fn matrix(&self) -> DMatrix<f32> {
        DMatrix::from_column_slice(RANK, CELLS, &self.values)
    }
}

/// The fine cells as slots.
const fn fine() -> Directions {
    Directions {
        columns: FINE,
        rows: FINE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Responses that are sums of a few functions are in their span, and the functions are
    /// orthonormal.
    #[test]
    fn spans_what_it_is_made_of() {
        let shape = |k: usize, d: DVec3| match k {
            0 => 1.0,
            1 => d.x,
            2 => d.y * d.z,
            _ => (3.0 * d.x).sin() * d.y,
        };
        let cells: Vec<DVec3> = FineCell::all().map(|cell| cell.direction).collect();
        let responses = DMatrix::from_fn(9, CELLS, |out, i| {
            (0..4)
                .map(|k| f64::from((out * 7 + k * 3) as u32 % 5) * shape(k, cells[i]))
                .sum::<f64>()
        });
        let basis = Basis::of(responses.clone());
        let product = basis.product(&basis);
        let of = basis.matrix().cast::<f64>();
        for r in 0..RANK {
            // The constant and three more.
            for s in 0..RANK {
                let expected = f32::from(u8::from(r == s && r < 4));
                assert!((product[(r, s)] - expected).abs() < 1e-5, "{r} {s}");
            }
        }
        let weighted = DMatrix::from_fn(CELLS, RANK, |i, r| of[(r, i)] * weights()[i]);
        let again = &responses * weighted * of;
        let apart = (&again - &responses).abs().max();
        println!("a response is {apart:.1e} off its sum");
        assert!(apart < 1e-5);
    }
}
