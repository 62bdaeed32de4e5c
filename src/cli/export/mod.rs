//! `mesolux export`.

mod maps;
mod probes;
mod sensors;

use clap::{ArgMatches, Args};
use maps::MapOptions;
use probes::ProbeOptions;
use sensors::SensorOptions;

use super::bake_scene::BakeScene;
use super::baked::Wanted;
use super::solve_options::SolveOptions;
use super::{Builtin, DeviceOptions};
use mesolux::bake::lit_scene::LitScene;
use mesolux::error::{Error, Result};

/// Write the light of a scene or a bake for other programs
///
/// Each output is an option of its own; one command may write several. A SCENE is baked first, with
/// the options of `bake`, and the bake is kept for the next time.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE")]
    input: String,
    #[command(flatten)]
    maps: MapOptions,
    #[command(flatten)]
    sensors: SensorOptions,
    #[command(flatten)]
    probes: ProbeOptions,
    #[command(flatten, next_help_heading = "Baking")]
    bake_scene: BakeScene,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn run(options: &Options, given: &ArgMatches) -> Result<()> {
    options.sensors.check()?;
    options.maps.check()?;
    options.probes.check()?;
    let maps = &options.maps;
    let is_wanted = maps.is_wanted() || maps.vertex_glb.is_some();
    if options.sensors.values.is_none() && !is_wanted && options.probes.probes.is_empty() {
        let what = "nothing to write: give --light-map, --glb, --vertex-glb, --web, --probes, or \
                    --values with --sensors";
        return Err(Error::Usage(what.into()));
    }
    let wanted = Wanted {
        input: &options.input,
        bake_scene: &options.bake_scene,
        solve: &options.solve,
        builtin: &options.builtin,
    };
    wanted.check(given)?;
    let opened = wanted.open()?;
    let places = options.sensors.places(&opened.scene)?;
    let (grid, positions) = options.probes.positions(&opened.scene)?;
    let device = options.device.open()?;
    let (scene, bake) = opened.baked(&device)?;
    if bake.by_paper {
        let what = "a bake of --preset paper or --estimator pixel has no light at other places";
        return Err(Error::Usage(what.into()));
    }
    let lit_scene = LitScene::new(&scene, &bake)?;
    let lit = lit_scene.look();
    if let Some(path) = &options.maps.vertex_glb {
        options.maps.write_vertices(path, &scene, &lit)?;
    }
    if options.maps.is_wanted() {
        options.maps.write_maps(&scene, &lit)?;
    }
    if !positions.is_empty() {
        options.probes.write(&scene, &lit, grid, &positions)?;
    }
    options.sensors.write(&lit, &places)?;
    options.device.check()
}
