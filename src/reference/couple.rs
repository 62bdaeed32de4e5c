//! Twin of the coupling pass: what a row brings to the members of each target.

use glam::Vec3;

use crate::structs::CouplingTarget;

/// The words of one row: Σ w_j F_js / A_t of a target of one reflectance, Σ ρ_j w_j F_js / A_t by
/// colour of any other. `row`: form factor from each element to the source; `reflectance`: of even
/// light; `weights`: area of each element as it counts in its source's mean.
pub fn couple(
    weights: &[f64],
    reflectance: &[Vec3],
    targets: &[CouplingTarget],
    row: &[f32],
) -> Vec<f64> {
    let mut words = Vec::new();
    for target in targets {
        let first = target.first_element as usize;
        let members = first..first + target.element_count as usize;
        let area: f64 = members.clone().map(|e| weights[e]).sum();
        let brought = |e: usize| weights[e] * f64::from(row[e]) / area;
        assert_eq!(words.len(), target.first_word as usize);
        match target.word_count {
            1 => words.push(members.map(brought).sum()),
            _ => words.extend((0..3).map(|c| {
                let reflected = |e: usize| brought(e) * f64::from(reflectance[e][c]);
                members.clone().map(reflected).sum::<f64>()
            })),
        }
    }
    words
}
