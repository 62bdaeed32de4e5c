//! `mesolux scene`.

use std::path::PathBuf;

use clap::Args;

use super::Builtin;
use mesolux::error::{Error, Result};

/// Write a built-in scene as OBJ, MTL and scene.toml, cut only where --element-size or --fineness
/// asks for it
#[derive(Args)]
pub struct Options {
    /// A built-in name: cornell, fruit-platter, bowl-and-bunny, cornell-relief, brick-court,
    /// cornell-box, brick-corner, brick-wall, woven-cloth or embossed-plate
    name: String,
    /// The folder to write to
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    #[command(flatten)]
    builtin: Builtin,
}

pub fn run(options: &Options) -> Result<()> {
    let names = mesolux::scene::builtin::NAMES;
    if !names.contains(&options.name.as_str()) {
        return Err(Error::Usage(format!(
            "no built-in scene \"{}\"; there is {}",
            options.name,
            names.join(", ")
        )));
    }
    let scene = options.builtin.load_as_made(&options.name)?;
    let path = mesolux::scene::write_scene(&scene, &options.output)?;
    tracing::info!("{}: {} elements", path.display(), scene.triangles.len());
    Ok(())
}
