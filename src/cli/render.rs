//! `mesolux render`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;

use super::bake::{SolveOptions, bake_visibly, writable};
use super::camera::CameraOptions;
use super::reference::{self, ReferenceOptions};
use super::show::ShowOptions;
use super::{Builtin, DeviceOptions};
use mesolux::error::{Error, Result};
use mesolux::render::{FileKind, Lighting, Picture, View, render};
use mesolux::scene::{Camera, Scene};
use mesolux::solution::Bake;
use mesolux::vk::Device;

/// Draw a scene or a bake to a picture
///
/// A PNG is exposed and tone-mapped; an EXR holds linear radiance. A SCENE is baked first, with the options of `bake`, or
/// path traced with --reference.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE")]
    input: String,
    /// The picture to write: .png or .exr
    #[arg(short, long, value_name = "IMAGE.png|.exr")]
    output: PathBuf,
    /// Pixels across and down
    #[arg(long, value_name = "WxH", default_value = "800x800", value_parser = size)]
    size: (u32, u32),
    #[command(flatten)]
    camera: CameraOptions,
    /// Multiplies the light by 2^EV; found from the picture if not given
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    exposure: Option<f32>,
    #[command(flatten)]
    show: ShowOptions,
    #[command(flatten)]
    reference: ReferenceOptions,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

pub fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let wrong = || "must be like 1280x720".to_owned();
    let (w, h) = text.split_once(['x', 'X', '×']).ok_or_else(wrong)?;
    Ok((
        w.parse().map_err(|_| wrong())?,
        h.parse().map_err(|_| wrong())?,
    ))
}

pub fn run(options: &Options) -> Result<()> {
    FileKind::of(&options.output)?;
    if let Some(ev) = options.exposure
        && !(-64.0..=64.0).contains(&ev)
    {
        return Err(Error::Usage(format!(
            "--exposure {ev}: must be in -64 to 64"
        )));
    }
    writable(&options.output)?;
    let path = Path::new(&options.input);
    let is_bake = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
    if options.reference.reference {
        if is_bake {
            return Err(Error::Usage(format!(
                "{}: --reference draws a scene, not a bake",
                options.input
            )));
        }
        return run_reference(options);
    }
    let solve = &options.solve;
    let cache = solve.settings()?.relief.cache;
    let draw = |device: &Arc<Device>, scene: &Scene, lighting: Lighting<'_>, view: &View<'_>| {
        let lighting = Lighting {
            cache: cache.as_deref(),
            ..lighting
        };
        let parts = options.show.parts().iter();
        let pictures = parts
            .map(|&part| render(device, scene, options.show.apply(lighting, part), view))
            .collect::<Result<Vec<_>>>()?;
        options.device.check()?;
        options.write(&Picture::side_by_side(&pictures)?, view)
    };
    if is_bake {
        let bake = Bake::load(path)?;
        let scene = Builtin::scene_of(path, &bake)?;
        let camera = options.camera.of(&scene)?;
        let view = options.view(&camera);
        let device = options.device.open()?;
        return draw(&device, &scene, (&bake).into(), &view);
    }
    let settings = solve.settings()?;
    let scene = options.builtin.load(&options.input)?;
    let camera = options.camera.of(&scene)?;
    let view = options.view(&camera);
    let device = options.device.open()?;
    let solution = bake_visibly(&device, &scene, &settings)?;
    draw(&device, &scene, (&solution).into(), &view)
}

/// The same by the path tracer.
fn run_reference(options: &Options) -> Result<()> {
    let solve = &options.solve;
    let budget = solve.budget()?;
    let scene = options.builtin.load(&options.input)?;
    let camera = options.camera.of(&scene)?;
    let scene = reference::tessellated(scene);
    let view = options.view(&camera);
    let parts = options.show.parts().iter();
    let pictures = parts
        .map(|&part| {
            let settings = options.reference.settings(budget, solve.seed, part);
            Ok(reference::draw(&scene, &view, &settings)?.picture())
        })
        .collect::<Result<Vec<_>>>()?;
    options.write(&Picture::side_by_side(&pictures)?, &view)
}

impl Options {
    fn view<'a>(&self, camera: &'a Camera) -> View<'a> {
        View {
            camera,
            width: self.size.0,
            height: self.size.1,
        }
    }

    fn write(&self, picture: &Picture, view: &View<'_>) -> Result<()> {
        picture.write(&self.output, self.exposure)?;
        tracing::info!(
            "{}: {}x{}, camera {}",
            self.output.display(),
            picture.width,
            picture.height,
            view.camera.name
        );
        Ok(())
    }
}
