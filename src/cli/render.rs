//! `mesolux render`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::parser::ValueSource;
use clap::{ArgMatches, Args, Id};

use super::bake::{SolveOptions, bake_visibly, origin, writable};
use super::bake_scene::BakeScene;
use super::camera::CameraOptions;
use super::progress::interrupted;
use super::reference::{self, ReferenceOptions};
use super::series::{self, SeriesOptions};
use super::show::ShowOptions;
use super::{Builtin, DeviceOptions};
use mesolux::bake::cache::CachedBake;
use mesolux::bake::solution::Bake;
use mesolux::error::{Error, Result};
use mesolux::render::{FileKind, Lighting, Picture, Renderer, SAMPLES, View};
use mesolux::scene::{Camera, Scene};
use mesolux::solver::Settings;
use mesolux::vk::Device;

/// Draw a scene or a bake to a picture
///
/// A PNG is exposed and tone-mapped; an EXR holds linear radiance. A SCENE is baked first, with the
/// options of `bake`, and the bake is kept for the next time; or it is path traced with
/// --reference.
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
    bake_scene: BakeScene,
    #[command(flatten)]
    camera: CameraOptions,
    /// Multiplies the light by 2^EV; found from the picture if not given
    #[arg(long, value_name = "EV", allow_hyphen_values = true)]
    exposure: Option<f32>,
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

/// Options of a bake that drawing one uses as well.
const USED_WITH_A_BAKE: [&str; 2] = ["cache", "no_cache"];

/// # Errors
/// An option on the command line that says how a scene is read or baked, beside a bake.
pub fn refuse_baking(given: &ArgMatches, bake: &str) -> Result<()> {
    for group in ["SolveOptions", "Builtin"] {
        let Ok(Some(options)) = given.try_get_many::<Id>(group) else {
            continue;
        };
        for option in options {
            let is_given = given.value_source(option.as_str()) == Some(ValueSource::CommandLine);
            if is_given && !USED_WITH_A_BAKE.contains(&option.as_str()) {
                return Err(Error::Usage(format!(
                    "{bake} is a bake already, which --{} has no effect on",
                    option.as_str().replace('_', "-")
                )));
            }
        }
    }
    Ok(())
}

pub fn run(options: &Options, given: &ArgMatches) -> Result<()> {
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
    match is_bake {
        true => refuse_baking(given, &options.input)?,
        false => options.bake_scene.refuse(&options.input)?,
    }
    if options.reference.reference {
        if is_bake {
            return Err(Error::Usage(format!(
                "{}: --reference draws a scene, not a bake",
                options.input
            )));
        }
        return run_reference(options);
    }
    let settings = options.solve.settings()?;
    let folder = settings.relief.cache.as_deref();
    let (scene, bake) = if is_bake {
        let bake = Bake::load(path)?;
        (options.bake_scene.of(path, &bake)?, Some(bake))
    } else {
        settings.check()?;
        let quality = options.solve.quality();
        (options.builtin.load_for(quality, &options.input)?, None)
    };
    // Errors in the views are reported before the bake.
    let camera = options.camera.of(&scene)?;
    let cameras = options.series.cameras(&scene, &camera)?;
    let device = options.device.open()?;
    let found = match (bake, folder) {
        (Some(bake), _) => Some(bake),
        (None, Some(folder)) => kept_bake(&options.cached(folder, &scene, &settings, &device)),
        (None, None) => None,
    };
    let solution = match &found {
        Some(_) => None,
        None => Some(bake_visibly(&device, &scene, &settings)?),
    };
    if let (Some(solution), Some(folder)) = (&solution, folder) {
        let origin = origin(&options.input, &options.builtin, scene.input_hash());
        let cached = options.cached(folder, &scene, &settings, &device);
        match cached.save(solution, &origin, &options.solve) {
            Ok(true) => tracing::info!("bake kept as {}", cached.path.display()),
            Ok(false) => tracing::info!("a bake that was stopped is not kept"),
            Err(error) => tracing::warn!("the bake is not kept: {error}"),
        }
    }
    let lighting = match (&found, &solution) {
        (Some(bake), _) => Lighting::from(bake),
        (None, Some(solution)) => Lighting::from(solution),
        (None, None) => unreachable!("a scene is baked where no bake was found"),
    };
    let lighting = Lighting {
        cache: folder,
        ..lighting
    };
    options.draw(&device, &scene, lighting, &camera, cameras.as_deref())?;
    options.device.check()
}

/// The cached bake, if there is one.
fn kept_bake(cached: &CachedBake) -> Option<Bake> {
    match cached.load() {
        Ok(found) => {
            if found.is_some() {
                tracing::info!("bake found in the cache: {}", cached.path.display());
            }
            found
        }
        Err(error) => {
            tracing::warn!("{error}; baking again");
            None
        }
    }
}

/// Identity of the program's build: a rebuilt one may bake differently.
fn program() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let built = std::env::current_exe()
        .and_then(std::fs::metadata)
        .and_then(|file| Ok((file.len(), file.modified()?)));
    match built {
        Ok((length, at)) => format!("mesolux {version} {length} {at:?}"),
        Err(_) => format!("mesolux {version}"),
    }
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
    match cameras {
        None => options.write(&trace(&camera)?, &camera),
        Some(cameras) => series::draw(&options.output, &cameras, options.exposure, |camera| {
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

    /// The place of this bake in the cache.
    fn cached(
        &self,
        folder: &Path,
        scene: &Scene,
        settings: &Settings,
        device: &Device,
    ) -> CachedBake {
        let maker = format!("{} on {}", program(), device.name());
        CachedBake::new(folder, scene, settings, &maker)
    }

    /// One picture, or a series of them.
    fn draw(
        &self,
        device: &Arc<Device>,
        scene: &Scene,
        lighting: Lighting<'_>,
        camera: &Camera,
        cameras: Option<&[Camera]>,
    ) -> Result<()> {
        let first = cameras.and_then(|c| c.first()).unwrap_or(camera);
        let parts = self.show.parts().iter();
        let mut renderers = parts
            .map(|&part| {
                let lighting = self.show.apply(lighting, part);
                Renderer::new(device, scene, lighting, &self.view(first), SAMPLES)
            })
            .collect::<Result<Vec<_>>>()?;
        let drawn = |renderers: &[Renderer<'_>]| {
            let pictures = renderers.iter().map(Renderer::picture);
            Picture::side_by_side(&pictures.collect::<Result<Vec<_>>>()?)
        };
        let Some(cameras) = cameras else {
            return self.write(&drawn(&renderers)?, camera);
        };
        series::draw(&self.output, cameras, self.exposure, |camera| {
            for renderer in &mut renderers {
                renderer.look(&self.view(camera))?;
            }
            Ok(Some(drawn(&renderers)?))
        })
    }

    fn write(&self, picture: &Picture, camera: &Camera) -> Result<()> {
        picture.write(&self.output, self.exposure)?;
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
