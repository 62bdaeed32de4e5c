//! `mesolux view`.

use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use clap::Args;

use super::bake::{beside, origin};
use super::bake_scene::BakeScene;
use super::baked::is_bake;
use super::camera::CameraOptions;
use super::output::writable;
use super::render::size;
use super::solve_options::SolveOptions;
use super::{Builtin, DeviceOptions};
use mesolux::bake::quality::Quality;
use mesolux::error::{Error, Result};
use mesolux::scene::builtin;
use mesolux::solver::Visibility;
use mesolux::view::{self, DeviceChoice, Opened, Session, Step};
use mesolux::vk;

/// Show a scene in a window while it bakes, or a bake
///
/// The middle button of the mouse orbits, with Shift it pans, the wheel zooms; Alt with the left
/// button acts as the middle button. The right button looks about, W A S D Q E fly, Shift faster. 1
/// 2 3: all, direct, indirect light. Lights are dragged by their marks. F1 lists the other keys.
/// Changed lights are shown by kept form factors.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE", default_value = "brick-corner")]
    input: String,
    /// Pixels across and down
    #[arg(long, value_name = "WxH", default_value = "1024x640", value_parser = size)]
    size: (u32, u32),
    #[command(flatten)]
    bake_scene: BakeScene,
    #[command(flatten)]
    camera: CameraOptions,
    /// Draw so many frames, then close
    #[arg(long, value_name = "N", conflicts_with = "script")]
    frames: Option<u64>,
    /// Write the window's last frame, with --frames
    #[arg(long, value_name = "OUT.png", requires = "frames")]
    screenshot: Option<PathBuf>,
    /// Do what a script says, one step a line, then close: move X Y, press|release
    /// left|middle|right, wheel N, key [Ctrl+][Shift+]NAME [down|up], see front|right|top, resize W
    /// H, minimise, restore W H, set SWITCH VALUE, set lamp NAME colour|strength|position N...,
    /// compare held|traced|off, line X, frames N, wait SECONDS, open SCENE|BAKE, bake, direct,
    /// relit, detail, compared, overlays, await FILE, list FILE (controls and texts as JSON),
    /// screenshot FILE, save FILE, save-bake FILE, lose-surface, close
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    #[command(flatten)]
    solve: SolveOptions,
    #[command(flatten)]
    builtin: Builtin,
    #[command(flatten)]
    device: DeviceOptions,
}

/// Largest window.
const MOST_PIXELS: u32 = 16_384;

impl Options {
    fn steps(&self) -> Result<Option<Vec<Step>>> {
        if let Some(path) = &self.script {
            return view::read_script(path).map(Some);
        }
        let Some(frames) = self.frames else {
            return Ok(None);
        };
        let mut steps = vec![Step::Frames(frames)];
        if let Some(path) = &self.screenshot {
            if !path
                .extension()
                .is_some_and(|e| e.eq_ignore_ascii_case("png"))
            {
                return Err(Error::Usage(format!(
                    "--screenshot {}: the name must end in .png",
                    path.display()
                )));
            }
            writable(path)?;
            steps.push(Step::Screenshot(path.clone()));
        }
        Ok(Some(steps))
    }
}

/// How scenes of the window are read.
struct Reader {
    builtin: Builtin,
    bake_scene: BakeScene,
    quality: Quality,
}

impl Reader {
    fn open(&self, input: &str) -> Result<Opened> {
        let path = Path::new(input);
        let (scene, bake, kept) = if is_bake(input) {
            let (bake, scene) = self.bake_scene.load(path)?;
            let beside = beside(path);
            let kept = match beside.is_file() {
                true => Some(Visibility::load(&beside)?),
                false => None,
            };
            (scene, Some(bake), kept)
        } else {
            self.bake_scene.refuse(input)?;
            (self.builtin.load_for(self.quality, input)?, None, None)
        };
        let camera = CameraOptions::default().of(&scene)?;
        Ok(Opened {
            name: input.to_owned(),
            scene,
            bake,
            kept,
            camera,
        })
    }
}

/// Folder of scenes that ship with the program, in the working directory.
const ASSETS: &str = "assets";
/// Name of a scene's file in its folder.
const SCENE: &str = "scene.toml";

/// Scenes that the window offers: `input`, the built-in ones, those in `assets`, and those beside
/// `input`.
fn offered(input: &str) -> Vec<String> {
    let mut offered = vec![input.to_owned()];
    offered.extend(builtin::NAMES.map(str::to_owned));
    let shown = Path::new(input);
    let beside = shown.parent().and_then(Path::parent);
    let beside = beside.filter(|_| shown.file_name().is_some_and(|name| name == SCENE));
    let folders = [Some(Path::new(ASSETS)), beside];
    for folder in folders.into_iter().flatten() {
        let found = std::fs::read_dir(folder).into_iter().flatten().flatten();
        let scenes = found.map(|entry| entry.path().join(SCENE));
        let mut scenes: Vec<_> = scenes.filter(|path| path.is_file()).collect();
        scenes.sort();
        offered.extend(scenes.iter().map(|path| path.display().to_string()));
    }
    let mut seen = HashSet::new();
    offered.retain(|name| seen.insert(name.clone()));
    offered
}

pub fn run(options: &Options, start: Instant) -> Result<()> {
    let script = options.steps()?;
    let (width, height) = options.size;
    if !(1..=MOST_PIXELS).contains(&width) || !(1..=MOST_PIXELS).contains(&height) {
        return Err(Error::Usage(format!(
            "--size {width}x{height}: sides must be in 1 to {MOST_PIXELS}"
        )));
    }
    let settings = options.solve.settings()?;
    settings.check()?;
    let reader = Reader {
        builtin: options.builtin.clone(),
        bake_scene: options.bake_scene.clone(),
        quality: options.solve.quality(),
    };
    let mut opened = reader.open(&options.input)?;
    opened.camera = options.camera.of(&opened.scene)?;
    // Those of the scene that was given.
    let reader = Reader {
        builtin: Builtin {
            statue: None,
            patches: None,
            ..reader.builtin
        },
        bake_scene: BakeScene::default(),
        ..reader
    };
    let (builtin, solve) = (options.builtin.clone(), options.solve.clone());
    let lines = view::run(view::Options {
        opened,
        session: Session {
            settings,
            device: DeviceChoice::new(options.device.device.clone(), options.device.validate),
            offered: offered(&options.input).into(),
            open: Arc::new(move |name| reader.open(name)),
            save: Arc::new(move |path, name, scene, solution, settings| {
                let origin = origin(name, &builtin, scene.input_hash());
                let filled = solve.solved_by(settings).filled()?;
                solution.save(path, &origin, &filled)
            }),
        },
        size: options.size,
        script,
        start,
    })?;
    for line in lines {
        tracing::info!("{line}");
    }
    match vk::left() {
        None => tracing::info!("closed: nothing is left on the devices"),
        Some(vk::Left { devices, bytes }) => {
            return Err(Error::Device(format!(
                "{devices} devices and {bytes} bytes in buffers and images were not freed"
            )));
        }
    }
    options.device.check()
}
