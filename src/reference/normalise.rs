//! Twin of the pass that keeps the energy of an enclosed scene.

/// Larger deviations of a sum are not sampling errors.
const MOST_OFF: f64 = 0.05;

/// Factor of all elements' form factors to one source. `elements` gives the area and the form
/// factor of each.
pub fn scale(elements: impl Iterator<Item = (f64, f64)>, source_area: f64) -> f64 {
    let share = elements.map(|(area, factor)| area * factor).sum::<f64>() / source_area;
    if (share - 1.0).abs() <= MOST_OFF {
        1.0 / share
    } else {
        1.0
    }
}
