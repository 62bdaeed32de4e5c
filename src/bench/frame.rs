//! `mesolux bench frame`: how long a frame takes, by scene, number of directions, shading and size.

use std::path::Path;
use std::sync::Arc;

use glam::DVec3;
use plotters::style::RGBColor;
use serde::Serialize;

use super::bars::{Bar, Bars};
use super::spread;
use crate::atomic_file::write_atomically;
use crate::bake;
use crate::bake::solution::Solution;
use crate::error::{Error, Result};
use crate::math::directions::Directions;
use crate::meso::Options as ReliefOptions;
use crate::render::{Direct, Lighting, ReliefShading, Renderer, View};
use crate::scene::{Camera, Scene};
use crate::solver::Settings;
use crate::vk::Device;

/// What is measured.
pub struct Options<'a> {
    /// Pixels across and down.
    pub sizes: Vec<(u32, u32)>,
    /// Rounds; in each, every kind of frame is drawn once.
    pub rounds: usize,
    /// Shots of the bakes. The time of a frame does not depend on the light, except for clusters,
    /// whose number grows with the number of lit slots.
    pub shots: u32,
    pub cache: Option<&'a Path>,
    /// Names of [`SHADINGS`].
    pub shadings: Vec<String>,
    /// Numbers of directions.
    pub directions: Vec<u32>,
}

/// One kind of frame.
#[derive(Debug, Clone, Serialize)]
pub struct Row {
    pub scene: String,
    /// The scene's own camera, or `relief`, whose whole frame shows relief.
    pub camera: String,
    pub shading: String,
    /// None for plain triangles.
    pub directions: Option<u32>,
    pub width: u32,
    pub height: u32,
    /// Share of the pixels that show relief.
    pub relief: f64,
    /// Milliseconds: median, and the 10 % and 90 % points.
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

/// How frames are drawn, by name.
pub const SHADINGS: [(&str, ReliefShading, Direct); 6] = [
    ("none", ReliefShading::None, Direct::Slots),
    ("normal", ReliefShading::Normal, Direct::Slots),
    ("parallax", ReliefShading::Parallax, Direct::Slots),
    ("factored, slots", ReliefShading::Factored, Direct::Slots),
    ("factored, sharp", ReliefShading::Factored, Direct::Sharp),
    ("clusters", ReliefShading::Clusters, Direct::Slots),
];
pub const DIRECTIONS: [u32; 3] = [16, 32, 64];

/// Measures frames of one scene, prints them, and appends them to `rows`. `go_on` gets a line about
/// each step before it begins; if it returns false, this returns with the rounds that are complete.
///
/// # Errors
/// A scene without a camera; a device that lacks the memory or fails.
pub fn run(
    device: &Arc<Device>,
    scene: &Scene,
    options: &Options<'_>,
    rows: &mut Vec<Row>,
    go_on: &dyn Fn(String) -> bool,
) -> Result<()> {
    let mut solutions = Vec::new();
    for &k in &options.directions {
        if !go_on(format!("baking {} in {k} directions", scene.name)) {
            return Ok(());
        }
        let settings = Settings {
            shots: Some(options.shots),
            relief: ReliefOptions {
                directions: Directions::new(k)?,
                cache: options.cache.map(Path::to_owned),
                ..ReliefOptions::default()
            },
            ..Settings::default()
        };
        let shown = |_: &_| go_on(format!("baking {} in {k} directions", scene.name));
        solutions.push(bake::bake(device, scene, &settings, shown)?);
    }
    let own = scene.cameras.first().cloned().ok_or_else(|| {
        Error::Usage(format!(
            "scene {} has no camera to draw frames from",
            scene.name
        ))
    })?;
    let cameras = [Some(own.clone()), close(scene, &solutions[0], &own)];
    for camera in cameras.into_iter().flatten() {
        for &(width, height) in &options.sizes {
            let view = View {
                camera: &camera,
                width,
                height,
            };
            let first = rows.len();
            measure(device, scene, &solutions, &view, options, rows, go_on)?;
            for row in &rows[first..] {
                crate::say!("{}", line(row, &rows[first..]));
            }
        }
    }
    Ok(())
}

/// Frames of one camera and size, by shading and number of directions.
fn measure(
    device: &Arc<Device>,
    scene: &Scene,
    solutions: &[Solution],
    view: &View<'_>,
    options: &Options<'_>,
    rows: &mut Vec<Row>,
    go_on: &dyn Fn(String) -> bool,
) -> Result<()> {
    let mut found = Vec::new();
    let mut renderers = Vec::new();
    let wanted = |name: &str| options.shadings.iter().any(|wanted| wanted == name);
    for (name, shading, direct) in SHADINGS.into_iter().filter(|s| wanted(s.0)) {
        for (&k, solution) in options.directions.iter().zip(solutions) {
            if shading == ReliefShading::None && k != options.directions[0] {
                continue;
            }
            let camera = &view.camera.name;
            if !go_on(format!(
                "{}, {camera}: preparing {name}, K = {k}",
                scene.name
            )) {
                return Ok(());
            }
            let lighting = Lighting {
                shading,
                direct,
                cache: options.cache,
                ..Lighting::from(solution)
            };
            let renderer = Renderer::new(device, scene, lighting, view, 1)?;
            found.push(Row {
                scene: scene.name.clone(),
                camera: view.camera.name.clone(),
                shading: name.into(),
                directions: (shading != ReliefShading::None).then_some(k),
                width: view.width,
                height: view.height,
                relief: renderer.relief_coverage()?,
                median: 0.0,
                low: 0.0,
                high: 0.0,
            });
            renderers.push(renderer);
        }
    }
    let rounds = |round| {
        let camera = &view.camera.name;
        go_on(format!(
            "{}, {camera}: round {round} of {}",
            scene.name, options.rounds
        ))
    };
    let Some(times) = in_turns_while(&renderers, options.rounds, rounds)? else {
        return Ok(());
    };
    for (row, (median, low, high)) in found.iter_mut().zip(times) {
        (row.median, row.low, row.high) = (median, low, high);
    }
    rows.append(&mut found);
    Ok(())
}

/// Milliseconds of a frame of each, median and the 10 % and 90 % points over `rounds` rounds.
///
/// The renderers take turns, so that disturbances of the machine affect all of them; an extra first
/// round warms up.
///
/// # Errors
/// A device that fails.
pub fn in_turns(renderers: &[Renderer<'_>], rounds: usize) -> Result<Vec<(f64, f64, f64)>> {
    Ok(in_turns_while(renderers, rounds, |_| true)?.unwrap_or_default())
}

/// As [`in_turns`], as long as `go_on` says so before a round; None if not one was measured.
fn in_turns_while(
    renderers: &[Renderer<'_>],
    rounds: usize,
    go_on: impl Fn(usize) -> bool,
) -> Result<Option<Vec<(f64, f64, f64)>>> {
    let mut times = vec![Vec::with_capacity(rounds); renderers.len()];
    for round in 0..=rounds {
        if !go_on(round) {
            break;
        }
        for (renderer, times) in renderers.iter().zip(&mut times) {
            let taken = renderer.frames(1)?;
            if round > 0 {
                times.extend(taken.iter().map(|s| 1e3 * s));
            }
        }
    }
    if times.iter().any(Vec::is_empty) {
        return Ok(None);
    }
    Ok(Some(times.iter_mut().map(|times| spread(times)).collect()))
}

pub const HEADER: &str = "scene             camera        size shading           K  relief   ms a frame (10 % to 90 %)    over K = 16  over none";

fn line(row: &Row, others: &[Row]) -> String {
    let over =
        |other: Option<&Row>| other.map_or("-".into(), |o| format!("{:.3}", row.median / o.median));
    let sixteen = others
        .iter()
        .find(|o| o.shading == row.shading && o.directions == Some(16));
    format!(
        "{:<17} {:<8} {:>9} {:<16} {:>2} {:>6.1}% {:>9.1} ({:.1} to {:.1}) {:>13} {:>10}",
        row.scene,
        row.camera,
        format!("{}x{}", row.width, row.height),
        row.shading,
        row.directions.map_or("-".into(), |k| k.to_string()),
        100.0 * row.relief,
        row.median,
        row.low,
        row.high,
        over(sixteen.filter(|_| row.directions.is_some())),
        over(others.iter().find(|o| o.shading == "none"))
    )
}

/// A camera that sees the relief alone: from the scene's camera towards an element near the middle
/// of the relief, narrowed until a sphere about it of a tenth of the relief's extent fills the
/// frame.
fn close(scene: &Scene, solution: &Solution, own: &Camera) -> Option<Camera> {
    let relief = solution.relief.as_ref()?;
    let centroid = |e: u32| {
        let corners = scene.corners(&scene.triangles[e as usize]);
        corners.iter().sum::<DVec3>() / 3.0
    };
    let facing = |e: u32| {
        let [a, b, c] = scene.corners(&scene.triangles[e as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        normal.dot((own.position - a).normalize_or_zero())
    };
    let count = relief.elements.len() as f64;
    let middle = relief.elements.iter().map(|&e| centroid(e)).sum::<DVec3>() / count;
    let extent = relief
        .elements
        .iter()
        .map(|&e| centroid(e).distance(middle))
        .sum::<f64>()
        / count;
    let nearest = relief
        .elements
        .iter()
        .filter(|&&e| facing(e) > 0.5)
        .min_by(|&&a, &&b| {
            let far = |e| centroid(e).distance(middle) - facing(e) * extent;
            far(a).total_cmp(&far(b))
        })?;
    let at = centroid(*nearest);
    Some(Camera {
        name: "relief".into(),
        look_at: at,
        fov_y: 2.0
            * (0.1 * extent / own.position.distance(at))
                .atan()
                .to_degrees(),
        ..own.clone()
    })
}

/// Writes `frame.csv`, `frame.json` and `frame.svg` into `folder`.
pub fn write(rows: &[Row], folder: &Path) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    let json = folder.join("frame.json");
    let text = serde_json::to_string_pretty(rows).map_err(|e| Error::file(&json, e.to_string()))?;
    write_atomically(&json, |out| out.write_all(text.as_bytes()))?;
    write_atomically(&folder.join("frame.csv"), |out| {
        writeln!(
            out,
            "scene,camera,shading,directions,width,height,relief,median_ms,low_ms,high_ms"
        )?;
        for r in rows {
            writeln!(
                out,
                "{},{},\"{}\",{},{},{},{},{},{},{}",
                r.scene,
                r.camera,
                r.shading,
                r.directions.map_or(String::new(), |k| k.to_string()),
                r.width,
                r.height,
                r.relief,
                r.median,
                r.low,
                r.high
            )?;
        }
        Ok(())
    })?;
    chart(rows).write(&folder.join("frame.svg"))
}

/// Milliseconds with their spread for K = 64, one group for a scene, camera and size; of the
/// clusters, whose cost grows with K, for each K.
fn chart(rows: &[Row]) -> Bars<'static> {
    const KINDS: [(&str, u32, RGBColor); 8] = [
        ("none", 64, RGBColor(120, 120, 120)),
        ("normal", 64, RGBColor(158, 202, 225)),
        ("parallax", 64, RGBColor(66, 146, 198)),
        ("factored, slots", 64, RGBColor(8, 69, 148)),
        ("factored, sharp", 64, RGBColor(217, 95, 14)),
        ("clusters", 16, RGBColor(199, 233, 192)),
        ("clusters", 32, RGBColor(116, 196, 118)),
        ("clusters", 64, RGBColor(0, 109, 44)),
    ];
    let group = |row: &Row| {
        format!(
            "{}, {}, {}x{}",
            row.scene, row.camera, row.width, row.height
        )
    };
    let mut groups: Vec<String> = Vec::new();
    for row in rows {
        if !groups.contains(&group(row)) {
            groups.push(group(row));
        }
    }
    let bars = rows.iter().filter_map(|row| {
        Some(Bar {
            group: groups.iter().position(|g| *g == group(row))?,
            kind: KINDS
                .iter()
                .position(|k| k.0 == row.shading && row.directions.is_none_or(|d| d == k.1))?,
            value: row.median,
            spread: Some((row.low, row.high)),
        })
    });
    Bars {
        caption: "Time of a frame, K = 64 where not said",
        unit: "milliseconds",
        bars: bars.collect(),
        kinds: KINDS
            .iter()
            .map(|&(shading, k, colour)| match shading {
                "clusters" => (format!("{shading}, K = {k}"), colour),
                _ => (shading.to_owned(), colour),
            })
            .collect(),
        groups,
    }
}
