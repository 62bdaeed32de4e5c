//! The rows of Table 1 as lines, files and charts.

use std::path::Path;

use plotters::style::RGBColor;
use serde::Serialize;

use super::Difference;
use super::bars::{Bar, Bars};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};

/// One bake.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub scene: String,
    /// `lambert`, `16`, `32`, `64`, the same after [`PAPER`], or `high-poly`.
    pub kind: String,
    pub elements: u64,
    pub meso_elements: u64,
    pub sources: u64,
    pub hemicubes: u64,
    pub error_bound: Option<f64>,
    /// Visibility and response of the relief, nothing kept from earlier runs.
    pub relief_seconds: f64,
    /// All of the bake but reading the scene.
    pub seconds: f64,
    pub paper_minutes: Option<f64>,
    /// Frames a second from the scene's first camera, [`super::table1::FRAME`] pixels, for bakes in
    /// K directions.
    pub fps_factored: Option<Rate>,
    pub fps_clusters: Option<Rate>,
    pub paper_fps: Option<f64>,
    /// How far the triangles without relief are from those of the high-poly bake; none before that
    /// is done.
    pub plain: Option<Difference>,
}

/// Frames a second: median, and the 10 % and 90 % points.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Rate {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

/// What a bake of relief gains and loses against the same relief as geometry.
pub(super) fn against_high_poly(row: &Row, high: &Row, difference: &Difference) -> String {
    format!(
        "{:<17} {:<13} {:.2} times as fast as high-poly; its {} plain triangles against it: bias {:+.2} %, rms {:.2} %",
        row.scene,
        bake_name(&row.kind),
        high.seconds / row.seconds,
        difference.triangles,
        100.0 * difference.bias,
        100.0 * difference.rms
    )
}

/// Before K of bakes to the letter of the paper.
pub(super) const PAPER: &str = "paper-";

pub(super) const HEADER: &str = "scene             bake          elements  meso  hemicubes  seconds  of it relief  over K=16  over lambert  paper, min  fps factored  clusters  paper";

/// K = 64 over K = 16 of one scene's rows, by default and to the letter, beside the paper's.
pub(super) fn ratios(scene: &[Row]) -> Vec<String> {
    let of = |before: &str, k: &str| scene.iter().find(|r| r.kind == format!("{before}{k}"));
    let ratio = |before: &str| {
        let (few, many) = (of(before, "16")?, of(before, "64")?);
        let frames = |of: fn(&Row) -> Option<f64>| {
            of(few)
                .zip(of(many))
                .map_or("-".into(), |(a, b)| format!("{:.2}", a / b))
        };
        Some(format!(
            "{:<17} {:<13} K = 64 over 16: bakes {:.3}, the paper's {}; frames by clusters {}, \
             the paper's {}",
            few.scene,
            if before == PAPER {
                "to the letter"
            } else {
                "ours"
            },
            many.seconds / few.seconds,
            many.paper_minutes
                .zip(few.paper_minutes)
                .map_or("-".into(), |(a, b)| format!("{:.3}", a / b)),
            frames(|r| r.fps_clusters.map(|f| f.median)),
            frames(|r| r.paper_fps),
        ))
    };
    ["", PAPER].into_iter().filter_map(ratio).collect()
}

/// A row as it is printed, with its time over those of the same scene's K = 16, of the same method,
/// and `lambert`.
pub(super) fn line(row: &Row, scene: &[Row]) -> String {
    let sixteen = match row.kind.starts_with(PAPER) {
        true => format!("{PAPER}16"),
        false => "16".to_owned(),
    };
    let over = |kind: &str| {
        scene
            .iter()
            .find(|r| r.kind == kind)
            .map_or("-".into(), |r| format!("{:.3}", row.seconds / r.seconds))
    };
    let fps = |rate: Option<Rate>| rate.map_or("-".into(), |r| format!("{:.2}", r.median));
    format!(
        "{:<17} {:<13} {:>8} {:>4.0}% {:>10} {:>8.1} {:>13.2} {:>10} {:>13} {:>11} {:>13} {:>9} {:>6}",
        row.scene,
        bake_name(&row.kind),
        row.elements,
        100.0 * row.meso_elements as f64 / row.elements as f64,
        row.hemicubes,
        row.seconds,
        row.relief_seconds,
        over(&sixteen),
        over("lambert"),
        row.paper_minutes.map_or("-".into(), |m| format!("{m:.1}")),
        fps(row.fps_factored),
        fps(row.fps_clusters),
        row.paper_fps.map_or("-".into(), |f| format!("{f:.0}")),
    )
}

pub(super) fn write(rows: &[Row], folder: &Path) -> Result<()> {
    let bad = |path: &Path, e: String| Error::file(path, e);
    let json = folder.join("table1.json");
    let text = serde_json::to_string_pretty(rows).map_err(|e| bad(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("table1.csv"), |out| {
        writeln!(
            out,
            "scene,bake,elements,meso_elements,sources,hemicubes,error_bound,relief_seconds,seconds,paper_minutes,plain_bias,plain_rms,fps_factored,fps_factored_low,fps_factored_high,fps_clusters,fps_clusters_low,fps_clusters_high,paper_fps"
        )?;
        for r in rows {
            let optional = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
            let rate = |rate: Option<Rate>| match rate {
                Some(r) => format!("{},{},{}", r.median, r.low, r.high),
                None => ",,".into(),
            };
            writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                r.scene,
                r.kind,
                r.elements,
                r.meso_elements,
                r.sources,
                r.hemicubes,
                optional(r.error_bound),
                r.relief_seconds,
                r.seconds,
                optional(r.paper_minutes),
                optional(r.plain.map(|d| d.bias)),
                optional(r.plain.map(|d| d.rms)),
                rate(r.fps_factored),
                rate(r.fps_clusters),
                optional(r.paper_fps)
            )?;
        }
        Ok(())
    })?;
    fps_chart(rows).write(&folder.join("table1-fps.svg"))?;
    chart(rows).write(&folder.join("table1.svg"))
}

/// Kinds of bakes with their colours.
const KINDS: [(&str, RGBColor); 8] = [
    ("lambert", RGBColor(120, 120, 120)),
    ("16", RGBColor(158, 202, 225)),
    ("32", RGBColor(66, 146, 198)),
    ("64", RGBColor(8, 69, 148)),
    ("paper-16", RGBColor(199, 233, 192)),
    ("paper-32", RGBColor(116, 196, 118)),
    ("paper-64", RGBColor(0, 109, 44)),
    ("high-poly", RGBColor(217, 95, 14)),
];

/// Names of the scenes, each once.
fn scenes_of(rows: &[Row]) -> Vec<String> {
    let mut scenes: Vec<String> = Vec::new();
    for row in rows {
        if !scenes.contains(&row.scene) {
            scenes.push(row.scene.clone());
        }
    }
    scenes
}

/// Frames a second beside the paper's, one group a scene.
fn fps_chart(rows: &[Row]) -> Bars<'static> {
    const SHADINGS: [(&str, [RGBColor; 3]); 3] = [
        (
            "factored",
            [
                RGBColor(158, 202, 225),
                RGBColor(66, 146, 198),
                RGBColor(8, 69, 148),
            ],
        ),
        (
            "clusters",
            [
                RGBColor(199, 233, 192),
                RGBColor(116, 196, 118),
                RGBColor(0, 109, 44),
            ],
        ),
        (
            "paper",
            [
                RGBColor(210, 210, 210),
                RGBColor(160, 160, 160),
                RGBColor(99, 99, 99),
            ],
        ),
    ];
    let groups = scenes_of(rows);
    let directions = &KINDS[1..4];
    let mut bars = Vec::new();
    for row in rows {
        let group = groups.iter().position(|g| *g == row.scene);
        let k = directions.iter().position(|k| k.0 == row.kind);
        let Some((group, k)) = group.zip(k) else {
            continue;
        };
        let paper = row.paper_fps.map(|f| Rate {
            median: f,
            low: f,
            high: f,
        });
        let rates = [row.fps_factored, row.fps_clusters, paper];
        for (shading, rate) in rates.into_iter().enumerate() {
            bars.extend(rate.map(|rate| Bar {
                group,
                kind: 3 * shading + k,
                value: rate.median,
                spread: Some((rate.low, rate.high)),
            }));
        }
    }
    Bars {
        caption: "Frames a second, 1280x720 (paper: size not given)",
        unit: "frames a second",
        bars,
        kinds: SHADINGS
            .iter()
            .flat_map(|(name, colours)| {
                let named = move |(k, colour): (&(&str, RGBColor), &RGBColor)| {
                    (format!("{name}, K = {}", k.0), *colour)
                };
                KINDS[1..4].iter().zip(colours).map(named)
            })
            .collect(),
        groups,
    }
}

/// Seconds, one group a scene.
fn chart(rows: &[Row]) -> Bars<'static> {
    let groups = scenes_of(rows);
    let kinds: Vec<_> = (KINDS.iter())
        .filter(|kind| rows.iter().any(|row| row.kind == kind.0))
        .collect();
    let bars = rows.iter().filter_map(|row| {
        Some(Bar {
            group: groups.iter().position(|g| *g == row.scene)?,
            kind: kinds.iter().position(|k| k.0 == row.kind)?,
            value: row.seconds,
            spread: None,
        })
    });
    Bars {
        caption: "Time of a bake",
        unit: "seconds",
        bars: bars.collect(),
        kinds: kinds
            .iter()
            .map(|(kind, colour)| (bake_name(kind), *colour))
            .collect(),
        groups,
    }
}

/// A kind of bake as it is shown.
fn bake_name(kind: &str) -> String {
    let named = |k: &str, before: &str| k.parse::<u32>().ok().map(|k| format!("{before}K = {k}"));
    let letter = kind.strip_prefix(PAPER).and_then(|k| named(k, "paper, "));
    letter
        .or_else(|| named(kind, ""))
        .unwrap_or_else(|| kind.to_owned())
}
