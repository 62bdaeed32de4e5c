//! `mesolux render --frames`: a numbered series of pictures.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, ValueEnum};

use super::output::writable;
use super::progress::{Bar, catch_interrupts, interrupted};
use mesolux::atomic_file::with_ending;
use mesolux::error::Result;
use mesolux::render::{Development, Picture};
use mesolux::scene::{Camera, Scene, camera_path};

#[derive(Args)]
pub struct SeriesOptions {
    /// Draw a series of so many pictures, with their number in the name: out-0001.png,
    /// out-0002.png, ...
    ///
    /// All have the exposure of the first. Ctrl-C keeps those that are written.
    #[arg(long, value_name = "N")]
    frames: Option<u32>,
    /// How the camera moves in a series
    #[arg(long, value_enum, default_value = "turntable", requires = "frames")]
    path: PathName,
    /// Degrees of the turntable; of less than 360 the camera itself is in the middle
    #[arg(
        long,
        value_name = "DEGREES",
        default_value_t = 360.0,
        allow_hyphen_values = true,
        requires = "frames"
    )]
    turn: f64,
}

#[derive(Clone, Copy, ValueEnum)]
enum PathName {
    /// About the point that the camera looks at
    Turntable,
    /// Smoothly through all cameras of the scene, in their order
    Cameras,
}

impl SeriesOptions {
    /// The cameras of the series; none without --frames.
    pub fn cameras(&self, scene: &Scene, camera: &Camera) -> Result<Option<Vec<Camera>>> {
        let Some(frames) = self.frames else {
            return Ok(None);
        };
        Ok(Some(match self.path {
            PathName::Turntable => camera_path::turntable(camera, self.turn, frames)?,
            PathName::Cameras => camera_path::through(&scene.cameras, frames)?,
        }))
    }
}

/// The file of a picture of the series, counted from 1, with as many digits as the last number, at
/// least four.
fn numbered(output: &Path, number: usize, of: usize) -> PathBuf {
    let ending = output.extension().unwrap_or_default().to_string_lossy();
    let digits = of.to_string().len().max(4);
    with_ending(output, &format!("-{number:0digits$}.{ending}"))
}

/// Draws and writes the series; `draw` returns the picture from a camera, or None if it was
/// stopped.
pub fn draw<'a>(
    output: &Path,
    cameras: &'a [Camera],
    development: Development,
    mut draw: impl FnMut(&'a Camera) -> Result<Option<Picture>>,
) -> Result<()> {
    catch_interrupts();
    let (start, bar, of) = (Instant::now(), Bar::new(), cameras.len());
    writable(&numbered(output, 1, of))?;
    let (mut development, mut written) = (development, 0);
    for camera in cameras {
        if interrupted() {
            break;
        }
        let Some(picture) = draw(camera)? else {
            break;
        };
        (development.exposure).get_or_insert(picture.automatic_exposure);
        picture.write(&numbered(output, written + 1, of), development)?;
        written += 1;
        let taken = start.elapsed().as_secs_f64();
        bar.show(format!(
            "{written} of {of} pictures in {taken:.0} s, about {:.0} s left",
            taken / written as f64 * (of - written) as f64
        ));
    }
    bar.finish();
    tracing::info!(
        "{written} of {of} pictures in {:.1} s: {} to {}; exposure {:+.2}",
        start.elapsed().as_secs_f64(),
        numbered(output, 1, of).display(),
        numbered(output, written.max(1), of).display(),
        development.exposure.unwrap_or_default()
    );
    Ok(())
}
