//! `mesolux bench pareto`.

use std::path::PathBuf;
use std::time::Duration;

use clap::Args;

use super::progress::{catch_interrupts, interrupted};
use super::{Builtin, DeviceOptions};
use mesolux::bench::pareto::{self, Grid};
use mesolux::bench::places::Sample;
use mesolux::bench::truth::Wanted;
use mesolux::error::{Error, Result};

#[derive(Args)]
pub struct Options {
    /// A built-in name, an .obj file, or a scene.toml
    scene: String,
    /// Folder for pareto.csv, pareto.json, pareto.svg, pareto.png, and the reference, which is kept
    /// for the next run
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Elements that are compared, each at its centroid and at a random point: a number, stratified
    /// by size and by how close other surfaces are, or `all`
    #[arg(long, value_name = "N|all", default_value = "4000")]
    samples: Sample,
    /// Paths of the reference at each of these places
    #[arg(long, value_name = "N", default_value_t = 8192)]
    paths: u32,
    /// Other places
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u32,
    /// Hemicubes of the receiver estimator; none if the option has no value
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "32,64,128,256", num_args = 0..)]
    hemicube: Vec<u32>,
    /// Hemicubes of the pixel estimator
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "64,128,256,512", num_args = 0..)]
    pixel_hemicube: Vec<u32>,
    /// Sides of the hemicubes of strong emitters over that of all others; 1 draws them as all
    /// others, 0 is a bake's default: shadow rays, and four times as fine with the pixel estimator
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_value = "0")]
    emitter_scale: Vec<u32>,
    /// Sizes of the sources over the default one; from 4 on with fewer places on emitters, as
    /// `draft`, from 8 on with fewer near sources, as `preview`, up to 0.25 with more, as `high`
    #[arg(
        long,
        value_name = "X,...",
        value_delimiter = ',',
        default_value = "4,1,0.25"
    )]
    source_scale: Vec<f64>,
    /// Numbers of directions, where the scene has relief
    #[arg(
        long,
        value_name = "K,...",
        value_delimiter = ',',
        default_value = "16,32,64"
    )]
    directions: Vec<u32>,
    /// Error bound at which a bake is done; its errors on the way there are measured too
    #[arg(long, value_name = "X", default_value_t = 1e-3)]
    residual: f64,
    /// Most seconds of a bake
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0)]
    limit: f64,
    /// Most seconds of one measurement of another method, at as many places as a bake has elements
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0)]
    peer_limit: f64,
    /// Leave out instant radiosity, the path tracer, Mitsuba and Cycles
    #[arg(long)]
    no_peers: bool,
    /// The Python whose Mitsuba 3 and Blender (packages `mitsuba` and `bpy`) are measured, if it
    /// has them; Mitsuba finds LLVM by DRJIT_LIBLLVM_PATH
    #[arg(long, value_name = "PYTHON", default_value = "python3")]
    python: PathBuf,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

fn seconds(name: &str, value: f64) -> Result<Duration> {
    match (0.0..=1e9).contains(&value) {
        true => Ok(Duration::from_secs_f64(value)),
        false => Err(Error::Usage(format!(
            "{name} {value}: must be seconds, 0 or more"
        ))),
    }
}

pub fn run(options: &Options) -> Result<()> {
    let sound = |s: &f64| (0.01..=100.0).contains(s);
    if let Some(bad) = options.source_scale.iter().find(|s| !sound(s)) {
        return Err(Error::Usage(format!(
            "--source-scale {bad}: must be in 0.01 to 100"
        )));
    }
    let wanted = pareto::Options {
        wanted: Wanted {
            sample: options.samples,
            paths: options.paths,
            seed: options.seed.into(),
            direct: true,
        },
        grid: Grid {
            hemicubes: options.hemicube.clone(),
            emitter_scales: options.emitter_scale.clone(),
            scales: options.source_scale.clone(),
            pixel_hemicubes: options.pixel_hemicube.clone(),
            directions: options.directions.clone(),
            residual: options.residual,
            limit: seconds("--limit", options.limit)?,
        },
        peers: match options.no_peers {
            true => None,
            false => Some(seconds("--peer-limit", options.peer_limit)?),
        },
        python: options.python.clone(),
    };
    let scene = options.builtin.load(&options.scene)?;
    let device = options.device.open()?;
    catch_interrupts();
    pareto::run(&device, &scene, &wanted, &options.output, || !interrupted())?;
    options.device.check()
}
