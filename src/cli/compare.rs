//! `mesolux compare`.

use std::path::PathBuf;

use clap::Args;

use super::bake::writable;
use mesolux::error::Result;
use mesolux::render::{Comparison, FileKind, Picture, side_by_side};

/// Tell how far a picture is from a reference of the same view
///
/// Both are OpenEXR files of linear radiance, as `render` writes them. Printed are relMSE (mean of (a - b)^2 / (b^2 + e^2), e a
/// hundredth of the reference's mean), the bias of the mean and the root mean square difference over the mean.
#[derive(Args)]
pub struct Options {
    #[arg(value_name = "PICTURE.exr")]
    ours: PathBuf,
    #[arg(value_name = "REFERENCE.exr")]
    reference: PathBuf,
    /// Both and their difference side by side: red where the picture is brighter, blue where it is darker
    #[arg(short, long, value_name = "IMAGE.png|.exr")]
    output: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<()> {
    if let Some(output) = &options.output {
        FileKind::of(output)?;
        writable(output)?;
    }
    let ours = Picture::read(&options.ours)?;
    let reference = Picture::read(&options.reference)?;
    let found = Comparison::new(&ours, &reference)?;
    println!(
        "relMSE {:.3e}, bias {:+.2} %, rms {:.2} %",
        found.rel_mse,
        100.0 * found.bias,
        100.0 * found.rms
    );
    if let Some(output) = &options.output {
        side_by_side(&ours, &reference)?.write(output, None)?;
    }
    Ok(())
}
