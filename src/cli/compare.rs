//! `mesolux compare`.

use std::path::PathBuf;

use clap::Args;

use super::output::writable;
use mesolux::error::Result;
use mesolux::render::{Comparison, FileKind, Flip, Picture, side_by_side};

/// Measure how much a picture differs from a reference of the same view
///
/// Both are OpenEXR files of linear radiance, as `render` writes them. Printed are relMSE (mean of
/// (a - b)^2 / (b^2 + e^2), e a hundredth of the reference's mean), the bias of the mean, the root
/// mean square difference over the mean, and HDR-FLIP (Andersson et al. 2021), how different the
/// two look in turns: 0 for alike, 1 at most, the mean over the pixels.
#[derive(Args)]
pub struct Options {
    #[arg(value_name = "PICTURE.exr|.hdr")]
    ours: PathBuf,
    #[arg(value_name = "REFERENCE.exr|.hdr")]
    reference: PathBuf,
    /// Both and their difference side by side: red where the picture is brighter, blue where it is
    /// darker
    #[arg(short, long, value_name = "IMAGE.png|.exr")]
    output: Option<PathBuf>,
    /// Where they look different: FLIP of each pixel, black for 0 to pale yellow for 1; as numbers
    /// in an .exr
    #[arg(long, value_name = "IMAGE.png|.exr")]
    flip: Option<PathBuf>,
}

pub fn run(options: &Options) -> Result<()> {
    for output in [&options.output, &options.flip].into_iter().flatten() {
        FileKind::of(output)?;
        writable(output)?;
    }
    let ours = Picture::read(&options.ours)?;
    let reference = Picture::read(&options.reference)?;
    let found = Comparison::new(&ours, &reference)?;
    let flip = Flip::new(&ours, &reference)?;
    mesolux::say!(
        "relMSE {:.3e}, bias {:+.2} %, rms {:.2} %, HDR-FLIP {:.4} (exposures {:+.2} to {:+.2})",
        found.rel_mse,
        100.0 * found.bias,
        100.0 * found.rms,
        flip.mean(),
        flip.exposures[0],
        flip.exposures[1]
    );
    if let Some(output) = &options.flip {
        flip.write(output)?;
    }
    if let Some(output) = &options.output {
        side_by_side(&ours, &reference)?.write(output, None)?;
    }
    Ok(())
}
