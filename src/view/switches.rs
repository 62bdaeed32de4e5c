//! Switches that the panel, keys and scripts change.

use crate::error::{Error, Result};
use crate::render::{Direct, Light, ReliefShading, Show};

/// What is shown, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Switches {
    pub part: Light,
    pub shading: ReliefShading,
    pub direct: Direct,
    pub show: Show,
    /// Adds the estimate of the light that has not been shot.
    pub ambient: bool,
    /// Draws detailed pictures while the view stays.
    pub detail: bool,
    /// Stops relative to the automatic exposure.
    pub exposure: f32,
    /// Outlines of the elements, colours of the sources.
    pub elements: bool,
    pub sources: bool,
    /// Light by direction of the element under the cursor.
    pub slots: bool,
    /// The item buffer of the source under the cursor.
    pub items: bool,
    /// The error bound over the time of the bake.
    pub bound: bool,
    pub panel: bool,
    /// Notes over the view, and the list of keys.
    pub notes: bool,
    pub keys: bool,
}

impl Default for Switches {
    fn default() -> Self {
        Self {
            part: Light::Global,
            shading: ReliefShading::Factored,
            direct: Direct::Sharp,
            show: Show::Shaded,
            ambient: true,
            detail: true,
            exposure: 0.0,
            elements: false,
            sources: false,
            slots: false,
            items: false,
            bound: false,
            panel: true,
            notes: true,
            keys: false,
        }
    }
}

/// Names in the panel and in scripts.
pub const PARTS: [(&str, Light); 3] = [
    ("global", Light::Global),
    ("direct", Light::Direct),
    ("indirect", Light::Indirect),
];
pub const SHADINGS: [(&str, ReliefShading); 5] = [
    ("factored", ReliefShading::Factored),
    ("clusters", ReliefShading::Clusters),
    ("normal", ReliefShading::Normal),
    ("parallax", ReliefShading::Parallax),
    ("none", ReliefShading::None),
];
pub const DIRECTS: [(&str, Direct); 2] = [("sharp", Direct::Sharp), ("slots", Direct::Slots)];
/// Directions that a bake may have.
pub const DIRECTIONS: [u32; 3] = [16, 32, 64];
/// Stops of the exposure that the panel offers.
pub const EXPOSURES: std::ops::RangeInclusive<f32> = -6.0..=6.0;

/// The value after `now` in a list, cyclic.
pub fn next<T: Copy + PartialEq>(list: &[(&str, T)], now: T) -> T {
    let place = list.iter().position(|(_, value)| *value == now);
    list[(place.unwrap_or(0) + 1) % list.len()].1
}

fn named<T: Copy>(list: &[(&str, T)], name: &str) -> Result<T> {
    let found = list.iter().find(|(known, _)| *known == name);
    found.map(|(_, value)| *value).ok_or_else(|| {
        let names: Vec<_> = list.iter().map(|(name, _)| *name).collect();
        Error::Usage(format!("\"{name}\" is none of {}", names.join(", ")))
    })
}

const ON_OFF: [(&str, bool); 2] = [("on", true), ("off", false)];

impl Switches {
    /// Sets a switch as a script names it.
    ///
    /// # Errors
    /// An unknown name or value.
    pub fn set(&mut self, name: &str, value: &str) -> Result<()> {
        let flag = match name {
            "light" => {
                self.part = named(&PARTS, value)?;
                return Ok(());
            }
            "shading" => {
                self.shading = named(&SHADINGS, value)?;
                return Ok(());
            }
            "direct" => {
                self.direct = named(&DIRECTS, value)?;
                return Ok(());
            }
            "exposure" => {
                let stops = value.parse().ok().filter(|stops| EXPOSURES.contains(stops));
                self.exposure = stops.ok_or_else(|| {
                    Error::Usage(format!(
                        "exposure \"{value}\" must be in {} to {}",
                        EXPOSURES.start(),
                        EXPOSURES.end()
                    ))
                })?;
                return Ok(());
            }
            "ambient" => &mut self.ambient,
            "detail" => &mut self.detail,
            "elements" => &mut self.elements,
            "sources" => &mut self.sources,
            "slots" => &mut self.slots,
            "items" => &mut self.items,
            "bound" => &mut self.bound,
            "panel" => &mut self.panel,
            "notes" => &mut self.notes,
            "keys" => &mut self.keys,
            _ => return Err(Error::Usage(format!("there is no switch \"{name}\""))),
        };
        *flag = named(&ON_OFF, value)?;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn switches_are_set_by_name() {
        let mut switches = Switches::default();
        for (name, value) in [("light", "indirect"), ("shading", "none"), ("panel", "off")] {
            switches.set(name, value).expect("a switch");
        }
        assert_eq!(switches.part, Light::Indirect);
        assert_eq!(switches.shading, ReliefShading::None);
        assert!(!switches.panel);
        for (name, value) in [("light", "blue"), ("lamp", "on"), ("exposure", "99")] {
            assert!(switches.set(name, value).is_err(), "{name} {value}");
        }
    }

    #[test]
    fn the_list_goes_round() {
        assert_eq!(next(&PARTS, Light::Indirect), Light::Global);
    }
}
