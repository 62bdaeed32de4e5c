//! Benchmarks: release builds, median and spread, alternatives side by side.

mod bars;
mod difference;
pub mod figure3;
pub mod frame;
pub mod hemicube;
pub mod irradiance;
mod lines;
pub mod measure;
mod memory;
pub mod pareto;
pub mod pictures;
mod pixels;
pub mod places;
mod power_law;
pub mod relief_room;
pub mod report;
pub mod scaling;
pub mod stress;
pub mod table1;
mod table1_output;
pub mod truth;

pub use difference::{Difference, plain_pairs};
pub use power_law::PowerLaw;

/// Median, and the 10 % and 90 % points.
pub fn spread(values: &mut [f64]) -> (f64, f64, f64) {
    values.sort_by(f64::total_cmp);
    let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
    (at(0.5), at(0.1), at(0.9))
}
