//! Presets of a bake's settings, from coarse and quick to fine and slow; `mesolux bench pareto`
//! measures error against time.

use crate::error::Result;
use crate::math::directions::Directions;
use crate::mesh::near::Nearness;
use crate::mesh::sources::Grouping;
use crate::meso::{self, Transport};
use crate::solver::{Estimator, Settings};

/// Quality of a bake.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// Light to look at while a scene is made.
    Preview,
    /// About 1 % in the Cornell box.
    Draft,
    #[default]
    Normal,
    /// Below 0.3 % in the Cornell box.
    High,
    Reference,
}

impl Quality {
    pub const ALL: [Self; 5] = [
        Self::Preview,
        Self::Draft,
        Self::Normal,
        Self::High,
        Self::Reference,
    ];

    /// The settings, all others at their defaults.
    pub fn settings(self) -> Settings {
        let (hemicube, scale, residual) = match self {
            Self::Preview => (64, 10.0, 0.35),
            Self::Draft => (64, 4.0, 2e-2),
            Self::Normal => (128, 1.0, 1e-3),
            Self::High => (128, 1.0 / 4.0, 1e-3),
            Self::Reference => (512, 1.0 / 32.0, 1e-5),
        };
        Settings {
            residual,
            ..sized(hemicube, scale)
        }
    }

    /// How much finer than by default a scene is cut, see [`Refinement::fineness`]; built-in scenes
    /// are cut from above 1 on.
    ///
    /// [`Refinement::fineness`]: crate::scene::Refinement::fineness
    pub fn fineness(self) -> f64 {
        match self {
            Self::Preview | Self::Draft | Self::Normal => 1.0,
            Self::High | Self::Reference => 2.0,
        }
    }
}

/// The paper's method to the letter, in `k` directions: every element shoots from its own hemicube,
/// lamps as others, form factors are sums of pixels, and no light is scaled.
///
/// # Errors
/// As [`Directions::new`].
pub fn paper(k: u32) -> Result<Settings> {
    Ok(Settings {
        estimator: Estimator::Paper,
        residual: 5e-2,
        grouping: Grouping::ELEMENTS,
        nearness: Nearness::NONE,
        silhouettes: false,
        normalise: false,
        carries: false,
        merging: false,
        relief: meso::Options {
            transport: Transport::Paper,
            directions: Directions::new(k)?,
            cache: None,
        },
        ..Settings::default()
    })
}

/// The settings of hemicubes of so many pixels a side and sources `scale` times the default size:
/// where sources are large, shadows are looked at from fewer places, and fewer sources are near;
/// where they are small, more are.
pub fn sized(hemicube: u32, scale: f64) -> Settings {
    let plain = Settings::default();
    let (emitter_places, places) = match scale {
        8.0.. => (16, 0),
        4.0.. => (32, 2),
        _ => (plain.emitter_places, plain.places),
    };
    let near = |source, part| Nearness { source, part };
    let nearness = match scale {
        8.0.. => near(1.0 / 2.0, 1.0 / 4.0),
        4.0.. => near(1.0 / 10.0, 1.0 / 16.0),
        ..=0.25 => near(1.0 / 40.0, 1.0 / 96.0),
        _ => plain.nearness,
    };
    Settings {
        hemicube,
        emitter_places,
        places,
        nearness,
        grouping: scaled(scale),
        ..plain
    }
}

/// The default grouping with sources `scale` times as large in elements, area and power.
pub fn scaled(scale: f64) -> Grouping {
    let plain = Grouping::default();
    let sky_bands = match scale {
        8.0.. => 14,
        4.0.. => 18,
        _ => plain.sky_bands,
    };
    Grouping {
        sky_bands,
        max_elements: ((plain.max_elements as f64 * scale).round() as usize).max(1),
        max_area: plain.max_area * scale,
        max_power: plain.max_power * scale,
        ..plain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The default settings are `normal`; a better preset is never coarser.
    #[test]
    fn presets_are_in_order_about_the_default() {
        let plain = Settings::default();
        let normal = Quality::default().settings();
        assert_eq!(
            (normal.hemicube, normal.residual, normal.grouping),
            (plain.hemicube, plain.residual, plain.grouping)
        );
        for pair in Quality::ALL.map(Quality::settings).windows(2) {
            let ([worse, better], [a, b]) =
                ([&pair[0], &pair[1]], [&pair[0].grouping, &pair[1].grouping]);
            better.check().expect("settings that can be solved");
            assert!(better.hemicube >= worse.hemicube && better.residual <= worse.residual);
            assert!(b.max_elements <= a.max_elements && b.max_area <= a.max_area);
            assert!(b.max_power <= a.max_power && b.sky_bands >= a.sky_bands);
            assert!(better.emitter_places >= worse.emitter_places);
            assert!(better.places >= worse.places);
            assert!(better.nearness.source <= worse.nearness.source);
            assert!(better.nearness.part <= worse.nearness.part);
        }
    }
}
