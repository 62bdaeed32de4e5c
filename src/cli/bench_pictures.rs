//! `mesolux bench pictures`.

use std::path::PathBuf;

use clap::Args;

use super::DeviceOptions;
use super::progress::{catch_interrupts, interrupted};
use mesolux::bench::pictures;
use mesolux::error::Result;
use mesolux::render::Lighting;

#[derive(Args)]
pub struct Options {
    /// Folder for pictures.csv, pictures.json and each picture beside its reference and their
    /// difference
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Only this material: flat, bricks, bumps or noise
    #[arg(long, value_name = "NAME")]
    material: Option<String>,
    /// Pixels a side
    #[arg(long, value_name = "N", default_value_t = 96)]
    size: u32,
    /// Paths of each pixel, of direct and of indirect light each
    #[arg(long, value_name = "N", default_value_t = 256)]
    paths: u32,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn run(options: &Options) -> Result<()> {
    let device = options.device.open()?;
    let cache = super::solve_options::cache_folder();
    let wanted = pictures::Options {
        side: options.size,
        paths: options.paths,
        material: options.material.as_deref(),
        lighting: Lighting {
            cache: cache.as_deref(),
            ..Lighting::from(&[][..])
        },
    };
    catch_interrupts();
    pictures::run(&device, &wanted, &options.output, || !interrupted())?;
    options.device.check()
}
