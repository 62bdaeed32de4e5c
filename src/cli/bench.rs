//! `mesolux bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::bake::progress;
use super::bake_scene::BakeScene;
use super::progress::{Bar, interrupted};
use super::solve_options::PresetName;
use super::{Builtin, DeviceOptions};
use mesolux::bake::quality;
use mesolux::bake::solution::Bake;
use mesolux::bench::places::Sample;
use mesolux::bench::truth::{Truth, Wanted};
use mesolux::bench::{figure3, frame, hemicube, irradiance, scaling, stress, table1};
use mesolux::error::{Error, Result};
use mesolux::scene::Scene;
use mesolux::solver::Settings;

/// Measure speeds on this machine; use a release build
#[derive(Args)]
pub struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// The paper's Figure 3: direct, indirect and global light, of a bunny under a point light and
    /// of a horse under an area light
    Figure3(Figure3Options),
    /// Milliseconds a frame of the three scenes, by shading of the relief, number of directions and
    /// size
    Frame(FrameOptions),
    /// Hemicubes a second in the Cornell box, with and without merging and culling, side by side
    Hemicube(HemicubeOptions),
    /// Irradiance of bakes of one scene, on what has no relief, against path traced irradiance with
    /// the relief as geometry
    Irradiance(IrradianceOptions),
    /// Pictures of relief against path traced geometry: relMSE, bias and HDR-FLIP by scene, view
    /// and part of the light
    Pictures(super::bench_pictures::Options),
    /// What precompute costs on each device of this machine, as a page with charts, as JSON and as
    /// Markdown: stages, rates, error against time, relighting, Table 1, frames
    Report(super::bench_report::Options),
    /// How time and memory of a bake grow with the number of elements, at one error bound
    Scaling(ScalingOptions),
    /// Scenes at the ends of what numbers and meshes can do: what was asked, what came out, and the
    /// verdict
    Stress(StressOptions),
    /// Error against run time of one scene, for the bake's settings and for other methods, against
    /// a path traced reference
    Pareto(super::pareto::Options),
    /// The paper's Table 1, minutes and frames a second: three scenes in 16, 32 and 64 directions,
    /// without directions, and with the relief as geometry
    Table1(Table1Options),
}

#[derive(Args)]
struct Table1Options {
    /// Folder for table1.csv, table1.json, table1.svg and table1-fps.svg
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Only this scene (fruit-platter, bowl-and-bunny, cornell-relief); may be given again
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// Elements of each scene, for a quicker look; the paper's numbers if not given
    #[arg(long, value_name = "N")]
    patches: Option<usize>,
    /// Also bake and draw by the paper's method to the letter: 20 to 75 minutes a bake at full size
    #[arg(long, value_enum)]
    preset: Option<PresetName>,
    /// Error bound at which a bake is done, as a share of the emitted power [default: 0.01, with
    /// --preset paper 0.05]
    #[arg(long, value_name = "X")]
    residual: Option<f64>,
    /// Rounds over which the frames are measured, 1280x720 pixels; each draws every kind of frame
    /// once; 0: no frames
    #[arg(long, value_name = "N", default_value_t = 9)]
    frame_rounds: usize,
    /// Leave out the bake of the relief as geometry, which takes longest
    #[arg(long)]
    no_high_poly: bool,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
struct Figure3Options {
    /// Folder for figure3.png and figure3-paper.png
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Also by the paper's method to the letter: about an hour at full size
    #[arg(long, value_enum)]
    preset: Option<PresetName>,
    /// Elements of each scene, for a quicker look; the paper's numbers if not given
    #[arg(long, value_name = "N")]
    patches: Option<usize>,
    /// Pixels a side of each of the six pictures
    #[arg(long, value_name = "N", default_value_t = 400)]
    size: u32,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
struct FrameOptions {
    /// Folder for frame.csv, frame.json and frame.svg
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Only these scenes; the three of Table 1 if not given
    #[arg(long, value_name = "SCENE")]
    scene: Vec<String>,
    /// Pixels across and down, one sample each; may be given again
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = super::render::size)]
    size: Vec<(u32, u32)>,
    /// Rounds; each draws every kind of frame once
    #[arg(long, value_name = "N", default_value_t = 15)]
    rounds: usize,
    /// Only this shading; may be given again. All if not given
    #[arg(long, value_name = "NAME", value_parser = frame::SHADINGS.map(|s| s.0))]
    shading: Vec<String>,
    /// Only so many directions; may be given again. 16, 32 and 64 if not given
    #[arg(long, value_name = "K", value_parser = clap::value_parser!(u32).range(1..=64))]
    directions: Vec<u32>,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
struct IrradianceOptions {
    /// Bakes of one scene
    #[arg(value_name = "BAKE.safetensors", required = true)]
    bakes: Vec<PathBuf>,
    #[command(flatten)]
    bake_scene: BakeScene,
    /// Folder for irradiance.csv, irradiance.json, and the reference, which is kept for the next
    /// run
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Elements that are compared, each at its centroid and at a random point: a number, stratified
    /// by size and by how close other surfaces are, or `all`
    #[arg(long, value_name = "N|all", default_value = "1000")]
    samples: Sample,
    /// Paths of each of these places
    #[arg(long, value_name = "N", default_value_t = 2000)]
    paths: u32,
    /// Other places
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
}

#[derive(Args)]
struct ScalingOptions {
    /// Folder for scaling.csv, scaling.json and scaling.svg
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Built-in scene that is cut into more and more elements
    #[arg(long, value_name = "NAME", default_value = "cornell")]
    scene: String,
    /// Elements of the first size; each next one has twice as many
    #[arg(long, value_name = "N", default_value_t = 10_000)]
    first: usize,
    /// Elements of the last size; the full range ends at 1000000
    #[arg(long, value_name = "N", default_value_t = 320_000)]
    largest: usize,
    /// Most elements of a source, 0 for no limit; may be given again. The program's own and none if
    /// not given
    #[arg(long, value_name = "N")]
    max_elements: Vec<usize>,
    /// Error bound at which a bake is done, as a share of the emitted power
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    residual: f64,
    /// Pixels a side of a hemicube face
    #[arg(long, value_name = "N", default_value_t = 128)]
    hemicube: u32,
    /// Places at which the path tracer measures the error, 0 for none
    #[arg(long, value_name = "N", default_value_t = 200)]
    samples: usize,
    /// Paths of each place
    #[arg(long, value_name = "N", default_value_t = 1000)]
    paths: u32,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
struct StressOptions {
    /// Folder for stress.csv and stress.json
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,
    /// Only cases with this in their name
    #[arg(long, value_name = "TEXT", default_value = "")]
    only: String,
    /// Scenes as small as those of the tests
    #[arg(long)]
    small: bool,
    #[command(flatten)]
    device: DeviceOptions,
}

#[derive(Args)]
struct HemicubeOptions {
    /// Pixels a side of a hemicube face
    #[arg(long, value_name = "N", default_value_t = 128)]
    hemicube: u32,
    /// Rounds; each runs every kind of culling once
    #[arg(long, value_name = "N", default_value_t = 9)]
    rounds: usize,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn run(options: &Options) -> Result<()> {
    match &options.what {
        What::Hemicube(options) => run_hemicube(options),
        What::Figure3(options) => run_figure3(options),
        What::Frame(options) => run_frame(options),
        What::Irradiance(options) => run_irradiance(options),
        What::Pictures(options) => super::bench_pictures::run(options),
        What::Report(options) => super::bench_report::run(options),
        What::Scaling(options) => run_scaling(options),
        What::Stress(options) => run_stress(options),
        What::Pareto(options) => super::pareto::run(options),
        What::Table1(options) => run_table1(options),
    }
}

fn run_frame(options: &FrameOptions) -> Result<()> {
    let all = || table1::SCENES.iter().map(|s| s.0.to_owned()).collect();
    let scenes: Vec<String> = match options.scene.is_empty() {
        true => all(),
        false => options.scene.clone(),
    };
    let device = options.device.open()?;
    let cache = super::solve_options::cache_folder();
    let wanted = frame::Options {
        sizes: options.size.clone(),
        rounds: options.rounds.max(1),
        shots: 1024,
        cache: cache.as_deref(),
        shadings: match options.shading.is_empty() {
            true => frame::SHADINGS.map(|s| s.0.to_owned()).to_vec(),
            false => options.shading.clone(),
        },
        directions: match options.directions.is_empty() {
            true => frame::DIRECTIONS.to_vec(),
            false => options.directions.clone(),
        },
    };
    super::progress::catch_interrupts();
    let bar = Bar::new();
    let go_on = |text| {
        bar.show(text);
        !interrupted()
    };
    mesolux::say!("{}", device.name());
    mesolux::say!("{}", frame::HEADER);
    let mut rows = Vec::new();
    for name in &scenes {
        let scene = options.builtin.load(name)?;
        frame::run(&device, &scene, &wanted, &mut rows, &go_on)?;
        if rows.is_empty() {
            continue;
        }
        frame::write(&rows, &options.output)?;
    }
    bar.finish();
    options.device.check()
}

fn run_figure3(options: &Figure3Options) -> Result<()> {
    if !(8..=4096).contains(&options.size) {
        return Err(Error::Usage(format!(
            "--size {}: must be in 8 to 4096",
            options.size
        )));
    }
    let device = options.device.open()?;
    super::progress::catch_interrupts();
    let draw = |name, settings| {
        let wanted = figure3::Options {
            name,
            side: options.size,
            patches: options.patches,
            settings,
        };
        let bar = Bar::new();
        let drawn = figure3::run(&device, &wanted, &options.output, |update| {
            bar.show(progress(update));
            !interrupted()
        });
        bar.finish();
        drawn
    };
    let mut ours = Settings::default();
    ours.relief.cache = super::solve_options::cache_folder();
    draw("figure3.png", ours)?;
    if options.preset.is_some() && !interrupted() {
        draw("figure3-paper.png", quality::paper(64)?)?;
    }
    options.device.check()
}

fn run_irradiance(options: &IrradianceOptions) -> Result<()> {
    let wanted = Wanted {
        sample: options.samples,
        paths: options.paths,
        seed: options.seed.into(),
        direct: false,
    };
    let folder = options.output.as_deref();
    if let Some(folder) = folder {
        std::fs::create_dir_all(folder).map_err(|e| Error::write(folder, e))?;
    }
    super::progress::catch_interrupts();
    let go_on = || !super::progress::interrupted();
    let mut rows = Vec::new();
    // A scene whose elements are cut in another way has other places.
    let mut known: Option<(String, Scene, Truth)> = None;
    for path in &options.bakes {
        let bake = Bake::load(path)?;
        let hash = &bake.origin.hash;
        if known.as_ref().is_some_and(|(of, ..)| of != hash) {
            return Err(Error::file(
                path,
                "a bake of another scene than the first one's",
            ));
        }
        let same = known
            .take()
            .filter(|(_, scene, _)| scene.on_input() == bake.on_input);
        let (scene, truth) = match same {
            Some((_, scene, truth)) => (scene, truth),
            None => {
                let scene = options.bake_scene.of(path, &bake.origin, &bake.on_input)?;
                let Some(truth) = irradiance::truth(&scene, &wanted, folder, &go_on)? else {
                    return Ok(());
                };
                (scene, truth)
            }
        };
        let row = irradiance::Row::new(path, &scene, &bake, &truth);
        row.print();
        rows.push(row);
        known = Some((hash.clone(), scene, truth));
        if let Some(folder) = folder {
            irradiance::write(&rows, folder)?;
        }
    }
    Ok(())
}

fn run_table1(options: &Table1Options) -> Result<()> {
    let all = || table1::SCENES.iter().map(|s| s.0.to_owned()).collect();
    let wanted = table1::Options {
        scenes: if options.scene.is_empty() {
            all()
        } else {
            options.scene.clone()
        },
        patches: options.patches,
        residual: (options.residual).unwrap_or(if options.preset.is_some() { 0.05 } else { 0.01 }),
        paper: options.preset.is_some(),
        high_poly: !options.no_high_poly,
        frame_rounds: options.frame_rounds,
        cache: super::solve_options::cache_folder(),
    };
    let device = options.device.open()?;
    super::progress::catch_interrupts();
    table1::run(&device, &wanted, &options.output, || {
        !super::progress::interrupted()
    })?;
    options.device.check()
}

fn run_scaling(options: &ScalingOptions) -> Result<()> {
    let own = mesolux::mesh::sources::Grouping::default().max_elements;
    let limits = match options.max_elements.is_empty() {
        true => vec![Some(own), None],
        false => options
            .max_elements
            .iter()
            .map(|&n| (n > 0).then_some(n))
            .collect(),
    };
    let wanted = scaling::Options {
        scene: options.scene.clone(),
        first: options.first,
        largest: options.largest,
        limits,
        residual: options.residual,
        hemicube: options.hemicube,
        samples: options.samples,
        paths: options.paths,
    };
    let device = options.device.open()?;
    super::progress::catch_interrupts();
    scaling::run(&device, &wanted, &options.output, || {
        !super::progress::interrupted()
    })?;
    options.device.check()
}

fn run_stress(options: &StressOptions) -> Result<()> {
    let context = stress::Context {
        device: options.device.open()?,
        size: match options.small {
            true => stress::Size::Small,
            false => stress::Size::Full,
        },
    };
    stress::run(&context, &options.only, options.output.as_deref())?;
    options.device.check()
}

fn run_hemicube(options: &HemicubeOptions) -> Result<()> {
    let builtin = Builtin {
        patches: options.builtin.patches.or(Some(83_160)),
        ..options.builtin.clone()
    };
    let scene = builtin.load("cornell")?;
    let device = options.device.open()?;
    hemicube::run(&device, &scene, options.hemicube, options.rounds)
}
