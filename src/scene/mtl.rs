//! Wavefront MTL material libraries: `Kd`, `Ke` and maps; what else would change the light is
//! reported.

use std::collections::HashSet;
use std::path::Path;

use super::Material;
use super::material::{DEFAULT_KD, MadeUp, TextureCache};
use super::mtl_maps::{self, Maps};
use super::obj_lint::{brief, finite, statements};
use super::said::Said;
use super::uv::OnSurface;
use crate::error::{Error, Result};
use crate::input_file::read_text;

#[derive(Default)]
pub(super) struct Library {
    /// In the order of the file.
    pub materials: Vec<Material>,
    /// Where the maps of each lie, `[material]`.
    pub on_surface: Vec<OnSurface>,
    pub made_up: Vec<MadeUp>,
    pub said: Said,
}

/// Reads a library with its textures, whose paths are relative to it.
///
/// # Errors
/// The first wrong line; a material whose numbers or texture cannot be used.
pub(super) fn read(path: &Path, textures: &mut TextureCache) -> Result<Library> {
    let checked = check(path, &read_text(path)?)?;
    let (read, _) = tobj::load_mtl_buf(&mut checked.text.as_bytes())
        .map_err(|error| Error::file(path, error.to_string()))?;

    let mut library = Library {
        said: checked.said,
        ..Library::default()
    };
    assert_eq!(
        read.len(),
        checked.maps.len(),
        "tobj and the check see the same materials"
    );
    for (material, maps) in read.into_iter().zip(&checked.maps) {
        // A texture without a factor is the reflectance itself.
        let default = match maps.has_reflectance() {
            true => 1.0,
            false => DEFAULT_KD,
        };
        let default_ke = if maps.has_emission() { 1.0 } else { 0.0 };
        if material.diffuse.is_none() {
            library.made_up.push(MadeUp {
                material: material.name.clone(),
                kd: default,
            });
        }
        let mut material = Material {
            kd: material
                .diffuse
                .map_or([default; 3], |kd| kd.map(|c| c as f32)),
            ke: material
                .emissive
                .map_or([default_ke; 3], |ke| ke.map(|c| c as f32)),
            name: material.name,
            ..Material::default()
        };
        let on_surface = maps.read(path, textures, &mut material, &mut library.said)?;
        library.on_surface.push(on_surface);
        material.check().map_err(|what| Error::Material {
            path: path.to_owned(),
            material: material.name.clone(),
            what,
        })?;
        library.materials.push(material);
    }
    Ok(library)
}

#[derive(Default)]
struct Checked {
    /// The text for tobj: `newmtl`, `Kd` and `Ke`.
    text: String,
    /// `[material]`, in the order of the file.
    maps: Vec<Maps>,
    said: Said,
}

/// Statements about what a diffuse surface does not have: gloss, and the quality of a picture.
const NOT_DIFFUSE: [&str; 23] = [
    "Ka",
    "Ks",
    "Ns",
    "Ni",
    "illum",
    "sharpness",
    "Pr",
    "Pm",
    "Ps",
    "Pc",
    "Pcr",
    "aniso",
    "anisor",
    "map_Ka",
    "map_Ks",
    "map_Ns",
    "map_Pr",
    "map_Pm",
    "map_Ps",
    "map_refl",
    "refl",
    "map_aat",
    "Tf",
];

/// Checks the text line by line. tobj panics at a `Ka`, `Kd`, `Ks` or `Ke` that is too short, and
/// does not read all statements of maps.
fn check(path: &Path, text: &str) -> Result<Checked> {
    let mut checked = Checked::default();
    let mut names: Vec<String> = Vec::new();
    let mut known = HashSet::new();
    for (line, statement) in statements(text) {
        let statement = statement.trim();
        if statement.is_empty() || statement.starts_with('#') {
            continue;
        }
        let (keyword, rest) = statement
            .split_once(char::is_whitespace)
            .map_or((statement, ""), |(keyword, rest)| (keyword, rest.trim()));
        let operands = rest.split_once('#').map_or(rest, |(numbers, _)| numbers);
        let named = |names: &[String]| names.last().map(|name| format!("material \"{name}\": "));
        let warn = |what: String| {
            let material = named(&names).unwrap_or_default();
            format!("{}:{line}: {material}{what}", path.display())
        };
        let done = match keyword {
            "newmtl" => new_material(rest, &mut names, &mut known),
            "Kd" | "Ke" => colour(keyword, rest),
            "d" | "Tr" => match opacity(keyword, operands) {
                Ok(opacity) if opacity < 1.0 => {
                    let what = format!("{keyword}: surfaces are opaque, not {opacity}");
                    checked.said.warnings.push(warn(what));
                    Ok(())
                }
                other => other.map(|_| ()),
            },
            _ if mtl_maps::is_keyword(keyword) => match checked.maps.last_mut() {
                Some(maps) => maps.add(keyword, rest, line),
                None => Ok(()),
            },
            _ if NOT_DIFFUSE.contains(&keyword) => Ok(()),
            _ => {
                let what = format!("{} is not used", brief(keyword));
                checked.said.warnings.push(warn(what));
                continue;
            }
        };
        let done = done.and_then(|()| match names.is_empty() {
            true => Err(format!("{keyword} stands before the first newmtl")),
            false => Ok(()),
        });
        done.map_err(|what| {
            let material = match keyword {
                "newmtl" => None,
                _ => named(&names),
            };
            Error::line(path, line, material.unwrap_or_default() + &what)
        })?;
        checked.maps.resize_with(names.len(), Maps::default);
        match keyword {
            "newmtl" => checked.text.push_str(&format!("newmtl {rest}\n")),
            "Kd" | "Ke" => checked.text.push_str(&format!("{keyword} {operands}\n")),
            _ => {}
        }
    }
    Ok(checked)
}

/// `d`, which may have the option `-halo`, or 1 − `Tr`.
fn opacity(keyword: &str, operands: &str) -> Result<f64, String> {
    let number = operands.split_whitespace().find(|word| *word != "-halo");
    let number = finite(number.unwrap_or("")).map_err(|what| format!("{keyword}: {what}"))?;
    Ok(match keyword {
        "Tr" => 1.0 - number,
        _ => number,
    })
}

fn new_material(
    name: &str,
    names: &mut Vec<String>,
    known: &mut HashSet<String>,
) -> Result<(), String> {
    if name.is_empty() {
        return Err("newmtl has no name".into());
    }
    if !known.insert(name.to_owned()) {
        return Err(format!("material \"{}\" is defined twice", brief(name)));
    }
    names.push(name.to_owned());
    Ok(())
}

fn colour(keyword: &str, rest: &str) -> Result<(), String> {
    let numbers: Vec<&str> = rest
        .split_whitespace()
        .take_while(|word| !word.starts_with('#'))
        .collect();
    for word in &numbers {
        let number = finite(word).map_err(|what| format!("{keyword}: {what}"))?;
        if !(number as f32).is_finite() {
            return Err(format!("{keyword}: \"{}\" is too large", brief(word)));
        }
    }
    match numbers.len() {
        3 => Ok(()),
        found => Err(format!("{keyword} needs 3 numbers, found {found}")),
    }
}
