//! `mesolux bench pictures`.

use std::path::PathBuf;

use clap::Args;

use super::progress::{Bar, catch_interrupts, interrupted};
use super::render::samples_per_side;
use super::solve_options::SolveOptions;
use super::{Builtin, DeviceOptions};
use mesolux::bench::pictures;
use mesolux::error::Result;

#[derive(Args)]
pub struct Options {
    /// Scenes (see `bake`), drawn by all of their cameras; if none is given, a room whose floor is
    /// flat, or has a relief of bricks, bumps or noise
    #[arg(value_name = "SCENE")]
    scenes: Vec<String>,
    /// Folder for pictures.csv, pictures.json and each picture beside its reference and their
    /// difference
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The room with this floor alone: flat, bricks, bumps or noise
    #[arg(long, value_name = "NAME", conflicts_with = "scenes")]
    material: Option<String>,
    /// Pixels a side
    #[arg(long, value_name = "N", default_value_t = 96)]
    size: u32,
    /// Paths of each pixel, of direct and of indirect light each
    #[arg(long, value_name = "N", default_value_t = 256)]
    paths: u32,
    /// Samples of each pixel of the pictures: 16, 64, 256 or 1024
    #[arg(long, value_name = "N", default_value = "16", value_parser = samples_per_side)]
    samples: u32,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn run(options: &Options) -> Result<()> {
    let solve = &options.solve;
    let settings = solve.settings()?;
    settings.check()?;
    let read = |name: &String| options.builtin.load_for(solve.quality(), name);
    let scenes = match options.scenes.as_slice() {
        [] => pictures::rooms(options.material.as_deref())?,
        names => names.iter().map(read).collect::<Result<_>>()?,
    };
    let wanted = pictures::Options {
        side: options.size,
        paths: options.paths,
        samples: options.samples,
        settings: &settings,
    };
    let device = options.device.open()?;
    catch_interrupts();
    let bar = Bar::new();
    pictures::run(&device, &scenes, &wanted, &options.output, |text| {
        bar.show(text);
        !interrupted()
    })?;
    bar.finish();
    options.device.check()
}
