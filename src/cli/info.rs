//! `mesolux info`.

use std::path::Path;

use clap::{ArgMatches, Args};
use serde::Serialize;
use serde_json::Value;

use super::baked::refuse_baking;
use super::{Builtin, devices, inside};
use mesolux::bake::quality::Quality;
use mesolux::bake::solution::{About, Origin};
use mesolux::error::{Error, Result};
use mesolux::scene::contents::{Contents, ElementCounts};

/// Show what is inside a scene or a bake, or which Vulkan devices there are
///
/// Of a scene: vertices, triangles, elements, meshes, materials, lights, cameras, bounds, warnings.
/// Of a bake also settings, bounds of error and what the solver did. Without either: the Vulkan
/// devices, their limits, and what each can run.
#[derive(Args)]
pub struct Options {
    /// A scene (see `bake`) or a bake (.safetensors)
    #[arg(value_name = "SCENE|BAKE")]
    input: Option<String>,
    /// Print JSON on stdout
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    builtin: Builtin,
}

/// What is inside a scene or a bake.
#[derive(Serialize)]
pub struct Inside {
    /// As on the command line.
    pub input: String,
    pub contents: Option<Contents>,
    pub elements: Option<ElementCounts>,
    pub bake: Option<Baked>,
}

/// What only a bake has.
#[derive(Serialize)]
pub struct Baked {
    pub program: String,
    pub origin: Origin,
    pub elements: usize,
    pub settings: Value,
    pub report: Value,
}

pub fn run(options: &Options, given: &ArgMatches) -> Result<()> {
    let Some(input) = &options.input else {
        return devices::run(options.json);
    };
    let path = Path::new(input);
    let is_bake = path
        .extension()
        .is_some_and(|e| e.eq_ignore_ascii_case("safetensors"));
    let inside = match is_bake {
        true => {
            refuse_baking(given, input)?;
            of_bake(input, About::load(path)?)
        }
        false => of_scene(input, &options.builtin)?,
    };
    match options.json {
        true => {
            let text = serde_json::to_string(&inside).map_err(|e| Error::Usage(e.to_string()))?;
            mesolux::say!("{text}");
        }
        false => inside::print(&inside),
    }
    Ok(())
}

fn of_bake(input: &str, about: About) -> Inside {
    let (contents, elements) = about.contents.unzip();
    Inside {
        input: input.to_owned(),
        contents,
        elements,
        bake: Some(Baked {
            program: about.program,
            origin: about.origin,
            elements: about.elements,
            settings: about.settings,
            report: about.report,
        }),
    }
}

fn of_scene(input: &str, builtin: &Builtin) -> Result<Inside> {
    let scene = builtin.refined(input, builtin.read(input)?, Quality::default());
    let contents = Contents::of(&scene);
    let on_input = scene.on_input();
    let of = on_input.iter().zip(&scene.triangles);
    let elements = contents
        .count(of.map(|(on, triangle)| (on.triangle, triangle.material)))
        .map_err(|what| Error::Scene {
            scene: input.to_owned(),
            what,
        })?;
    Ok(Inside {
        input: input.to_owned(),
        contents: Some(contents),
        elements: Some(elements),
        bake: None,
    })
}
