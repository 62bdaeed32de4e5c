//! The scene and the bake of commands that use one: read, found in the cache, or made.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::parser::ValueSource;
use clap::{ArgMatches, Id};

use super::Builtin;
use super::bake::{bake_visibly, origin};
use super::bake_scene::BakeScene;
use super::solve_options::SolveOptions;
use mesolux::bake::cache::CachedBake;
use mesolux::bake::solution::Bake;
use mesolux::error::{Error, Result};
use mesolux::scene::Scene;
use mesolux::solver::Settings;
use mesolux::vk::Device;

/// What names a scene or a bake, and how a scene is baked.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    pub input: &'a str,
    pub bake_scene: &'a BakeScene,
    pub solve: &'a SolveOptions,
    pub builtin: &'a Builtin,
}

/// A scene that was read, with its bake if that is a file.
pub struct Opened<'a> {
    of: Wanted<'a>,
    pub scene: Scene,
    bake: Option<Bake>,
    settings: Settings,
}

/// Options of a bake that using one takes as well.
const USED_WITH_A_BAKE: [&str; 2] = ["cache", "no_cache"];

/// Whether a command's input is a bake, by its name.
pub fn is_bake(input: &str) -> bool {
    let extension = Path::new(input).extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("safetensors"))
}

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

impl<'a> Wanted<'a> {
    /// # Errors
    /// Options that do not fit the input.
    pub fn check(&self, given: &ArgMatches) -> Result<()> {
        match is_bake(self.input) {
            true => refuse_baking(given, self.input),
            false => self.bake_scene.refuse(self.input),
        }
    }

    /// Reads the scene, and the bake if that is what is named.
    pub fn open(self) -> Result<Opened<'a>> {
        let settings = self.solve.settings()?;
        let path = Path::new(self.input);
        let (scene, bake) = if is_bake(self.input) {
            let (bake, scene) = self.bake_scene.load(path)?;
            (scene, Some(bake))
        } else {
            settings.check()?;
            let quality = self.solve.quality();
            (self.builtin.load_for(quality, self.input)?, None)
        };
        Ok(Opened {
            of: self,
            scene,
            bake,
            settings,
        })
    }
}

impl Opened<'_> {
    /// Where bakes and what reliefs see of themselves are kept; None with `--no-cache`.
    pub fn cache(&self) -> Option<PathBuf> {
        self.settings.relief.cache.clone()
    }

    /// The scene with its bake, found in the cache or made.
    pub fn baked(self, device: &Arc<Device>) -> Result<(Scene, Bake)> {
        if let Some(bake) = self.bake {
            return Ok((self.scene, bake));
        }
        let cached = self.cache().map(|folder| {
            let maker = format!("{} on {}", program(), device.name());
            CachedBake::new(&folder, &self.scene, &self.settings, &maker)
        });
        if let Some(bake) = cached.as_ref().and_then(kept_bake) {
            return Ok((self.scene, bake));
        }
        let solution = bake_visibly(device, &self.scene, &self.settings)?;
        let Wanted { input, builtin, .. } = self.of;
        let origin = origin(input, builtin, self.scene.input_hash());
        if let Some(cached) = &cached {
            match cached.save(&solution, &origin, self.of.solve) {
                Ok(true) => tracing::info!("bake kept as {}", cached.path.display()),
                Ok(false) => tracing::info!("a bake that was stopped is not kept"),
                Err(error) => tracing::warn!("the bake is not kept: {error}"),
            }
        }
        Ok((self.scene, solution.into_bake(origin)))
    }
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
pub fn program() -> String {
    let version = env!("CARGO_PKG_VERSION");
    let built = std::env::current_exe()
        .and_then(std::fs::metadata)
        .and_then(|file| Ok((file.len(), file.modified()?)));
    match built {
        Ok((length, at)) => format!("mesolux {version} {length} {at:?}"),
        Err(_) => format!("mesolux {version}"),
    }
}
