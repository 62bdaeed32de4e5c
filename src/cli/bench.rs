//! `mesolux bench`.

use clap::{Args, Subcommand};

use super::{Builtin, DeviceOptions};
use mesolux::bench::hemicube;
use mesolux::error::Result;

/// Measure speeds on this machine; use a release build
#[derive(Args)]
pub struct Options {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand)]
enum What {
    /// Hemicubes a second in the Cornell box, with and without culling, side by side
    Hemicube(HemicubeOptions),
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
    let What::Hemicube(options) = &options.what;
    let builtin = Builtin {
        patches: options.builtin.patches.or(Some(83_160)),
        statue: options.builtin.statue.clone(),
    };
    let scene = builtin.load("cornell")?;
    let device = options.device.open()?;
    hemicube::run(&device, &scene, options.hemicube, options.rounds)
}
