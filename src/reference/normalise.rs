//! Twin of the pass that keeps the energy of an enclosed scene.

/// A sum further off than this is no error of sampling.
const MOST_OFF: f64 = 0.05;

/// What the form factors of all elements to one source are multiplied by. `elements`: area of each and its form factor.
pub fn scale(elements: impl Iterator<Item = (f64, f64)>, source_area: f64) -> f64 {
    let share = elements.map(|(area, factor)| area * factor).sum::<f64>() / source_area;
    if (share - 1.0).abs() <= MOST_OFF {
        1.0 / share
    } else {
        1.0
    }
}
