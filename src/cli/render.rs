//! `mesolux render`.

use std::path::PathBuf;
use std::sync::Arc;

use clap::{ArgMatches, Args};

use super::bake_scene::BakeScene;
use super::baked::{Wanted, is_bake};
use super::camera::CameraOptions;
use super::develop::DevelopOptions;
use super::output::writable;
use super::progress::interrupted;
use super::reference::{self, ReferenceOptions};
use super::series::{self, SeriesOptions};
use super::show::ShowOptions;
use super::solve_options::SolveOptions;
use super::{Builtin, DeviceOptions};
use mesolux::error::{Error, Result};
use mesolux::render::{Development, FileKind, Lighting, Picture, Renderer, SAMPLES, View};
use mesolux::scene::{Camera, Scene};
use mesolux::vk::Device;

/// Draw a scene or a bake to a picture
///
/// A PNG is exposed and tone-mapped; an EXR or HDR holds linear radiance. A SCENE is baked first,
/// with the options of `bake`, and the bake is kept for the next time; or it is path traced with
/// --reference.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE")]
    input: String,
    /// The picture to write: .png, .exr or .hdr
    #[arg(short, long, value_name = "IMAGE.png|.exr|.hdr")]
    output: PathBuf,
    /// Pixels across and down
    #[arg(long, value_name = "WxH", default_value = "800x800", value_parser = size)]
    size: (u32, u32),
    /// Samples of each pixel: 16, 64, 256 or 1024
    ///
    /// More make edges and fine relief smoother, and take as many times as long.
    #[arg(long, value_name = "N", default_value = "16", value_parser = samples_per_side,
        conflicts_with = "reference")]
    samples: u32,
    #[command(flatten)]
    bake_scene: BakeScene,
    #[command(flatten)]
    camera: CameraOptions,
    #[command(flatten)]
    develop: DevelopOptions,
    #[command(flatten)]
    series: SeriesOptions,
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

/// Along a side of a pixel.
pub fn samples_per_side(text: &str) -> std::result::Result<u32, String> {
    let sides = [1, 2, 4, 8].map(|times| times * SAMPLES);
    let count = text.parse();
    (sides.into_iter().find(|side| count == Ok(side * side)))
        .ok_or_else(|| "must be 16, 64, 256 or 1024".to_owned())
}

pub fn run(options: &Options, given: &ArgMatches) -> Result<()> {
    FileKind::of(&options.output)?;
    options.develop.check(!options.reference.reference)?;
    writable(&options.output)?;
    let wanted = Wanted {
        input: &options.input,
        bake_scene: &options.bake_scene,
        solve: &options.solve,
        builtin: &options.builtin,
    };
    wanted.check(given)?;
    if options.reference.reference {
        if is_bake(&options.input) {
            return Err(Error::Usage(format!(
                "{}: --reference draws a scene, not a bake",
                options.input
            )));
        }
        return run_reference(options);
    }
    let read = || {
        let opened = wanted.open()?;
        // Errors in the views are reported before the bake.
        let camera = options.camera.of(&opened.scene)?;
        let cameras = options.series.cameras(&opened.scene, &camera)?;
        Ok((opened, camera, cameras))
    };
    let (device, (opened, camera, cameras)) = options.device.open_beside(read)?;
    let cache = opened.cache();
    let (scene, bake) = opened.baked(&device)?;
    let lighting = Lighting {
        cache: cache.as_deref(),
        ..Lighting::from(&bake)
    };
    let development = options.develop.of(Some((&scene, &bake)));
    let cameras = cameras.as_deref();
    options.draw(&device, &scene, lighting, (&camera, cameras), development)?;
    options.device.check()
}

/// The same by the path tracer.
fn run_reference(options: &Options) -> Result<()> {
    let solve = &options.solve;
    let budget = solve.budget()?;
    let scene = options.builtin.load(&options.input)?;
    let camera = options.camera.of(&scene)?;
    let cameras = options.series.cameras(&scene, &camera)?;
    let scene = reference::tessellated(scene)?;
    let trace = |camera: &Camera| {
        let view = options.view(camera);
        let parts = options.show.parts().iter();
        let pictures = parts
            .map(|&part| {
                let settings = options.reference.settings(budget, solve.seed, part);
                Ok(reference::draw(&scene, &view, &settings)?.picture())
            })
            .collect::<Result<Vec<_>>>()?;
        Picture::side_by_side(&pictures)
    };
    let development = options.develop.of(None);
    match cameras {
        None => options.write(&trace(&camera)?, &camera, development),
        Some(cameras) => series::draw(&options.output, &cameras, development, |camera| {
            let picture = trace(camera)?;
            // Fewer paths than in the other pictures would be visible.
            Ok((!interrupted()).then_some(picture))
        }),
    }
}

impl Options {
    fn view<'a>(&self, camera: &'a Camera) -> View<'a> {
        View {
            camera,
            width: self.size.0,
            height: self.size.1,
        }
    }

    /// One picture, or a series of them.
    fn draw(
        &self,
        device: &Arc<Device>,
        scene: &Scene,
        lighting: Lighting<'_>,
        (camera, cameras): (&Camera, Option<&[Camera]>),
        development: Development,
    ) -> Result<()> {
        let first = cameras.and_then(|c| c.first()).unwrap_or(camera);
        let parts = self.show.parts().iter();
        let mut renderers = parts
            .map(|&part| {
                let lighting = self.show.apply(lighting, part);
                Renderer::new(device, scene, lighting, &self.view(first), self.samples)
            })
            .collect::<Result<Vec<_>>>()?;
        let drawn = |renderers: &[Renderer<'_>]| {
            let pictures = renderers.iter().map(Renderer::picture);
            Picture::side_by_side(&pictures.collect::<Result<Vec<_>>>()?)
        };
        let Some(cameras) = cameras else {
            return self.write(&drawn(&renderers)?, camera, development);
        };
        series::draw(&self.output, cameras, development, |camera| {
            for renderer in &mut renderers {
                renderer.look(&self.view(camera))?;
            }
            Ok(Some(drawn(&renderers)?))
        })
    }

    fn write(&self, picture: &Picture, camera: &Camera, development: Development) -> Result<()> {
        picture.write(&self.output, development)?;
        tracing::info!(
            "{}: {}x{}, camera {}",
            self.output.display(),
            picture.width,
            picture.height,
            camera.name
        );
        Ok(())
    }
}
