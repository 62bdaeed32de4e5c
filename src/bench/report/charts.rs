//! The charts of a report.

use plotters::style::RGBColor;

use super::model::{Measure, OfDevice, Section};
use crate::bench::bars::{Bar, Bars};
use crate::bench::lines::{Line, Lines};

type Svg = std::result::Result<Option<String>, Box<dyn std::error::Error>>;

/// Colours of the kinds of bars, those that stand side by side far apart.
const COLOURS: [RGBColor; 12] = [
    RGBColor(60, 60, 60),
    RGBColor(158, 202, 225),
    RGBColor(8, 69, 148),
    RGBColor(199, 233, 192),
    RGBColor(35, 139, 69),
    RGBColor(253, 174, 107),
    RGBColor(217, 72, 1),
    RGBColor(188, 189, 220),
    RGBColor(106, 81, 163),
    RGBColor(254, 217, 118),
    RGBColor(160, 120, 60),
    RGBColor(189, 0, 38),
];

/// The chart of a chapter; none where its measurements are of different kinds.
pub fn chart(section: Section, device: &OfDevice) -> Svg {
    let measures: Vec<&Measure> = (device.measures.iter())
        .filter(|m| m.section == section)
        .collect();
    match section {
        Section::Stages => bars("Time of a bake by stage", "seconds", &measures),
        Section::Table1 => bars("Time of a bake", "seconds", &measures),
        Section::Frames => bars("Time of a frame", "milliseconds", &measures),
        Section::Error => error_against_time(device, &measures),
        Section::Rates | Section::Relight => Ok(None),
    }
}

fn bars(caption: &str, unit: &str, measures: &[&Measure]) -> Svg {
    let distinct = |of: fn(&Measure) -> &str| {
        let mut names: Vec<String> = Vec::new();
        for m in measures {
            if !names.iter().any(|name| name == of(m)) {
                names.push(of(m).to_owned());
            }
        }
        names
    };
    let groups = distinct(|m| &m.what);
    let kinds = distinct(|m| &m.quantity);
    let bar = |m: &&Measure| {
        Some(Bar {
            group: groups.iter().position(|name| *name == m.what)?,
            kind: kinds.iter().position(|name| *name == m.quantity)?,
            value: m.median,
            spread: Some((m.low, m.high)),
        })
    };
    let bars = measures.iter().filter_map(bar).collect();
    let colours = COLOURS.iter().cycle().copied();
    let chart = Bars {
        caption,
        unit,
        bars,
        kinds: kinds.into_iter().zip(colours).collect(),
        groups,
    };
    chart.svg().map(Some)
}

/// The rms at random points over the time of the whole bake.
fn error_against_time(device: &OfDevice, errors: &[&Measure]) -> Svg {
    let time_of = |what: &str| {
        let whole = |m: &&Measure| {
            m.section == Section::Stages && m.what == what && m.quantity == "whole bake"
        };
        device.measures.iter().find(whole).map(|m| m.median)
    };
    let line = |quantity: &str, colour| {
        let of = errors
            .iter()
            .filter(|m| m.quantity == quantity && m.median > 0.0);
        let points: Vec<(f64, f64)> = of
            .filter_map(|m| Some((time_of(&m.what)?, m.median)))
            .collect();
        Line {
            label: quantity.to_owned(),
            colour,
            points,
        }
    };
    let chart = Lines {
        caption: "Error against time: preview, draft, normal",
        x: "seconds of the whole bake",
        y: "rms error over the mean, %",
        lines: vec![
            line("rms at random points", RGBColor(8, 69, 148)),
            line("rms at centroids", RGBColor(217, 72, 1)),
        ],
    };
    chart.svg().map(Some)
}
