//! `mesolux bench`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{Builtin, DeviceOptions};
use mesolux::bench::{frame, hemicube, irradiance, table1};
use mesolux::error::{Error, Result};
use mesolux::solution::Bake;

/// Measure speeds on this machine; use a release build
#[derive(Args)]
pub struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Milliseconds a frame of the three scenes, by shading of the relief and number of directions
    Frame(FrameOptions),
    /// Hemicubes a second in the Cornell box, with and without culling, side by side
    Hemicube(HemicubeOptions),
    /// Irradiance of bakes of one scene, on what has no relief, against path traced irradiance with the relief as geometry
    Irradiance(IrradianceOptions),
    /// Error against run time of one scene, for the bake's settings and for other methods, against a path traced reference
    Pareto(super::pareto::Options),
    /// The paper's Table 1: three scenes in 16, 32 and 64 directions, without directions, and with the relief as geometry
    Table1(Table1Options),
}

#[derive(Args)]
struct Table1Options {
    /// Folder for table1.csv, table1.json and table1.svg
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Only this scene (fruit-platter, bowl-and-bunny, cornell-relief); may be given again
    #[arg(long, value_name = "NAME")]
    scene: Vec<String>,
    /// Elements of each scene, for a quicker look; the paper's numbers if not given
    #[arg(long, value_name = "N")]
    patches: Option<usize>,
    /// Error bound at which a bake is done, as a share of the emitted power
    #[arg(long, value_name = "X", default_value_t = 0.01)]
    residual: f64,
    /// Leave out the bake of the relief as geometry, which takes longest
    #[arg(long)]
    no_high_poly: bool,
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
    /// Pixels across and down, one sample each
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = super::render::size)]
    size: (u32, u32),
    /// Rounds; each draws every kind of frame once
    #[arg(long, value_name = "N", default_value_t = 15)]
    rounds: usize,
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
    /// Places that are compared, at random by area
    #[arg(long, value_name = "N", default_value_t = 400)]
    samples: usize,
    /// Paths of each place
    #[arg(long, value_name = "N", default_value_t = 2000)]
    paths: u32,
    /// Other places
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
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
        What::Frame(options) => run_frame(options),
        What::Irradiance(options) => run_irradiance(options),
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
    let cache = super::bake::cache_folder();
    let wanted = frame::Options {
        size: options.size,
        rounds: options.rounds.max(1),
        shots: 256,
        cache: cache.as_deref(),
    };
    println!("{}; {}x{}", device.name(), options.size.0, options.size.1);
    println!("{}", frame::HEADER);
    let mut rows = Vec::new();
    for name in &scenes {
        let scene = options.builtin.load(name)?;
        frame::run(&device, &scene, &wanted, &mut rows)?;
        frame::write(&rows, &options.output)?;
    }
    options.device.check()
}

fn run_irradiance(options: &IrradianceOptions) -> Result<()> {
    let wanted = irradiance::Options {
        samples: options.samples.max(2),
        paths: options.paths,
        seed: options.seed,
    };
    let mut known: Option<(String, Vec<irradiance::Sample>)> = None;
    for path in &options.bakes {
        let bake = Bake::load(path)?;
        let hash = &bake.origin.hash;
        let samples = match &known {
            Some((of, samples)) if of == hash => samples,
            Some(_) => {
                return Err(Error::file(
                    path,
                    "a bake of another scene than the first one's",
                ));
            }
            None => {
                let scene = Builtin::scene_of(path, &bake)?;
                let samples = irradiance::samples(&scene, &wanted)?;
                &known.insert((hash.clone(), samples)).1
            }
        };
        let found = irradiance::compare(&bake.irradiance, samples);
        println!(
            "{}: {} places without relief: bias {:+.2} % ± {:.2} (95 %), rms {:.2} % (path tracer's noise of {:.2} % taken off)",
            path.display(),
            found.samples,
            100.0 * found.bias,
            100.0 * found.bias_interval,
            100.0 * found.rms,
            100.0 * found.noise
        );
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
        residual: options.residual,
        high_poly: !options.no_high_poly,
    };
    let device = options.device.open()?;
    super::progress::catch_interrupts();
    table1::run(&device, &wanted, &options.output, || {
        !super::progress::interrupted()
    })?;
    options.device.check()
}

fn run_hemicube(options: &HemicubeOptions) -> Result<()> {
    let builtin = Builtin {
        patches: options.builtin.patches.or(Some(83_160)),
        statue: options.builtin.statue.clone(),
    };
    let scene = builtin.load("cornell")?;
    let device = options.device.open()?;
    hemicube::run(&device, &scene, options.hemicube, options.rounds)
}
