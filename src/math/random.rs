//! Random numbers that are the same in every run (Steele et al. 2014).

/// From one state of the sequence to the next.
pub const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

/// The next number of a sequence, and its state.
pub fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_add(STEP);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A whole number below `count`.
pub fn below(state: &mut u64, count: usize) -> usize {
    ((u128::from(next(state)) * count as u128) >> 64) as usize
}

/// A number in 0..1.
pub fn unit(state: &mut u64) -> f64 {
    (next(state) >> 11) as f64 / (1_u64 << 53) as f64
}
