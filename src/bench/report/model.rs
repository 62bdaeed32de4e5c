//! What a report holds, and its JSON file.

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

/// Of the JSON's layout; changed with it.
pub const SCHEMA: &str = "mesolux-report-1";

/// All that was measured, and where.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Report {
    pub schema: String,
    pub provenance: Provenance,
    pub devices: Vec<OfDevice>,
}

/// What made a report.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Provenance {
    /// The program with its version.
    pub program: String,
    /// Of its sources, when it was built; `unknown` outside a checkout.
    pub commit: String,
    /// UTC, ISO 8601.
    pub date: String,
    /// Operating system and architecture.
    pub system: String,
    /// Of the CPU that the process may use.
    pub threads: usize,
    pub form: Form,
    /// How much is measured.
    pub plan: Plan,
    /// How long the measurements took.
    pub seconds: f64,
    /// Whether all was measured; false after Ctrl-C.
    pub whole: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// Some minutes on a software device.
    Short,
    /// The sizes of the paper.
    Full,
}

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Of `cornell`.
    pub elements: usize,
    /// Bakes of it with each preset.
    pub runs: usize,
    /// Elements of the scenes of Table 1; their own numbers if none.
    pub patches: Option<usize>,
    /// Bakes of each of their kinds.
    pub table_runs: usize,
    /// Frames of each kind.
    pub frames: usize,
    /// Places at which the path tracer measures errors, and its paths at each.
    pub places: usize,
    pub paths: u32,
}

impl Form {
    pub fn plan(self) -> Plan {
        match self {
            Self::Short => Plan {
                elements: 20_000,
                runs: 3,
                patches: Some(20_000),
                table_runs: 1,
                frames: 3,
                places: 2000,
                paths: 1000,
            },
            Self::Full => Plan {
                elements: 83_160,
                runs: 5,
                patches: None,
                table_runs: 3,
                frames: 9,
                places: 5000,
                paths: 4000,
            },
        }
    }
}

/// One device's measurements.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct OfDevice {
    pub name: String,
    pub driver: String,
    pub vulkan: String,
    pub measures: Vec<Measure>,
    /// Why the device was given up.
    pub failed: Option<String>,
}

/// The chapters of a report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Section {
    Stages,
    Rates,
    Error,
    Relight,
    Table1,
    Frames,
}

/// One quantity of one thing.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Measure {
    pub section: Section,
    /// What was measured: a scene and how it was baked or drawn.
    pub what: String,
    pub quantity: String,
    pub unit: String,
    /// In the order they were taken.
    pub samples: Vec<f64>,
    pub median: f64,
    /// The least and the largest; of errors, the ends of their 95 % interval.
    pub low: f64,
    pub high: f64,
}

impl Measure {
    /// With the spread of its samples, one at least.
    pub fn new(
        section: Section,
        what: &str,
        quantity: &str,
        unit: &str,
        samples: Vec<f64>,
    ) -> Self {
        let mut sorted = samples.clone();
        sorted.sort_by(f64::total_cmp);
        let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
        Self {
            section,
            what: what.to_owned(),
            quantity: quantity.to_owned(),
            unit: unit.to_owned(),
            median: at(sorted.len() / 2),
            low: at(0),
            high: at(sorted.len().saturating_sub(1)),
            samples,
        }
    }

    /// Whether it is of the same thing.
    pub fn is_as(&self, other: &Self) -> bool {
        (self.section == other.section && self.what == other.what)
            && (self.quantity == other.quantity && self.unit == other.unit)
    }
}

impl Report {
    /// # Errors
    /// A file that cannot be read, is no report, or of another schema.
    pub fn load(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|e| Error::read(path, e))?;
        let report: Self = serde_json::from_slice(&bytes)
            .map_err(|e| Error::file(path, format!("no report of `bench report`: {e}")))?;
        match report.schema == SCHEMA {
            true => Ok(report),
            false => Err(Error::file(
                path,
                format!(
                    "a report of schema {}; this program reads {SCHEMA}",
                    report.schema.escape_debug()
                ),
            )),
        }
    }

    pub fn save(&self, path: &Path) -> Result<()> {
        let text =
            serde_json::to_string_pretty(self).map_err(|e| Error::file(path, e.to_string()))?;
        write_atomically(path, |out| out.write_all(text.as_bytes()))
    }

    /// The measurement of the same thing: of the device of that name, else of the first.
    pub fn same(&self, device: &str, measure: &Measure) -> Option<&Measure> {
        let named = self.devices.iter().find(|d| d.name == device);
        let device = named.or(self.devices.first())?;
        device.measures.iter().find(|m| m.is_as(measure))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spread_is_of_the_samples() {
        let m = Measure::new(Section::Rates, "a", "b", "s", vec![3.0, 1.0, 2.0]);
        assert_eq!((m.median, m.low, m.high), (2.0, 1.0, 3.0));
        assert_eq!(m.samples, [3.0, 1.0, 2.0]);
        assert!(m.is_as(&Measure::new(Section::Rates, "a", "b", "s", vec![7.0])));
        assert!(!m.is_as(&Measure::new(Section::Rates, "a", "c", "s", vec![7.0])));
    }
}
