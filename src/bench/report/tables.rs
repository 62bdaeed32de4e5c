//! The measurements of a device as rows of text, for the page and for Markdown.

use super::model::{Measure, OfDevice, Report, Section};

/// A chapter.
pub struct Table {
    pub title: &'static str,
    pub section: Section,
    /// What is measured and how, a sentence or two.
    pub about: &'static str,
    pub header: Vec<&'static str>,
    pub rows: Vec<Vec<String>>,
    /// Sentences that follow from the rows.
    pub remarks: Vec<String>,
}

const CHAPTERS: [(Section, &str, &str); 6] = [
    (
        Section::Stages,
        "Bakes of the Cornell box by stage",
        "Seconds of whole bakes without reading the scene, and of their stages. Stages from \
         culling to keeping are timed by the device's own clock; they overlap with work of the CPU.",
    ),
    (
        Section::Rates,
        "Rates",
        "Work over the time of its own stage in the same bakes.",
    ),
    (
        Section::Error,
        "Error against time",
        "Irradiance against path traced irradiance, over its mean; beside it the 95 % interval \
         over the places. Noise of the paths is taken out; 0 is an error that it hides.",
    ),
    (
        Section::Relight,
        "Relighting",
        "Solving again by kept form factors, the light being as before.",
    ),
    (
        Section::Table1,
        "Table 1: bakes",
        "Whole bakes of the paper's three scenes (stand-ins for its models) at --quality draft: \
         flat, and with relief in 16 and in 64 directions. Visibility of the relief is computed \
         each time.",
    ),
    (
        Section::Frames,
        "Table 1: frames",
        "Milliseconds a frame of 1280x720 pixels, one sample each, by the device's own clock.",
    ),
];

/// The chapters that have measurements; `against` adds columns of another report.
pub fn tables(device: &OfDevice, against: Option<&Report>) -> Vec<Table> {
    let of_chapter = |&(section, title, about): &(Section, &'static str, &'static str)| {
        let measures: Vec<&Measure> = (device.measures.iter())
            .filter(|m| m.section == section)
            .collect();
        let mut header = vec!["what", "quantity", "median", "spread", "unit", "runs"];
        if against.is_some() {
            header.extend(["other report", "this over it"]);
        }
        let row = |m: &&Measure| {
            let mut row = vec![
                m.what.clone(),
                m.quantity.clone(),
                digits(m.median),
                match m.low == m.high {
                    true => "-".into(),
                    false => format!("{} to {}", digits(m.low), digits(m.high)),
                },
                m.unit.clone(),
                m.samples.len().to_string(),
            ];
            if let Some(other) = against {
                let same = other.same(&device.name, m);
                row.push(same.map_or("-".into(), |o| digits(o.median)));
                let ratio = same
                    .filter(|o| o.median != 0.0)
                    .map(|o| m.median / o.median);
                row.push(ratio.map_or("-".into(), |r| format!("{r:.2}")));
            }
            row
        };
        Table {
            title,
            section,
            about,
            header,
            rows: measures.iter().map(row).collect(),
            remarks: match section {
                Section::Table1 => ratios(&measures),
                _ => Vec::new(),
            },
        }
    };
    let all = CHAPTERS.iter().map(of_chapter);
    all.filter(|table| !table.rows.is_empty()).collect()
}

/// What directions cost, for each scene.
fn ratios(measures: &[&Measure]) -> Vec<String> {
    let of = |what: &str, quantity: &str| {
        let found = measures
            .iter()
            .find(|m| m.what == what && m.quantity == quantity);
        found.map(|m| m.median)
    };
    let flat = measures.iter().filter(|m| m.quantity == "lambert");
    let ratio = |m: &&Measure| {
        let (few, many) = (of(&m.what, "K = 16")?, of(&m.what, "K = 64")?);
        Some(format!(
            "{}: K = 64 takes {:.2} times as long as K = 16, and {:.2} times as long as without \
             directions.",
            m.what,
            many / few,
            many / m.median
        ))
    };
    flat.filter_map(ratio).collect()
}

/// Three digits, of large numbers all before the point.
pub fn digits(value: f64) -> String {
    let places = match value.abs() {
        v if v >= 100.0 => 0,
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.places$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_digits() {
        let texts = [0.0123, 1.234, 12.34, 1234.5, -0.5].map(digits);
        assert_eq!(texts, ["0.012", "1.23", "12.3", "1234", "-0.500"]);
    }
}
