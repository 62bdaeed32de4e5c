//! Twin of the selecting pass: the sources with the most unshot power, ties to the lower index.

/// Indices of the `count` largest powers above zero, largest first.
pub fn select(powers: &[f32], count: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..powers.len() as u32)
        .filter(|&i| powers[i as usize] > 0.0)
        .collect();
    order.sort_by(|&a, &b| {
        powers[b as usize]
            .total_cmp(&powers[a as usize])
            .then(a.cmp(&b))
    });
    order.truncate(count);
    order
}
