//! `mesolux bench scaling`: how time and memory grow with the number of elements, at one error
//! bound.
//!
//! A scene is cut into more and more elements. Each size is baked once for each limit on the
//! elements of a source: the program's own, under which the number of sources grows with that of
//! elements, and none, under which sources are cut by area and power alone, which do not know how
//! finely the scene is cut.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use plotters::style::RGBColor;
use serde::Serialize;

use super::lines::{Line, Lines};
use super::places::Sample;
use super::power_law::PowerLaw;
use super::truth::Wanted;
use super::{irradiance, memory};
use crate::atomic_file::write_atomically;
use crate::error::{Error, Result};
use crate::mesh::elements::Elements;
use crate::mesh::sources::Grouping;
use crate::meso::Transport;
use crate::scene::{LoadOptions, load};
use crate::solver::{Settings, Solver, StopReason};
use crate::vk::Device;

/// What is to be measured.
pub struct Options {
    /// A built-in scene.
    pub scene: String,
    /// Elements of the first size; each next one has twice as many.
    pub first: usize,
    /// Elements of the last size, whether or not it is a double.
    pub largest: usize,
    /// Limits on the elements of a source; none for no limit.
    pub limits: Vec<Option<usize>>,
    pub residual: f64,
    pub hemicube: u32,
    /// Places at which the path tracer tells the error; 0 for none.
    pub samples: usize,
    /// Paths of each place.
    pub paths: u32,
}

/// One bake.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub scene: String,
    /// Most elements of a source.
    pub max_elements: Option<usize>,
    pub elements: u64,
    pub sources: u64,
    /// Seconds: elements of the scene; sources, and all that is brought to the device; shots.
    pub elements_seconds: f64,
    pub setup_seconds: f64,
    pub solve_seconds: f64,
    /// Of the shots, by the device's own clock: choosing, culling, drawing, form factors,
    /// gathering.
    pub keep_seconds: f64,
    pub cull_seconds: f64,
    pub draw_seconds: f64,
    pub form_factor_seconds: f64,
    pub gather_seconds: f64,
    pub hemicubes: u64,
    pub shots: u32,
    /// Sources whose form factors are kept.
    pub kept_sources: u64,
    pub error_bound: Option<f64>,
    /// Bytes in buffers on the device, and bytes of the process at its peak; on a software device
    /// the first are part of the second.
    pub device_bytes: u64,
    pub resident_bytes: Option<u64>,
    /// Against path traced irradiance: bias and root mean square, over its mean; half of the bias's
    /// 95 % interval.
    pub bias: Option<f64>,
    pub bias_interval: Option<f64>,
    pub rms: Option<f64>,
}

impl Row {
    /// All of the bake but reading the scene.
    pub fn seconds(&self) -> f64 {
        self.elements_seconds + self.setup_seconds + self.solve_seconds
    }
}

/// A quantity whose growth is fitted.
type Quantity = (&'static str, fn(&Row) -> f64);

const QUANTITIES: [Quantity; 11] = [
    ("seconds", Row::seconds),
    ("of it elements", |r| r.elements_seconds),
    ("of it setup", |r| r.setup_seconds),
    ("of it shots", |r| r.solve_seconds),
    ("device: coupling and keeping", |r| r.keep_seconds),
    ("device: culling", |r| r.cull_seconds),
    ("device: drawing", |r| r.draw_seconds),
    ("device: form factors", |r| r.form_factor_seconds),
    ("device: gathering", |r| r.gather_seconds),
    ("hemicubes", |r| r.hemicubes as f64),
    ("device bytes", |r| r.device_bytes as f64),
];

/// How a quantity grows with the number of elements.
#[derive(Debug, Clone, Serialize)]
pub struct Growth {
    pub max_elements: Option<usize>,
    pub quantity: String,
    pub fit: PowerLaw,
}

/// Elements of each size: doubles of the first, and the last.
pub fn sizes(first: usize, largest: usize) -> Vec<usize> {
    let doubles = std::iter::successors(Some(first.max(1)), |n| n.checked_mul(2));
    let mut sizes: Vec<usize> = doubles.take_while(|&n| n < largest).collect();
    sizes.push(largest.max(first));
    sizes
}

/// Bakes, prints and writes `scaling.csv`, `scaling.json` and `scaling.svg` into `folder` after
/// each bake. `go_on` may stop it between batches; finished bakes are kept.
///
/// # Errors
/// A scene that cannot be cut into so many elements; a device that cannot hold it; files that
/// cannot be written.
pub fn run(
    device: &Arc<Device>,
    options: &Options,
    folder: &Path,
    go_on: impl Fn() -> bool,
) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    crate::say!(
        "{}; {} to an error bound of {} %, hemicube {}",
        device.name(),
        options.scene,
        100.0 * options.residual,
        options.hemicube
    );
    crate::say!("{HEADER}");
    let mut rows = Vec::new();
    for size in sizes(options.first, options.largest) {
        for &limit in &options.limits {
            let Some(row) = bake(device, options, size, limit, &go_on)? else {
                return Ok(());
            };
            crate::say!("{}", line(&row));
            rows.push(row);
            write(&rows, options, folder)?;
        }
    }
    for growth in growths(&rows, options) {
        crate::say!(
            "{} over elements, {}: exponent {}",
            growth.quantity,
            limit_name(growth.max_elements),
            growth.fit
        );
    }
    Ok(())
}

/// One row; none if it was stopped.
fn bake(
    device: &Arc<Device>,
    options: &Options,
    size: usize,
    limit: Option<usize>,
    go_on: &impl Fn() -> bool,
) -> Result<Option<Row>> {
    let builtin = LoadOptions {
        patches: Some(size),
        ..LoadOptions::default()
    };
    let scene = load(&options.scene, &builtin)?;
    let mut settings = Settings {
        residual: options.residual,
        hemicube: options.hemicube,
        grouping: Grouping {
            max_elements: limit.unwrap_or(usize::MAX),
            ..Grouping::default()
        },
        ..Settings::default()
    };
    // Relief has its own benchmark; what grows with the elements is the same without.
    settings.relief.transport = Transport::Lambert;
    memory::forget_peak();
    let start = Instant::now();
    let elements = Elements::new(&scene);
    let elements_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let mut solver = Solver::new(device, elements, &scene.lights, &settings)?;
    let setup_seconds = start.elapsed().as_secs_f64();
    let start = Instant::now();
    solver.run(|_| go_on())?;
    let solve_seconds = start.elapsed().as_secs_f64();
    let report = solver.report().clone();
    if report.stop == StopReason::Interrupted {
        return Ok(None);
    }
    let (device_bytes, resident_bytes) = (device.allocated_bytes(), memory::peak());
    let found = match options.samples {
        0 => None,
        samples => {
            let wanted = Wanted {
                sample: Sample::Some(samples),
                paths: options.paths,
                seed: 0,
                direct: false,
            };
            let light = solver.light()?.irradiance;
            let light = solver.problem.elements.to_input_order(&light);
            let found = irradiance::of_elements(&scene, &light, &wanted, &go_on)?;
            found.map(|measure| measure.centroids)
        }
    };
    Ok(Some(Row {
        scene: scene.name.clone(),
        max_elements: limit,
        elements: report.elements,
        sources: report.sources,
        elements_seconds,
        setup_seconds,
        solve_seconds,
        keep_seconds: report.seconds.stages.keep,
        cull_seconds: report.seconds.stages.cull,
        draw_seconds: report.seconds.stages.item_buffer,
        form_factor_seconds: report.seconds.stages.form_factors(),
        gather_seconds: report.seconds.gather,
        hemicubes: report.hemicubes,
        shots: report.shots,
        kept_sources: report.kept_sources,
        error_bound: report.error_bound,
        device_bytes,
        resident_bytes,
        bias: found.map(|f| f.bias),
        bias_interval: found.map(|f| f.bias_interval),
        rms: found.map(|f| f.rms),
    }))
}

fn limit_name(limit: Option<usize>) -> String {
    match limit {
        Some(limit) => format!("at most {limit} elements a source"),
        None => "sources by area and power alone".into(),
    }
}

fn growths(rows: &[Row], options: &Options) -> Vec<Growth> {
    let of = |limit: Option<usize>, (name, value): &Quantity| {
        let rows = rows.iter().filter(|r| r.max_elements == limit);
        let points: Vec<_> = rows.map(|r| (r.elements as f64, value(r))).collect();
        Some(Growth {
            max_elements: limit,
            quantity: (*name).to_owned(),
            fit: PowerLaw::fit(&points)?,
        })
    };
    let limits = options.limits.iter();
    limits
        .flat_map(|&limit| QUANTITIES.iter().filter_map(move |q| of(limit, q)))
        .collect()
}

const HEADER: &str = "elements  a source  sources  elements, s  setup, s  shots, s  (choose/cull/draw/factors/gather)  hemicubes     shots  kept   bound  device, MB  peak, MB  rms, %        bias, %";

fn line(row: &Row) -> String {
    let percent = |v: Option<f64>| v.map_or("-".into(), |v| format!("{:.2}", 100.0 * v));
    let stages = [
        row.keep_seconds,
        row.cull_seconds,
        row.draw_seconds,
        row.form_factor_seconds,
        row.gather_seconds,
    ];
    format!(
        "{:>8}{:>10}{:>9}{:>13.2}{:>10.2}{:>10.1}  {:>34}{:>11}{:>10}{:>6}{:>7}%{:>12.0}{:>10}{:>8}{:>8} ± {}",
        row.elements,
        row.max_elements.map_or("any".into(), |m| m.to_string()),
        row.sources,
        row.elements_seconds,
        row.setup_seconds,
        row.solve_seconds,
        stages.map(|s| format!("{s:.1}")).join("/"),
        row.hemicubes,
        row.shots,
        row.kept_sources,
        percent(row.error_bound),
        row.device_bytes as f64 / 1e6,
        row.resident_bytes
            .map_or("-".into(), |b| format!("{:.0}", b as f64 / 1e6)),
        percent(row.rms),
        percent(row.bias),
        percent(row.bias_interval),
    )
}

#[derive(Serialize)]
struct Written<'a> {
    rows: &'a [Row],
    growth: Vec<Growth>,
}

fn write(rows: &[Row], options: &Options, folder: &Path) -> Result<()> {
    let json = folder.join("scaling.json");
    let growth = growths(rows, options);
    let text = serde_json::to_string_pretty(&Written { rows, growth })
        .map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("scaling.csv"), |out| {
        writeln!(
            out,
            "scene,max_elements,elements,sources,elements_seconds,setup_seconds,solve_seconds,keep_seconds,cull_seconds,draw_seconds,form_factor_seconds,gather_seconds,hemicubes,shots,kept_sources,error_bound,device_bytes,resident_bytes,bias,bias_interval,rms"
        )?;
        for r in rows {
            let optional = |v: Option<f64>| v.map_or(String::new(), |v| v.to_string());
            let whole = |v: Option<u64>| v.map_or(String::new(), |v| v.to_string());
            writeln!(
                out,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                r.scene,
                whole(r.max_elements.map(|m| m as u64)),
                r.elements,
                r.sources,
                r.elements_seconds,
                r.setup_seconds,
                r.solve_seconds,
                r.keep_seconds,
                r.cull_seconds,
                r.draw_seconds,
                r.form_factor_seconds,
                r.gather_seconds,
                r.hemicubes,
                r.shots,
                r.kept_sources,
                optional(r.error_bound),
                r.device_bytes,
                whole(r.resident_bytes),
                optional(r.bias),
                optional(r.bias_interval),
                optional(r.rms)
            )?;
        }
        Ok(())
    })?;
    chart(rows, options).write(&folder.join("scaling.svg"))
}

/// Seconds of the bake and of its shots over elements, a pair of lines for each limit.
fn chart(rows: &[Row], options: &Options) -> Lines<'static> {
    const COLOURS: [(RGBColor, RGBColor); 3] = [
        (RGBColor(217, 95, 14), RGBColor(254, 196, 79)),
        (RGBColor(8, 69, 148), RGBColor(107, 174, 214)),
        (RGBColor(35, 139, 69), RGBColor(161, 217, 155)),
    ];
    let lines = options.limits.iter().enumerate().flat_map(|(i, &limit)| {
        let points = |value: fn(&Row) -> f64| {
            let rows = rows.iter().filter(|r| r.max_elements == limit);
            rows.map(|r| (r.elements as f64, value(r)))
                .collect::<Vec<_>>()
        };
        let all = points(Row::seconds);
        let fit = PowerLaw::fit(&all).map_or(String::new(), |p| format!(", exponent {p}"));
        let (dark, light) = COLOURS[i % COLOURS.len()];
        [
            Line {
                label: format!("bake, {}{fit}", limit_name(limit)),
                colour: dark,
                points: all,
            },
            Line {
                label: "of it shots".into(),
                colour: light,
                points: points(|r| r.solve_seconds),
            },
        ]
    });
    Lines {
        caption: "Time of a bake by the number of elements",
        x: "elements",
        y: "seconds",
        lines: lines.collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::sizes;

    #[test]
    fn sizes_double_up_to_the_largest() {
        assert_eq!(sizes(10, 80), [10, 20, 40, 80]);
        assert_eq!(sizes(10, 100), [10, 20, 40, 80, 100]);
        assert_eq!(sizes(10, 10), [10]);
        assert_eq!(sizes(10, 3), [10]);
    }
}
