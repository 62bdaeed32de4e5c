//! What a facet receives from each direction, in coordinates by which facets are compared.

use glam::{DMat3, DVec3, Vec3};

use crate::math::directions::Directions;

/// Of each slot the vector whose dot product with the direction fits values at the slot's fine
/// cells best, among the vectors that preserve their sum; turned so that its length is the root of
/// the sum of these products' squares.
pub(super) struct Coordinates {
    /// `[slot][member]`: fine cell and what a value there adds.
    columns: Vec<Vec<(usize, DVec3)>>,
    /// From coordinates to vectors, `[slot]`.
    inverse: Vec<DMat3>,
}

impl Coordinates {
    pub(super) fn new(directions: &Directions) -> Self {
        let mut members: Vec<Vec<(usize, DVec3)>> = vec![Vec::new(); directions.count()];
        for (i, (cell, slot)) in directions.fine().enumerate() {
            members[slot].push((i, cell.direction));
        }
        let turns: Vec<DMat3> = members.iter().map(|m| turn(&moment(m))).collect();
        let columns = members.iter().zip(&turns).map(|(members, turn)| {
            let inverse = moment(members).inverse();
            let sum: DVec3 = members.iter().map(|m| m.1).sum();
            let along = inverse * sum;
            let column = |&(i, w): &(usize, DVec3)| {
                let free = inverse * w;
                let fitted = free + along * ((1.0 - sum.dot(free)) / sum.dot(along));
                (i, *turn * fitted)
            };
            members.iter().map(column).collect()
        });
        Self {
            columns: columns.collect(),
            inverse: turns.iter().map(DMat3::inverse).collect(),
        }
    }

    /// Three of each slot.
    pub(super) fn count(&self) -> usize {
        3 * self.columns.len()
    }

    /// Those of values `[fine cell]`, `[slot][axis]`.
    pub(super) fn find(&self, values: &[f32], coordinates: &mut [f64]) {
        let slots = coordinates.as_chunks_mut().0;
        for (found, members) in slots.iter_mut().zip(&self.columns) {
            let mut sum = DVec3::ZERO;
            for &(i, column) in members {
                sum += column * f64::from(values[i]);
            }
            *found = sum.to_array();
        }
    }

    /// The vectors with these coordinates, `[slot]`.
    pub(super) fn vectors(&self, coordinates: &[f64]) -> impl Iterator<Item = Vec3> {
        let slots = self.inverse.iter().zip(coordinates.as_chunks().0);
        slots.map(|(inverse, &c)| (*inverse * DVec3::from_array(c)).as_vec3())
    }
}

/// Σ ω ωᵀ over the directions of a slot.
fn moment(members: &[(usize, DVec3)]) -> DMat3 {
    let outer = |w: DVec3| DMat3::from_cols(w * w.x, w * w.y, w * w.z);
    members.iter().map(|m| outer(m.1)).sum()
}

/// Lᵀ with L Lᵀ the moment: Cholesky, column by column.
fn turn(moment: &DMat3) -> DMat3 {
    let m = moment;
    let a = m.x_axis.x.sqrt();
    let (b, c) = (m.x_axis.y / a, m.x_axis.z / a);
    let d = (m.y_axis.y - b * b).sqrt();
    let e = (m.y_axis.z - b * c) / d;
    let f = (m.z_axis.z - c * c - e * e).sqrt();
    let lower = DMat3::from_cols(
        DVec3::new(a, b, c),
        DVec3::new(0.0, d, e),
        DVec3::new(0.0, 0.0, f),
    );
    lower.transpose()
}
