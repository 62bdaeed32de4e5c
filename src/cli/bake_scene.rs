//! The scene of a bake, read again.

use std::path::{Path, PathBuf};

use clap::Args;

use super::Builtin;
use mesolux::bake::solution::{Bake, Origin};
use mesolux::error::{Error, Result};
use mesolux::scene::{OnInput, Scene};

/// Where the scene of a bake lies.
#[derive(Args, Clone, Default)]
pub struct BakeScene {
    /// The scene of a BAKE, if it has moved; of a built-in scene, the statue's file
    #[arg(long = "scene", value_name = "FILE")]
    moved: Option<PathBuf>,
}

impl BakeScene {
    /// A bake and its scene.
    ///
    /// # Errors
    /// As [`Bake::load`] and [`Self::of`].
    pub fn load(&self, path: &Path) -> Result<(Bake, Scene)> {
        Bake::load_with(path, |origin, on_input| self.of(path, origin, on_input))
    }

    /// The scene of a bake in the file `path` that says this of it, cut as it was there: from the
    /// file that is given, or from where it lay as seen from the bake, or from where it was.
    ///
    /// # Errors
    /// A scene that is at none of these places, cannot be read, or is not the one that was baked.
    pub fn of(&self, path: &Path, origin: &Origin, on_input: &[OnInput]) -> Result<Scene> {
        if origin.file().is_none() {
            if let Some(moved) = &self.moved {
                return Err(Error::Usage(format!(
                    "--scene {}: {} is of the built-in scene {}, which has no file",
                    moved.display(),
                    path.display(),
                    origin.scene
                )));
            }
            return scene(path, on_input, origin);
        }
        let places = match &self.moved {
            Some(moved) => vec![moved.clone()],
            None => origin.places(path),
        };
        let mut first = None;
        for place in places.iter().filter(|place| place.is_file()) {
            match scene(path, on_input, &origin.moved(place)) {
                Ok(scene) => return Ok(scene),
                Err(error) => first.get_or_insert(error),
            };
        }
        Err(first.unwrap_or_else(|| {
            let names: Vec<String> = places.iter().map(|p| p.display().to_string()).collect();
            let what = match self.moved {
                Some(_) => format!("its scene is not at {}", names.join("")),
                None => format!(
                    "its scene is not at {}; if it has moved, --scene FILE says where it is",
                    names.join(", nor at ")
                ),
            };
            Error::file(path, what)
        }))
    }

    /// # Errors
    /// `--scene` beside `input`, which is no bake.
    pub fn refuse(&self, input: &str) -> Result<()> {
        match &self.moved {
            None => Ok(()),
            Some(moved) => Err(Error::Usage(format!(
                "--scene {}: {input} is no bake",
                moved.display()
            ))),
        }
    }
}

fn scene(path: &Path, on_input: &[OnInput], origin: &Origin) -> Result<Scene> {
    let builtin = Builtin {
        patches: origin.patches,
        statue: origin.statue.clone(),
        element_size: None,
        fineness: None,
        max_elements: 0,
        no_refine: true,
        no_heights_from_normals: !origin.import.heights_from_normals,
        z_up: origin.import.z_up,
        sides_as_given: origin.import.sides_as_given,
    };
    let scene = builtin.load(&origin.scene)?;
    let count = scene.triangles.len();
    let is_of_it = |on: &OnInput| (on.triangle as usize) < count;
    if scene.hash() != origin.hash || !on_input.iter().all(is_of_it) {
        let place = origin.file().map(|file| file.display().to_string());
        return Err(Error::file(
            path,
            format!(
                "its scene {} has changed since, or is another one; bake it again, or name the \
                 one that was baked by --scene FILE",
                place.as_ref().unwrap_or(&origin.scene)
            ),
        ));
    }
    let is_whole = |(t, on): (u32, &OnInput)| *on == OnInput::whole(t);
    let same = on_input.len() == count && (0..).zip(on_input).all(is_whole);
    match same {
        true => Ok(scene),
        false => Ok(scene.cut_as(on_input)),
    }
}
